#include "file.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/atomic_file.hpp"
#include "shell/messages.hpp"
#include "shell/option_words.hpp"

namespace pulson {
namespace {

/// Sets of coincident landmarks are found by sorting; a tolerance, as in find_coincident, would not define sets.
void count_coincident(const Points& points, ShapeFacts& facts) {
  std::vector<int> order;
  for (int a = 0; a < points.cols(); ++a)
    if (!points.col(a).hasNaN()) order.push_back(a);
  const auto is_before = [&](int a, int b) {
    const auto place = [&](int i) { return points.col(i); };
    return std::lexicographical_compare(place(a).begin(), place(a).end(), place(b).begin(), place(b).end());
  };
  std::stable_sort(order.begin(), order.end(), is_before);
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (is_before(order[i - 1], order[i])) continue;
    ++facts.coincident;
    if (!facts.first_coincident || order[i] < facts.first_coincident->second)
      facts.first_coincident = {order[i - 1], order[i]};
  }
}

bool repeats_end(const Points& points, const std::vector<int>& members) {
  return members.size() > 2 && points.col(members.front()) == points.col(members.back());
}

}  // namespace

ShapeFacts shape_facts(const Landmarks& shape) {
  ShapeFacts facts;
  facts.missing = incomplete_points(shape.points).size();
  count_coincident(shape.points, facts);
  for (const std::vector<int>& members : landmarks_by_group(shape))
    facts.repeats_end = facts.repeats_end || repeats_end(shape.points, members);
  facts.repeats_end = facts.repeats_end || (shape.count() > 2 && shape.points.leftCols(1) == shape.points.rightCols(1));
  return facts;
}

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kListed = 20;

std::string range(int low, int high) { return low == high ? std::to_string(low) : fmt::format("{} to {}", low, high); }

std::string points_of(const std::vector<Points>& lines) {
  std::size_t points = 0;
  for (const Points& line : lines) points += static_cast<std::size_t>(line.cols());
  return counted(points, "point");
}

/// A file and the facts about each of its shapes.
struct FileFacts {
  explicit FileFacts(LandmarkFile read) : file(std::move(read)) {
    file.warnings = in_option_words(std::move(file.warnings));
    for (const Landmarks& shape : file.shapes) shapes.push_back(shape_facts(shape));
  }

  LandmarkFile file;
  std::vector<ShapeFacts> shapes;
};

// ---- of all shapes

/// "12 to 14 in 2D"
std::string describe_sizes(const std::vector<Landmarks>& shapes) {
  const auto by_count = [](const Landmarks& a, const Landmarks& b) { return a.count() < b.count(); };
  const auto by_dimension = [](const Landmarks& a, const Landmarks& b) { return a.dimension() < b.dimension(); };
  const auto [fewest, most] = std::minmax_element(shapes.begin(), shapes.end(), by_count);
  const auto [least, highest] = std::minmax_element(shapes.begin(), shapes.end(), by_dimension);
  return fmt::format("{} in {}D", range(fewest->count(), most->count()),
                     range(least->dimension(), highest->dimension()));
}

/// "name  5 in 2 shapes", where there are any.
template <class Items, class Count>
void print_sum(const std::string& name, const Items& shapes, const Count& count) {
  std::size_t sum = 0;
  std::size_t with_any = 0;
  for (const auto& shape : shapes) {
    const std::size_t here = count(shape);
    sum += here;
    if (here > 0) ++with_any;
  }
  if (sum > 0) fmt::print("{:<11} {} in {}\n", name, sum, counted(with_any, "shape"));
}

void print_summary(const std::string& address, const FileFacts& facts) {
  const LandmarkFile& file = facts.file;
  fmt::print("{}: {} with {}\n", address, file.format, counted(file.shapes.size(), "shape"));
  if (!file.shapes.empty()) fmt::print("{:<11} {}\n", "landmarks", describe_sizes(file.shapes));
  print_sum("missing", facts.shapes, [](const ShapeFacts& shape) { return shape.missing; });
  print_sum("coincident", facts.shapes, [](const ShapeFacts& shape) { return shape.coincident; });
  print_sum("repeat end", facts.shapes, [](const ShapeFacts& shape) { return std::size_t{shape.repeats_end}; });
  if (!file.units.empty()) fmt::print("{:<11} {}\n", "units", file.units);
  if (!file.axes.empty()) fmt::print("{:<11} {}\n", "axes", file.axes);
  print_sum("images", file.shapes, [](const Landmarks& shape) { return std::size_t{!shape.image.empty()}; });
  print_sum("scales", file.shapes, [](const Landmarks& shape) { return std::size_t{shape.scale.has_value()}; });
  print_sum("curves", file.shapes, [](const Landmarks& shape) { return shape.curves.size(); });
  print_sum("outlines", file.shapes, [](const Landmarks& shape) { return shape.outlines.size(); });
}

// ---- of one

void print_points(const Landmarks& shape, const ShapeFacts& facts) {
  const auto [low, high] = bounding_box(shape.points);
  fmt::print(" in {}D", shape.dimension());
  for (int c = 0; c < shape.dimension() && !std::isnan(low[c]); ++c)
    fmt::print("{} {} {:.6g} to {:.6g}", c == 0 ? "," : "", "xyz"[c], low[c], high[c]);
  if (facts.missing > 0) fmt::print(", {} missing", facts.missing);
  if (const std::size_t groups = landmarks_by_group(shape).size(); groups > 1) fmt::print(", {} groups", groups);
  if (const auto& pair = facts.first_coincident)
    fmt::print(", {} and {} coincide", shape.describe(pair->first), shape.describe(pair->second));
  if (facts.coincident > 1) fmt::print(" and {} more", facts.coincident - 1);
  if (facts.repeats_end) fmt::print(", the last repeats the first");
}

void print_shape(std::size_t number, const Landmarks& shape, const ShapeFacts& facts) {
  fmt::print("{:>5}  {:<24} {:>5} landmarks", number, shape.name, shape.count());
  if (shape.count() > 0) print_points(shape, facts);
  if (!shape.image.empty()) fmt::print(", image {}", shape.image);
  if (shape.scale) fmt::print(", scale {}", *shape.scale);
  if (!shape.curves.empty()) fmt::print(", {} of {}", counted(shape.curves.size(), "curve"), points_of(shape.curves));
  if (!shape.outlines.empty())
    fmt::print(", {} of {}", counted(shape.outlines.size(), "outline"), points_of(shape.outlines));
  fmt::print("\n");
}

// ---- as JSON

Json shape_json(const Landmarks& shape, const ShapeFacts& facts) {
  return {{"name", shape.name},
          {"count", shape.count()},
          {"dimension", shape.dimension()},
          {"missing", facts.missing},
          {"coincident", facts.coincident},
          {"repeated_end", facts.repeats_end},
          {"image", shape.image},
          {"scale", shape.scale ? Json(*shape.scale) : Json(nullptr)},
          {"curves", shape.curves.size()},
          {"outlines", shape.outlines.size()}};
}

std::string file_json(const std::string& address, const FileFacts& facts) {
  const LandmarkFile& file = facts.file;
  Json json = {{"file", address}, {"format", file.format}, {"units", file.units}, {"axes", file.axes}};
  json["shapes"] = Json::array();
  for (std::size_t i = 0; i < file.shapes.size(); ++i)
    json["shapes"].push_back(shape_json(file.shapes[i], facts.shapes[i]));
  json["warnings"] = file.warnings;
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace

void print_file_info(const std::string& address, const FileInfoOptions& options) {
  if (!options.json.empty() && options.json != "-") check_output_file(options.json);
  const FileFacts facts(read_addressed_shapes(address, options.reading));
  if (options.json == "-") return fmt::print("{}", file_json(address, facts));
  if (!options.json.empty()) write_file_atomically(options.json, file_json(address, facts));
  print_summary(address, facts);
  const std::size_t count = facts.shapes.size();
  const std::size_t listed = options.all ? count : std::min(kListed, count);
  for (std::size_t i = 0; i < listed; ++i) print_shape(i + 1, facts.file.shapes[i], facts.shapes[i]);
  if (listed < count) fmt::print("       and {} more; --all lists them\n", count - listed);
  if (verbosity() == Verbosity::kQuiet) return;
  for (const std::string& warning : facts.file.warnings) fmt::print("note: {}\n", warning);
}

}  // namespace pulson
