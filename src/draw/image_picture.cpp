#include "draw/image_picture.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "layers.hpp"
#include "layout.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::draw {
namespace {

constexpr double kTallest = 1500, kTallestRow = 1000;  // of all panels, and of a row
constexpr double kNarrowest = 960;                     // that holds the legend
constexpr double kBarRoom = 52;                        // below a panel
constexpr double kScaleHeight = 14, kBarText = 18, kMarkWidth = 26;
constexpr double kPanelNumberSize = 16;
constexpr double kRingStroke = 1.8;
const Stroke kHalo{faded(colour::kPaper, 0.25), 3.6};  // around rings and paths, so that they are seen on dark images
const Stroke kImageGridStroke{{"#0096FF", 0.6}, 1};
constexpr Colour kPathColour{kLightPalette.target, 0.81};

/// How panels are arranged: columns, and the height of a row of images.
struct Rows {
  std::size_t columns = 1;
  double height = 0;
};

double aspect(const ImagePanel& panel) { return static_cast<double>(panel.width) / panel.height; }

std::size_t row_count(const ImagePicture& picture, std::size_t columns) {
  return (picture.panels.size() + columns - 1) / columns;
}

/// The sum of the widths of a row's panels over its height, of the widest row.
double widest_row(const ImagePicture& picture, std::size_t columns) {
  double widest = 0;
  for (std::size_t first = 0; first < picture.panels.size(); first += columns) {
    double sum = 0;
    for (std::size_t i = first; i < std::min(first + columns, picture.panels.size()); ++i)
      sum += aspect(picture.panels[i]);
    widest = std::max(widest, sum);
  }
  return widest;
}

Rows arranged(const ImagePicture& picture, bool narrow) {
  if (narrow) return {1, std::min((kNarrowWidth - 2 * kEdge) / widest_row(picture, 1), kTallestNarrow)};
  Rows best;
  for (std::size_t columns = picture.panels.size(); columns > 0; --columns) {
    const double across = kWidth - 2 * kEdge - static_cast<double>(columns - 1) * kGap;
    const double down = std::min(kTallestRow, kTallest / static_cast<double>(row_count(picture, columns)));
    const double height = std::min(across / widest_row(picture, columns), down);
    // Side by side, unless that is much smaller; a row that is not full looks as if something were missing.
    const double gain = picture.panels.size() % columns == 0 ? 1.6 : 1.8;
    if (height > gain * best.height) best = {columns, height};
  }
  return best;
}

View view_of(const ImagePanel& panel, const Box& box) {
  return {.box = box, .x = {-0.5, panel.width - 0.5}, .y = {-0.5, panel.height - 0.5}, .y_down = true};
}

std::vector<Points> lines_of_paths(const ImagePanel& panel) {
  std::vector<Points> lines;
  for (Eigen::Index a = 0; !panel.paths.empty() && a < panel.paths.front().cols(); ++a)
    lines.push_back(path_of(panel.paths, a));
  return lines;
}

/// Columns of the landmarks that are on the image.
std::vector<Eigen::Index> shown_landmarks(const ImagePanel& panel) {
  std::vector<Eigen::Index> shown;
  for (Eigen::Index a = 0; a < panel.landmarks.cols(); ++a)
    if (panel.landmarks(0, a) >= -0.5 && panel.landmarks(1, a) >= -0.5 && panel.landmarks(0, a) < panel.width &&
        panel.landmarks(1, a) < panel.height)
      shown.push_back(a);
  return shown;
}

const Colour& ring_colour(const ImagePanel& panel) { return panel.is_target ? colour::kTarget : colour::kSource; }

void draw_rings(Canvas& canvas, const View& view, const ImagePanel& panel) {
  const std::vector<Eigen::Index> shown = shown_landmarks(panel);
  if (shown.empty()) return;
  Landmarks shape;
  shape.points = panel.landmarks(Eigen::all, shown);
  const Points pixels = view.pixels(shape.points);
  const double radius = std::clamp(0.8 * Marks(plan_figure(shape, scale_of(view))).ring, 3.0, 7.0);
  canvas.rings(pixels, radius, kHalo);
  canvas.rings(pixels, radius, {ring_colour(panel), kRingStroke});
  for (std::size_t i = 0; i < shown.size() && !panel.names.empty(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const std::string& text = panel.names[static_cast<std::size_t>(shown[i])];
    const double x = pixels(0, column) + radius + 3, y = pixels(1, column) + radius + 2;
    canvas.text_on_image(x, y, text, kPanelNumberSize, ring_colour(panel));
  }
}

/// The bar along the panel, its marked colour at the right end.
void draw_bar(Canvas& canvas, const Box& panel, const ColourBar& bar) {
  const double marked = bar.mark.empty() ? 0 : kMarkWidth + 10 + text_width(bar.mark_label, kBarText);
  const double length = panel.width - (bar.mark.empty() ? 0 : marked + kGap), top = panel.bottom - 12;
  const auto area = [&](double from, double to) {
    return border_of({from, top - kScaleHeight, to - from, kScaleHeight});
  };
  const double left = panel.left, piece = length / static_cast<double>(bar.colours.size());
  for (std::size_t i = 0; i < bar.colours.size(); ++i) {  // each reaches below the next, so that no seam is seen
    const double from = left + piece * static_cast<double>(i);
    canvas.areas({area(from, std::min(from + 2 * piece, left + length))}, bar.colours[i]);
  }
  for (const auto& [part, text] : bar.labels) {
    const double half = text_width(text, kBarText) / 2;  // within the panel, whatever part it stands below
    const double x = half < length / 2 ? std::clamp(part * length, half, length - half) : length / 2;
    canvas.text(left + x, top - kScaleHeight - 14, text, kBarText, colour::kText, Align::kCentre);
  }
  if (bar.mark.empty()) return;
  const double at = panel.right() - marked;
  canvas.areas({area(at, at + kMarkWidth)}, bar.mark);
  canvas.text(at + kMarkWidth + 10, top - kScaleHeight / 2, bar.mark_label, kBarText, colour::kText);
}

void draw_panel(Canvas& canvas, const Box& box, const ImagePanel& panel) {
  const View view = view_of(panel, box);
  if (!panel.pixels.empty()) canvas.raster(panel.pixels, box);
  canvas.look_through(box);
  canvas.lines(view.pixels(panel.grid), kImageGridStroke);
  const std::vector<Points> paths = view.pixels(lines_of_paths(panel));
  constexpr std::size_t kFewPaths = 20;  // many thick ones would hide the image
  const double width = paths.size() > kFewPaths ? 1.1 : kRingStroke;
  if (paths.size() <= kFewPaths) canvas.lines(paths, {kHalo.colour, width + 1.6});
  canvas.lines(paths, {kPathColour, width});
  canvas.look_through({});
  draw_rings(canvas, view, panel);
  draw_frame(canvas, view, panel.heading, {}, {});
  for (const ColourBar& bar : panel.bars) draw_bar(canvas, box, bar);
}

std::vector<LegendEntry> legend_of(const ImagePicture& picture) {
  std::vector<LegendEntry> legend;
  const auto add_if_any = [&](const LegendEntry& entry, const auto& shows) {
    if (std::any_of(picture.panels.begin(), picture.panels.end(), shows)) legend.push_back(entry);
  };
  const auto shows_rings = [](bool of_target) {
    return [=](const ImagePanel& panel) { return panel.landmarks.cols() > 0 && panel.is_target == of_target; };
  };
  add_if_any(ring_entry("landmarks", colour::kSource), shows_rings(false));
  add_if_any(line_entry("their paths", kPathColour), [](const ImagePanel& panel) { return !panel.paths.empty(); });
  add_if_any(ring_entry("landmarks of the target", colour::kTarget), shows_rings(true));
  add_if_any(line_entry("grid of the image", kImageGridStroke.colour),
             [](const ImagePanel& panel) { return !panel.grid.empty(); });
  return legend;
}

Canvas compose(const ImagePicture& picture, bool narrow) {
  if (picture.panels.empty()) throw InputError("a picture of images needs one or more");
  for (const ImagePanel& panel : picture.panels)
    if (panel.width < 1 || panel.height < 1)
      throw InputError(fmt::format("a panel of {} x {} pixels cannot be drawn", panel.width, panel.height));
  const Rows rows = arranged(picture, narrow);
  const std::vector<LegendEntry> legend = legend_of(picture);
  const bool has_bar = std::any_of(picture.panels.begin(), picture.panels.end(),
                                   [](const ImagePanel& panel) { return !panel.bars.empty(); });
  const double row = kHeading + rows.height + (has_bar ? kBarRoom : 0);
  const double width =
      widest_row(picture, rows.columns) * rows.height + static_cast<double>(rows.columns - 1) * kGap + 2 * kEdge;
  double top = static_cast<double>(row_count(picture, rows.columns)) * row + (legend.empty() ? kEdge : kLegendRoom);
  const double narrowest = narrow ? kNarrowWidth : kNarrowest, aside = std::max(0.0, (narrowest - width) / 2);
  Canvas canvas = titled_canvas(narrow ? Titles() : Titles{picture.title, picture.subtitle}, kEdge + aside,
                                std::max(width, narrowest), top);
  for (std::size_t i = 0; i < picture.panels.size(); ++i) {
    if (i % rows.columns == 0 && i > 0) top -= row;
    double left = kEdge + aside;
    for (std::size_t j = i - i % rows.columns; j < i; ++j) left += aspect(picture.panels[j]) * rows.height + kGap;
    const ImagePanel& panel = picture.panels[i];
    draw_panel(canvas, {left, top - kHeading - rows.height, aspect(panel) * rows.height, rows.height}, panel);
  }
  if (!legend.empty()) draw_legend(canvas, legend);
  return canvas;
}

}  // namespace

void write_image_picture(const ImagePicture& picture, const PictureFiles& files) {
  write_layouts(files, [&](bool narrow) { return compose(picture, narrow); });
}

std::string image_picture_png(const ImagePicture& picture, const PictureFiles& look) {
  if (look.narrow != nullptr) *look.narrow = compose(picture, true).png({}, 96);
  return compose(picture, false).png(look.width, look.dpi);
}

}  // namespace pulson::draw
