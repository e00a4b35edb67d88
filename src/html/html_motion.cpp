#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>

#include <fmt/format.h>

#include "html_numbers.hpp"
#include "html_parts.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson::html {
namespace {

constexpr double kUnits = 100000;  // of the longest side of the box: five digits

void check(bool holds, const std::string& message) {
  if (!holds) throw InputError("report: " + message);
}

// `columns` < 0: any number.
void check_frames(const char* name, const std::vector<Points>& frames, Eigen::Index rows, Eigen::Index columns) {
  for (std::size_t f = 0; f < frames.size(); ++f) {
    check(frames[f].rows() == rows && (columns < 0 || frames[f].cols() == columns),
          fmt::format("frame {} of the {} of a motion is {}×{}; it must be {}×{}", f + 1, name, frames[f].rows(),
                      frames[f].cols(), rows, columns));
    check(frames[f].allFinite(), fmt::format("frame {} of the {} of a motion is not finite", f + 1, name));
  }
}

}  // namespace

void check_sizes(const ReportMotion& motion) {
  const Eigen::Index d = motion.source.points.rows(), n = motion.source.points.cols();
  const auto labels = std::accumulate(motion.lines.begin(), motion.lines.end(), Eigen::Index{0});
  check(d >= 1 && d <= 3 && n > 0, fmt::format("a motion of {} landmarks in {}D cannot be shown", n, d));
  check(motion.times.size() >= 2, "a motion needs two times or more");
  check(std::is_sorted(motion.times.begin(), motion.times.end(), std::less_equal<>()),
        "the times of a motion must grow");
  check(motion.frames.size() == motion.times.size(),
        fmt::format("a motion has {} frames at {} times", motion.frames.size(), motion.times.size()));
  check(motion.grid.empty() || motion.grid.size() == motion.times.size(),
        fmt::format("a motion has {} grids at {} times", motion.grid.size(), motion.times.size()));
  check_frames("landmarks", motion.frames, d, n);
  check_frames("grid", motion.grid, d, labels);
  const Points& target = motion.target.points;
  check(target.cols() == 0 || target.rows() == d, "the target of a motion has another dimension");
  check(!motion.corresponds || target.cols() == 0 || target.cols() == n,
        fmt::format("the target of a motion has {} landmarks of {}", target.cols(), n));
  if (motion.image) {
    const MotionImage& image = *motion.image;
    const auto columns = static_cast<std::size_t>(std::max(image.columns, 0));
    check(d == 2 && !motion.grid.empty() && image.step > 0 && columns > 1 && columns <= motion.lines.size() &&
              std::all_of(motion.lines.begin(), motion.lines.begin() + image.columns,
                          [&](int points) { return points == motion.lines.front(); }),
          "the mesh of a motion's picture is not in its grid");
  }
  if (!motion.triangles.empty()) {
    check(d == 3 && motion.surface.size() >= 2 && motion.surface.size() == motion.surface_times.size(),
          "the surface of a motion needs two times or more, and three axes");
    check_frames("surface", motion.surface, 3, motion.surface.front().cols());
    for (const auto& triangle : motion.triangles)
      for (const int corner : triangle)
        check(corner >= 0 && corner < motion.surface.front().cols(), "a triangle of a motion has no such vertex");
  }
  for (const std::vector<Points>& path : motion.others) {
    check(path.size() == motion.times.size(),
          fmt::format("another path of a motion has {} frames at {} times", path.size(), motion.times.size()));
    check_frames("other paths", path, d, n);
  }
  check_frames("extra lines", motion.extra.lines, d, -1);
  for (const int a : motion.outliers) check(a >= 0 && a < n, fmt::format("a motion has no landmark {}", a));
}

Box box_of(const ReportMotion& motion) {
  const Eigen::Index d = motion.source.points.rows();
  const double infinity = std::numeric_limits<double>::infinity();
  Box box{Eigen::VectorXd::Constant(d, infinity), Eigen::VectorXd::Constant(d, -infinity)};
  for (const Points& frame : motion.frames) box.include(frame);
  for (const Points& line : motion.extra.lines) box.include(line);
  box.include(motion.target.points);
  for (const Points& places : motion.surface) box.include(places);
  // Where the map folds, the grid may leave the page; the position where it begins is visible.
  if (!motion.grid.empty()) box.include(motion.grid.front());
  // Other paths may go far, and would leave the others little room.
  const Eigen::VectorXd span = box.high - box.low, least = box.low - span, most = box.high + span;
  for (const std::vector<Points>& path : motion.others)
    for (const Points& frame : path)
      box.include(frame.cwiseMax(least.replicate(1, frame.cols())).cwiseMin(most.replicate(1, frame.cols())));
  const double side = (box.high - box.low).maxCoeff();
  check(std::isfinite(side), "a motion is too large to be shown");
  box.unit = (side > 0 ? side : 1) / kUnits;
  return box;
}

namespace {

std::string list(const std::vector<double>& numbers) { return fmt::format("[{:.6g}]", fmt::join(numbers, ",")); }
std::string list(const std::vector<int>& numbers) { return fmt::format("[{}]", fmt::join(numbers, ",")); }
std::string list(const Eigen::VectorXd& v) { return list(std::vector<double>(v.begin(), v.end())); }

}  // namespace

void append_json_text(std::string& json, const std::string& text) {
  for (const char letter : valid_utf8(text)) {
    const auto byte = static_cast<unsigned char>(letter);
    if (byte < 0x20 || letter == '"' || letter == '\\' || letter == '<' || letter == '&' || byte == 0x7F)
      fmt::format_to(std::back_inserter(json), "\\u{:04x}", byte);
    else
      json += letter;
  }
}

namespace {

// The labels, or none at all.
std::string names(const Landmarks& shape) {
  std::string text = "[";
  for (const std::string& label : shape.labels) {
    text += text.size() > 1 ? ",\"" : "\"";
    append_json_text(text, label);
    text += '"';
  }
  return text + "]";
}

// The number of each landmark's group, from 0.
std::vector<int> group_numbers(const Landmarks& shape) {
  std::vector<int> numbers(static_cast<std::size_t>(shape.count()), 0);
  const std::vector<std::vector<int>> groups = landmarks_by_group(shape);
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const int a : groups[g]) numbers[static_cast<std::size_t>(a)] = static_cast<int>(g);
  return numbers;
}

}  // namespace

void add_motion(const ReportMotion& motion, std::size_t frames, Json& json) {
  constexpr double kPixels = 600;  // about the size on a page, for which outlines are planned
  const Box& box = json.box();
  const auto first = [&](const std::vector<Points>& all) {
    return std::vector<Points>(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(std::min(frames, all.size())));
  };
  const double scale = kPixels / (box.unit * kUnits);
  const draw::Figure figure = draw::plan_figure(motion.source, scale);
  json.add("d", motion.source.dimension());
  json.add("times", list(motion.times));
  json.add("low", list(box.low));
  json.add("unit", fmt::format("{:.8g}", box.unit));
  json.add("size", list(Eigen::VectorXd((box.high - box.low) / box.unit)));
  json.add("groups", list(group_numbers(motion.source)));
  json.add("marked", list(figure.marked));
  json.add("traced", list(figure.with_path));
  json.add_outlines("outlines", figure);
  json.add("outliers", list(motion.outliers));
  std::vector<int> numbers(static_cast<std::size_t>(motion.source.count()));
  for (int a = 0; a < motion.source.count(); ++a) numbers[static_cast<std::size_t>(a)] = motion.source.number(a);
  json.add("numbers", list(numbers));
  json.add_frames("frames", first(motion.frames));
  json.add_points("target", motion.target.points);
  json.add("down", motion.source.frame.y_down || motion.target.frame.y_down);
  json.add("pairs", motion.corresponds);
  if (!motion.corresponds && motion.target.count() > 0)
    json.add_outlines("targetOutlines", draw::plan_figure(motion.target, scale));
  json.add("lines", list(motion.lines));
  if (motion.image) {
    const MotionImage& image = *motion.image;
    json.add("image", list(std::vector<double>{image.first.x(), image.first.y(), image.last.x(), image.last.y()}));
    json.add("mesh", list(std::vector<int>{motion.image->columns, motion.lines.front(), motion.image->step}));
  }
  json.add_frames("grid", first(motion.grid));
  std::vector<int> corners;
  for (const auto& triangle : motion.triangles) corners.insert(corners.end(), triangle.begin(), triangle.end());
  json.add("triangles", list(corners));
  json.add_frames("surface", motion.surface);
  json.add("surfaceTimes", list(motion.surface_times));
  json.add_paths("others", motion.others);
  json.add_frames("extra", motion.extra.lines);
  json.add("names", names(motion.source));
}

namespace {

// What the canvas shows, for those who do not see it.
std::string description(const ReportMotion& motion) {
  std::string text = fmt::format("{} landmarks in {}D as they move from time {:.3g} to {:.3g}", motion.source.count(),
                                 motion.source.dimension(), motion.times.front(), motion.times.back());
  return motion.source.dimension() == 3 ? text + "; arrow keys turn the view" : text;
}

}  // namespace

std::string key_of(const ReportMotion& motion) {
  std::string text = "<ul class=\"key\">";
  const auto add = [&](bool is_there, const char* style, const char* layer, const std::string& name, bool on = true) {
    if (is_there)
      text += fmt::format(R"(<li class="{}"><label><input type="checkbox" data-layer="{}"{} />{}</label></li>)", style,
                          layer, on ? R"( checked="")" : "", escaped(name));
  };
  add(true, "start", "source", motion.target.count() > 0 ? "source" : "start");
  add(true, "moving", "landmarks", "landmarks");
  add(motion.target.count() > 0, "goal", "target", "target");
  add(!motion.outliers.empty(), "odd", "outliers", "outliers");
  add(true, "trail", "paths", "paths");
  add(!motion.others.empty(), "trail", "others", motion.others_name);
  add(!motion.extra.lines.empty(), "goal", "extra", motion.extra.name);
  add(!motion.grid.empty(), "mesh", "grid", motion.source.dimension() == 1 ? "points between" : "grid");
  add(motion.image.has_value(), "photo", "image", "image");
  add(!motion.triangles.empty(), "photo", "surface", "surface");
  constexpr int kMostNumbers = 400;
  add(motion.source.count() <= kMostNumbers, "names", "numbers", motion.source.labels.empty() ? "numbers" : "names",
      false);
  return text + "</ul>\n";
}

std::string zoom_buttons() {
  return R"(<span class="zoom"><button type="button" data-zoom="1.5" aria-label="zoom in">+</button>)"
         R"(<button type="button" data-zoom="0.6667" aria-label="zoom out">−</button>)"
         R"(<button type="button" data-zoom="0" aria-label="show all">⤢</button></span>)";
}

std::string motion(const ReportMotion& motion) {
  check_sizes(motion);
  // Without a script there is nothing to show, and the figure stays hidden.
  std::string text = fmt::format(
      "<figure class=\"motion\" hidden=\"\">\n<canvas role=\"img\" aria-label=\"{}\" tabindex=\"0\"></canvas>\n"
      "<div class=\"player\"><button type=\"button\">Play</button>"
      "<input type=\"range\" min=\"0\" max=\"1000\" value=\"1000\" aria-label=\"time\" /><output></output>{}</div>\n",
      description(motion), zoom_buttons());
  text += key_of(motion);
  if (motion.image) text += fmt::format("<img hidden=\"\" src=\"{}\" alt=\"\">\n", data_address(motion.image->picture));
  if (!motion.caption.empty()) text += "<figcaption>" + escaped(motion.caption) + "</figcaption>\n";
  text += fmt::format(
      "<p class=\"keys\">With the focus on the picture: <kbd>space</kbd> plays, <kbd>+</kbd> <kbd>−</kbd> <kbd>0</kbd> "
      "zoom, arrows {}, <kbd>n</kbd> <kbd>p</kbd> step through the landmarks.</p>\n",
      motion.source.dimension() == 3 ? "turn it" : "move it");
  const Box box = box_of(motion);
  Json json(box);
  add_motion(motion, motion.frames.size(), json);
  return text + "<script type=\"application/json\">" + std::move(json).finished() + "</script>\n</figure>\n";
}

std::string stack(const ReportStack& stack) {
  std::string text = fmt::format(
      "<figure class=\"stacked\">\n<div class=\"stack\" tabindex=\"0\" role=\"img\" aria-label=\"{0} over {1}\">"
      "<div class=\"sheet\"><img src=\"{2}\" alt=\"{1}\"><img class=\"over\" src=\"{3}\" alt=\"{0}\"></div></div>\n"
      "<div class=\"player\" hidden=\"\"><span>{1}</span><input type=\"range\" min=\"0\" max=\"1000\" value=\"500\" "
      "aria-label=\"from {1} to {0}\" /><span>{0}</span>{4}</div>\n<form><ul class=\"key\">",
      escaped(stack.above_name), escaped(stack.below_name), data_address(stack.below), data_address(stack.above),
      zoom_buttons());
  for (const char* mode : {"mix", "wipe", "squares", "difference"})
    text += fmt::format(R"(<li><label><input type="radio" name="mode" value="{}"{} />{}</label></li>)", mode,
                        mode == std::string_view("mix") ? R"( checked="")" : "", mode);
  text += "</ul></form>\n";
  if (!stack.caption.empty()) text += "<figcaption>" + escaped(stack.caption) + "</figcaption>\n";
  return text + "</figure>\n";
}

}  // namespace pulson::html
