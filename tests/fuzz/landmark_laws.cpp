#include "landmark_laws.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "formats/shape_options.hpp"
#include "fuzzing.hpp"

namespace pulson::fuzz {
namespace {

using Strings = std::vector<std::string>;

bool is_reported(const formats::WrittenLandmarks& written, std::string_view part) {
  return std::any_of(written.losses.begin(), written.losses.end(),
                     [&](const std::string& loss) { return loss.find(part) != std::string::npos; });
}

bool has_same_bits(const Points& a, const Points& b) {
  if (a.cols() != b.cols() || (a.cols() > 0 && a.rows() != b.rows())) return false;
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    const double x = a.reshaped()[i], y = b.reshaped()[i];
    if (std::isnan(x) && std::isnan(y)) continue;
    if (std::bit_cast<std::uint64_t>(x) != std::bit_cast<std::uint64_t>(y)) return false;
  }
  return true;
}

bool has_same_bits(const std::vector<Points>& a, const std::vector<Points>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Points& x, const Points& y) { return has_same_bits(x, y); });
}

void check_points(const Points& points, const std::string& what) {
  require(points.rows() >= 1 && points.rows() <= 3, what + " are not in 1D, 2D or 3D");
  require((points.array().isFinite() || points.array().isNaN()).all(), what + " have an infinite coordinate");
}

/// The points as a format must give them back, except for reported losses.
Points expected_points(const formats::WrittenLandmarks& written, Points points) {
  if (is_reported(written, "get z = 0") && points.rows() == 2 && points.cols() > 0) {
    points.conservativeResize(3, Eigen::NoChange);
    points.row(2).setZero();
  }
  if (is_reported(written, "is read back in the plane")) points.conservativeResize(2, Eigen::NoChange);
  if (is_reported(written, "written without any") || is_reported(written, "get z = 0"))
    for (const int missing : incomplete_points(points))
      points.col(missing).setConstant(std::numeric_limits<double>::quiet_NaN());
  return points;
}

/// The names of landmarks, where they say more than their numbers do.
Strings telling_names(const Strings& names) {
  const bool is_empty = std::all_of(names.begin(), names.end(), [](const auto& name) { return name.empty(); });
  std::size_t number = 0;
  const bool is_counted =
      std::all_of(names.begin(), names.end(), [&](const auto& name) { return name == std::to_string(++number); });
  return is_empty || is_counted ? Strings() : names;
}

void check_texts(const std::string& format, const formats::WrittenLandmarks& written, const Landmarks& back,
                 const Landmarks& shape) {
  if (is_reported(written, "not UTF-8") || is_reported(written, "line breaks")) return;
  const bool are_named = format == "bigwarp" && shape.labels.empty();  // as BigWarp names them
  if (!is_reported(written, "labels") && !are_named)
    require(telling_names(back.labels) == telling_names(shape.labels), format + " changes labels");
  if (!is_reported(written, "absent")) require(back.absent == shape.absent, format + " changes what is absent");
  if (!is_reported(written, "group"))
    require(telling_names(back.groups) == telling_names(shape.groups), format + " changes groups");
  if (!is_reported(written, "images")) require(back.image == shape.image, format + " changes images");
  if (!is_reported(written, "scales")) require(back.scale == shape.scale, format + " changes scales");
  if (!is_reported(written, "properties")) require(back.properties == shape.properties, format + " changes properties");
  const bool is_named_by_file = !shape.source.empty() || shape.name == "f";
  const bool is_renamed =
      is_reported(written, "names of shapes") || is_reported(written, "names that are empty or repeat");
  if (!is_renamed && !shape.name.empty() && !is_named_by_file)
    require(back.name == shape.name, format + " changes names");
}

/// json holds everything.
void check_everything(const Landmarks& back, const Landmarks& shape) {
  require(back.name == shape.name && back.image == shape.image && back.scale == shape.scale &&
              back.properties == shape.properties && back.labels == shape.labels && back.groups == shape.groups,
          "json changes what is said of a shape");
  require(has_same_bits(back.curves, shape.curves) && has_same_bits(back.outlines, shape.outlines),
          "json changes curves or outlines");
}

void check_row_that_recognises(const formats::LandmarkFormat& format, std::string_view text) {
  for (const formats::LandmarkFormat& row : formats::landmark_formats()) {
    if (!row.sniff(text)) continue;
    require(row.name == format.name, "what " + format.name + " writes is recognised as " + row.name);
    return;
  }
  throw BrokenLaw("what " + format.name + " writes is recognised by no row");
}

void check_writer(const formats::LandmarkFormat& format, const formats::LandmarkFile& file) {
  const auto written = attempt([&] { return format.write("f", file); });
  if (!written) return;
  for (const std::string& loss : written->losses) require_one_line(loss);
  check_row_that_recognises(format, written->text);
  const auto back =
      demand("what " + format.name + " writes is not read", [&] { return format.read("f", written->text); });
  std::vector<Landmarks> expected = file.shapes;
  if (is_reported(*written, "shapes without landmarks"))
    std::erase_if(expected, [](const Landmarks& shape) { return shape.count() == 0; });
  require(back.shapes.size() == expected.size(), format.name + " changes the number of shapes");
  if (is_reported(*written, "of a shape without landmarks"))
    for (Landmarks& shape : expected) formats::take_lines_as_landmarks(shape);
  for (std::size_t s = 0; s < expected.size(); ++s) {
    require(has_same_bits(back.shapes[s].points, expected_points(*written, expected[s].points)),
            format.name + " changes points");
    check_texts(format.name, *written, back.shapes[s], expected[s]);
    if (format.name == "json" && written->losses.empty()) check_everything(back.shapes[s], expected[s]);
  }
}

}  // namespace

void check_landmark_file(const formats::LandmarkFile& file) {
  require(!file.shapes.empty(), "a file without shapes is taken");
  for (const Landmarks& shape : file.shapes) {
    const auto count = static_cast<std::size_t>(shape.count());
    check_points(shape.points, "landmarks");
    require(shape.labels.empty() || shape.labels.size() == count, "labels are not as many as landmarks");
    require(shape.groups.empty() || shape.groups.size() == count, "groups are not as many as landmarks");
    for (const Points& curve : shape.curves) check_points(curve, "curves");
    for (const Points& outline : shape.outlines) check_points(outline, "outlines");
    require(!shape.scale || std::isfinite(*shape.scale), "the scale is not finite");
  }
  for (const std::string& warning : file.warnings) require_one_line(warning);
}

void check_writers(const formats::LandmarkFile& file) {
  for (const formats::LandmarkFormat& format : formats::landmark_formats())
    if (format.write != nullptr) check_writer(format, file);
}

bool read_as_row(std::string_view input, std::initializer_list<std::string_view> rows) {
  const std::size_t end = std::min(input.find('\n'), input.size());
  const std::string_view name = input.substr(0, end);
  const std::string_view text = input.substr(std::min(end + 1, input.size()));
  if (std::find(rows.begin(), rows.end(), name) == rows.end() || !has_text(text)) return false;
  for (const formats::LandmarkFormat& format : formats::landmark_formats()) {
    if (format.name != name) continue;
    format.sniff(text);
    const auto file = attempt([&] { return format.read("f", text); });
    if (!file) return true;
    check_landmark_file(*file);
    check_writers(*file);
    return true;
  }
  throw BrokenLaw("no row of formats is called " + std::string(name));
}

}  // namespace pulson::fuzz
