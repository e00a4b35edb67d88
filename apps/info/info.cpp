// `pulson info`: the tables of names, or what is in a landmark file.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "audit/results.hpp"
#include "core/atomic_file.hpp"
#include "core/paths.hpp"
#include "info/columns.hpp"
#include "matching/defaults.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/path_options.hpp"
#include "shell/program.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

// ---- of a file

/// What `pulson info` reports about a shape besides its contents.
struct ShapeFacts {
  std::size_t missing = 0;                              ///< landmarks that have a missing coordinate and are not absent
  std::size_t coincident = 0;                           ///< landmarks at the place of an earlier one
  std::optional<std::pair<int, int>> first_coincident;  ///< the first of these and the one before it at its place
  /// The shape or a group of three or more ends where it begins: the last landmark repeats the first. Such are among
  /// the coincident ones.
  bool repeats_end = false;
};

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

/// In O(N log N).
ShapeFacts shape_facts(const Landmarks& shape) {
  ShapeFacts facts;
  facts.missing = missing_landmarks(shape).size();
  count_coincident(shape.points, facts);
  for (const std::vector<int>& members : landmarks_by_group(shape))
    facts.repeats_end = facts.repeats_end || repeats_end(shape.points, members);
  facts.repeats_end = facts.repeats_end || (shape.count() > 2 && shape.points.leftCols(1) == shape.points.rightCols(1));
  return facts;
}

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
  explicit FileFacts(formats::LandmarkFile read) : file(std::move(read)) {
    file.warnings = in_option_words(std::move(file.warnings));
    for (const Landmarks& shape : file.shapes) shapes.push_back(shape_facts(shape));
  }

  formats::LandmarkFile file;
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
  if (sum > 0) print_text("{:<11} {} in {}\n", name, sum, counted(with_any, "shape"));
}

void print_summary(const std::string& address, const FileFacts& facts) {
  const formats::LandmarkFile& file = facts.file;
  print_text("{}: {} with {}\n", address, file.format, counted(file.shapes.size(), "shape"));
  if (!file.shapes.empty()) print_text("{:<11} {}\n", "landmarks", describe_sizes(file.shapes));
  print_sum("missing", facts.shapes, [](const ShapeFacts& shape) { return shape.missing; });
  print_sum("absent", file.shapes, [](const Landmarks& shape) { return shape.absent.size(); });
  print_sum("coincident", facts.shapes, [](const ShapeFacts& shape) { return shape.coincident; });
  print_sum("repeat end", facts.shapes, [](const ShapeFacts& shape) { return std::size_t{shape.repeats_end}; });
  if (!file.units.empty()) print_text("{:<11} {}\n", "units", file.units);
  if (!file.axes.empty()) print_text("{:<11} {}\n", "axes", file.axes);
  print_sum("images", file.shapes, [](const Landmarks& shape) { return std::size_t{!shape.image.empty()}; });
  print_sum("scales", file.shapes, [](const Landmarks& shape) { return std::size_t{shape.scale.has_value()}; });
  print_sum("curves", file.shapes, [](const Landmarks& shape) { return shape.curves.size(); });
  print_sum("outlines", file.shapes, [](const Landmarks& shape) { return shape.outlines.size(); });
}

// ---- of one

void print_points(const Landmarks& shape, const ShapeFacts& facts) {
  const auto [low, high] = bounding_box(shape.points);
  print_text(" in {}D", shape.dimension());
  for (int c = 0; c < shape.dimension() && !std::isnan(low[c]); ++c)
    print_text("{} {} {:.6g} to {:.6g}", c == 0 ? "," : "", "xyz"[c], low[c], high[c]);
  if (facts.missing > 0) print_text(", {} missing", facts.missing);
  if (!shape.absent.empty()) print_text(", {} absent", shape.absent.size());
  if (const std::size_t groups = landmarks_by_group(shape).size(); groups > 1) print_text(", {} groups", groups);
  if (const auto& pair = facts.first_coincident)
    print_text(", {} and {} coincide", shape.describe(pair->first), shape.describe(pair->second));
  if (facts.coincident > 1) print_text(" and {} more", facts.coincident - 1);
  if (facts.repeats_end) print_text(", the last repeats the first");
}

void print_shape(std::size_t number, const Landmarks& shape, const ShapeFacts& facts) {
  print_text("{:>5}  {:<24} {:>5} landmarks", number, shape.name, shape.count());
  if (shape.count() > 0) print_points(shape, facts);
  if (!shape.image.empty()) print_text(", image {}", shape.image);
  if (shape.scale) print_text(", scale {}", *shape.scale);
  if (!shape.curves.empty()) print_text(", {} of {}", counted(shape.curves.size(), "curve"), points_of(shape.curves));
  if (!shape.outlines.empty())
    print_text(", {} of {}", counted(shape.outlines.size(), "outline"), points_of(shape.outlines));
  print_text("\n");
}

// ---- as JSON

std::string json_text(const Json& json) { return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

// What --json asks for. @return whether the text is to be printed, too
template <class MakeText>
bool write_json(const std::string& json, const MakeText& make) {
  if (json.empty()) return true;
  if (json == "-") {
    print_exact(make());
    return false;
  }
  check_output_file(json);
  write_file_atomically(json, make());
  return true;
}

Json shape_json(const Landmarks& shape, const ShapeFacts& facts) {
  return {{"name", shape.name},
          {"count", shape.count()},
          {"dimension", shape.dimension()},
          {"missing", facts.missing},
          {"absent", shape.absent.size()},
          {"coincident", facts.coincident},
          {"repeated_end", facts.repeats_end},
          {"image", shape.image},
          {"scale", shape.scale ? Json(*shape.scale) : Json(nullptr)},
          {"curves", shape.curves.size()},
          {"outlines", shape.outlines.size()}};
}

Json file_json(const std::string& address, const FileFacts& facts) {
  const formats::LandmarkFile& file = facts.file;
  Json json = {{"file", address}, {"format", file.format}, {"units", file.units}, {"axes", file.axes}};
  json["shapes"] = Json::array();
  for (std::size_t i = 0; i < file.shapes.size(); ++i)
    json["shapes"].push_back(shape_json(file.shapes[i], facts.shapes[i]));
  json["warnings"] = file.warnings;
  return json;
}

/// How `pulson info FILE` reads a file and describes it.
struct FileInfoOptions {
  bool all = false;
  std::string json;
  formats::ReadOptions reading;
};

/// Whether the shapes are a cohort that an audit judges within half a second or so: for n shapes of N landmarks it
/// takes 5 µs n N² in the plane, and twice that in space (measured for N from 45 to 220).
bool can_be_audited(const std::vector<Landmarks>& shapes) {
  constexpr std::size_t kFewest = 5, kMostCount = 300;
  constexpr double kMostWork = 1e5;
  if (shapes.size() < kFewest) return false;
  const auto count = static_cast<double>(shapes.front().count());
  return count <= kMostCount && static_cast<double>(shapes.size()) * count * count <= kMostWork;
}

/// A line where an audit finds something; nothing where the shapes are no cohort.
void print_audit_hint(const std::string& address, const std::vector<Landmarks>& shapes) {
  if (!can_be_audited(shapes)) return;
  try {
    const AuditResults results = judge_shapes(shapes, false);
    if (!results.audit.findings.empty())
      print_text("{:<11} {}; pulson audit {}\n", "audit", audit_verdict(results), shell_word(address));
  } catch (const InputError&) {
    return;  // of which `pulson audit` says why
  }
}

/// What the file, or one shape of it, holds: first of all shapes, then a line for each. @throws InputError
void print_file_info(const std::string& address, const FileInfoOptions& options) {
  const FileFacts facts(read_addressed_shapes(address, options.reading));
  if (!write_json(options.json, [&] { return json_text(file_json(address, facts)); })) return;
  print_summary(address, facts);
  print_audit_hint(address, facts.file.shapes);
  const std::size_t count = facts.shapes.size();
  const std::size_t listed = options.all ? count : std::min(kListed, count);
  for (std::size_t i = 0; i < listed; ++i) print_shape(i + 1, facts.file.shapes[i], facts.shapes[i]);
  if (listed < count) print_text("       and {} more; --all lists them\n", count - listed);
  if (verbosity() == Verbosity::kQuiet) return;
  for (const std::string& warning : facts.file.warnings) print_text("note: {}\n", warning);
}

/// A line for each of several files. @throws InputError
void print_files_info(const std::vector<std::string>& addresses, const FileInfoOptions& options) {
  std::vector<FileFacts> files;
  for (const std::string& address : addresses) files.emplace_back(read_addressed_shapes(address, options.reading));
  const auto json = [&] {
    Json all = Json::array();
    for (std::size_t i = 0; i < files.size(); ++i) all.push_back(file_json(addresses[i], files[i]));
    return json_text(Json{{"files", std::move(all)}});
  };
  if (!write_json(options.json, json)) return;
  std::size_t width = 0;
  for (const std::string& address : addresses) width = std::max(width, address.size());
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::vector<Landmarks>& shapes = files[i].file.shapes;
    print_text("{:<{}}  {}", addresses[i], width, counted(shapes.size(), "shape"));
    if (!shapes.empty()) print_text(", landmarks {}", describe_sizes(shapes));
    std::size_t missing = 0;
    for (const ShapeFacts& shape : files[i].shapes) missing += shape.missing;
    if (missing > 0) print_text(", {} missing", missing);
    print_text("\n");
  }
  if (verbosity() == Verbosity::kQuiet) return;
  for (const FileFacts& file : files)
    for (const std::string& warning : file.file.warnings) print_text("note: {}\n", warning);
}

// ---- of the tables

template <class Make>
void print_table(const NameTable<Make>& table) {
  for (const auto& row : table.rows()) {
    print_text("{:<18} {}\n", row.name, row.help);
    for (const ParameterInfo& parameter : row.parameters)
      print_text("    {:<14} {}{}\n", parameter.name, parameter.help,
                 parameter.default_text.empty() ? "" : " [" + parameter.default_text + "]");
  }
}

/// ".csv .tsv", or "-" where only the content identifies the format
std::string list_extensions(const formats::LandmarkFormat& format) {
  std::string list;
  for (const std::string& extension : format.extensions) list += (list.empty() ? "." : " .") + extension;
  return list.empty() ? "-" : list;
}

void print_formats() {
  std::size_t names = 0;
  std::size_t extensions = 0;
  for (const formats::LandmarkFormat& format : formats::landmark_formats()) {
    names = std::max(names, format.name.size());
    extensions = std::max(extensions, list_extensions(format).size());
  }
  for (const formats::LandmarkFormat& format : formats::landmark_formats())
    print_text("{:<{}}  {:<13}  {:<{}}  {}\n", format.name, names, format.write != nullptr ? "read, written" : "read",
               list_extensions(format), extensions, format.help);
}

// ---- of the defaults

constexpr std::size_t kValueWidth = 19;  // of the longest, gaussian:alpha=auto

// A paragraph for each task: its defaults, and why one is not that of `register`.
void print_defaults() {
  for (const matching::TaskDefaults& task : matching::default_table()) {
    print_text("{}\n", task.task);
    for (const matching::DefaultColumn& column : matching::default_columns()) {
      const matching::Default& usual = task.*column.setting;
      if (usual.value.empty()) continue;
      const std::string gap(usual.reason.empty() ? 0 : kValueWidth - usual.value.size() + 1, ' ');
      print_text("    --{:<11} {}{}\n", column.name, usual.value, gap + usual.reason);
    }
  }
}

std::string defaults_json() {
  Json tasks = Json::array();
  for (const matching::TaskDefaults& task : matching::default_table()) {
    Json row = {{"task", task.task}};
    for (const matching::DefaultColumn& column : matching::default_columns()) {
      const matching::Default& usual = task.*column.setting;
      row[std::string(column.name)] =
          usual.value.empty() ? Json(nullptr) : Json{{"value", usual.value}, {"reason", usual.reason}};
    }
    tasks.push_back(std::move(row));
  }
  return json_text(Json{{"defaults", std::move(tasks)}});
}

const std::vector<std::string> kTables = {"kernels", "noises", "integrators", "formats", "defaults", "columns"};

bool is_table(const std::string& what) { return std::find(kTables.begin(), kTables.end(), what) != kTables.end(); }

void print_one(const std::string& what, const FileInfoOptions& options) {
  if (what == "defaults") {
    if (write_json(options.json, [] { return defaults_json(); })) print_defaults();
    return;
  }
  if (what == "columns") {
    if (write_json(options.json, [] { return json_text(columns_json()); })) print_columns();
    return;
  }
  if (what == "kernels") return print_table(kernel_table());
  if (what == "noises") return print_table(noise_table());
  if (what == "integrators") return print_table(integrator_table());
  if (what == "formats") return print_formats();
  print_file_info(what, options);
}

void print_info(const std::vector<std::string>& all, const FileInfoOptions& options) {
  for (const std::string& what : all) {
    if (is_table(what) && all.size() > 1)
      throw InputError(fmt::format("info: '{}' is a table, to be asked for alone", what));
    if (!is_table(what) && what != "-" && kind_of(what) == PathKind::kMissing && what.find('#') == std::string::npos)
      throw InputError(fmt::format("info: '{}' is neither a file nor one of {}{}", what, fmt::join(kTables, ", "),
                                   suggestion(what, kTables)));
  }
  if (all.size() == 1) return print_one(all.front(), options);
  print_files_info(all, options);
}

}  // namespace

void add_info_verb(CLI::App& program) {
  CLI::App* verb = program.add_subcommand("info", "Print the tables of kernels, noises, … or the contents of a file");
  auto what = std::make_shared<std::vector<std::string>>();
  auto options = std::make_shared<FileInfoOptions>();
  reads_shape(
      verb->add_option("WHAT", *what, "kernels, noises, integrators, formats, defaults, columns, or landmark files"))
      ->required();
  verb->add_flag("--all", options->all, "list all shapes of the file, not only the first 20");
  writes_file(verb->add_option("--json", options->json,
                               "also write the contents, the defaults or the columns as JSON to this file; -: to "
                               "standard output, without the text"));
  add_quiet_option(*verb);
  add_read_options(*verb, options->reading);
  verb->footer(
      "Examples:\n  pulson info noises\n  pulson info defaults\n  pulson info wings.tps\n  pulson info *.pts\n"
      "Exit codes: 0 done, 2 bad input.");
  verb->callback([what, options] { print_info(*what, *options); });
}

}  // namespace pulson
