#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/formats.hpp"
#include "formats/landmark_writers.hpp"
#include "pulson/core/errors.hpp"
#include "tps_lines.hpp"

namespace pulson::io {
namespace {

constexpr std::array<std::string_view, 8> kKeywords = {"lm",    "lm3",    "id",       "image",
                                                       "scale", "curves", "outlines", "points"};

class TpsWriter {
 public:
  TpsWriter(const std::string& path, const LandmarkFile& file) : target_{path, "tps"}, file_(file) {}

  WrittenLandmarks write() {
    require_shapes(target_, file_);
    written_.losses =
        losses_of(target_, file_, {.names = true, .images = true, .scales = true, .properties = true, .lines = true});
    for (const Landmarks& shape : file_.shapes) write_shape(shape);
    if (has_broken_lines_) written_.losses.push_back(cannot_hold_breaks(target_));
    if (has_unreadable_names_)
      written_.losses.push_back(
          cannot_hold(target_, "properties whose names are empty, hold '=', or are keywords or comments of tps"));
    if (shapes_of_lines_ > 0)
      written_.losses.push_back(cannot_hold(target_, "curves and outlines of a shape without landmarks",
                                            shapes_of_lines_, file_.shapes.size()));
    return std::move(written_);
  }

 private:
  void write_shape(const Landmarks& shape) {
    require_plane_or_space(target_, shape);
    written_.text += fmt::format("{}={}\n", shape.dimension() == 3 ? "LM3" : "LM", shape.count());
    append_points(written_.text, shape.points, "NA");
    if (shape.count() == 0 && !(shape.curves.empty() && shape.outlines.empty())) ++shapes_of_lines_;
    write_lines("CURVES", shape, shape.curves);
    write_lines("OUTLINES", shape, shape.outlines);
    if (!shape.image.empty()) write_text("IMAGE", shape.image);
    if (!shape.name.empty()) write_text("ID", shape.name);
    for (const auto& [name, value] : shape.properties) write_property(name, value);
    if (shape.scale) written_.text += fmt::format("SCALE={}\n", *shape.scale);
  }

  void write_lines(std::string_view keyword, const Landmarks& shape, const std::vector<Points>& lines) {
    if (lines.empty()) return;
    written_.text += fmt::format("{}={}\n", keyword, lines.size());
    for (const Points& points : lines) {
      if (points.rows() != shape.points.rows())
        throw InputError(
            fmt::format("{}: tps holds curves and outlines of the dimension of the landmarks, which are "
                        "in {}D; here is one in {}D",
                        target_.path, shape.dimension(), points.rows()));
      written_.text += fmt::format("POINTS={}\n", points.cols());
      append_points(written_.text, points, "NA");
    }
  }

  /// Whether a line `name=`, without blanks around the name, is read as a property of this name.
  static bool is_readable(const std::string& name) {
    const bool is_keyword = std::find(kKeywords.begin(), kKeywords.end(), to_lower(name)) != kKeywords.end();
    return !is_keyword && !name.empty() && name.find('=') == std::string::npos && !is_tps_comment(name);
  }

  void write_property(const std::string& name, const std::string& value) {
    const std::string plain = one_line(name, has_broken_lines_);
    if (is_readable(plain))
      write_text(plain, value);
    else
      has_unreadable_names_ = true;
  }

  void write_text(std::string_view keyword, const std::string& value) {
    written_.text += fmt::format("{}={}\n", keyword, one_line(value, has_broken_lines_));
  }

  Target target_;
  const LandmarkFile& file_;
  WrittenLandmarks written_;
  bool has_broken_lines_ = false;
  bool has_unreadable_names_ = false;
  std::size_t shapes_of_lines_ = 0;
};

}  // namespace

WrittenLandmarks write_tps(const std::string& path, const LandmarkFile& file) { return TpsWriter(path, file).write(); }

}  // namespace pulson::io
