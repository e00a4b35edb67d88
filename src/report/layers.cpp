#include "layers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

namespace pulson::picture {
namespace {

constexpr int kTimeColours = 48;
constexpr std::size_t kMostVertices = 250000;  // of all paths together
constexpr std::size_t kLeastKnots = 24;        // of one path
constexpr std::size_t kMostKnots = 300;

constexpr double kTitleSize = 30;
constexpr double kSubtitleSize = 21;
constexpr double kLegendSize = 20;
constexpr double kLegendGap = 48;
constexpr double kLegendHeight = 30;  // above the bottom edge
constexpr double kSampleGap = 11;     // between a sample and its text
constexpr double kDenseOutline = 2.2;
constexpr std::size_t kMostGroupEntries = 4;
constexpr double kNumberSize = 15;
constexpr Eigen::Index kMostNumbers = 60;
constexpr double kBarLength = 190;
constexpr double kBarHeight = 12;

/// At most `most` + 1 of the indices 0 … last, evenly spread, with both ends.
std::vector<std::size_t> knots(std::size_t last, std::size_t most) {
  const std::size_t count = std::max<std::size_t>(1, std::min(last, most));
  std::vector<std::size_t> result(count + 1);
  for (std::size_t i = 0; i <= count; ++i) result[i] = i * last / count;
  return result;
}

// Blue, raspberry, green, violet: told apart in colour blindness and from the orange target.
const Colour& group_colour(std::size_t group) {
  static const std::array<Colour, 4> kColours = {colour::kSource, "#B03A63", "#2F8F6B", "#7D5BA6"};
  return kColours.at(group % kColours.size());
}

Points point(double x, double y) { return (Points(2, 1) << x, y).finished(); }

Points horizontal(double from, double to, double y) { return (Points(2, 2) << from, to, y, y).finished(); }

void draw_time_bar(Canvas& canvas, double left, double y) {
  // Round ends reach out by r. Each piece covers the end of the one before it, so no seams show.
  constexpr double r = kBarHeight / 2, kPiece = (kBarLength - 2 * r) / kTimeColours;
  for (int i = 0; i < kTimeColours; ++i) {
    const double from = left + r + kPiece * i;
    canvas.lines({horizontal(from, from + kPiece, y)}, {time_colour((i + 0.5) / kTimeColours), kBarHeight});
  }
}

double sample_width(Sample sample) {
  return sample == Sample::kTimeBar ? kBarLength : sample == Sample::kLine ? 36 : 20;
}

double entry_width(const LegendEntry& entry) {
  double width = sample_width(entry.sample) + kSampleGap + text_width(entry.text, kLegendSize);
  if (!entry.end_text.empty()) width += kSampleGap + text_width(entry.end_text, kLegendSize);
  return width;
}

void draw_sample(Canvas& canvas, double left, double y, const LegendEntry& entry) {
  const double width = sample_width(entry.sample);
  switch (entry.sample) {
    case Sample::kDot:
      return canvas.dots(point(left + width / 2, y), 6.5, entry.colour);
    case Sample::kRing:
      return canvas.rings(point(left + width / 2, y), 8.5, {entry.colour, 2.2});
    case Sample::kLine:
      return canvas.lines({horizontal(left, left + width, y)}, {entry.colour, 2.4});
    case Sample::kTimeBar:
      return draw_time_bar(canvas, left, y);
  }
}

void draw_entry(Canvas& canvas, double left, double y, const LegendEntry& entry) {
  const double sample = sample_width(entry.sample), text = text_width(entry.text, kLegendSize);
  const bool text_first = entry.sample == Sample::kTimeBar;
  const double text_left = text_first ? left : left + sample + kSampleGap;
  const double sample_left = text_first ? left + text + kSampleGap : left;
  draw_sample(canvas, sample_left, y, entry);
  canvas.text(text_left, y, entry.text, kLegendSize, colour::kText);
  if (text_first) canvas.text(sample_left + sample + kSampleGap, y, entry.end_text, kLegendSize, colour::kText);
}

}  // namespace

Marks::Marks(const Figure& figure) {
  const double shown = static_cast<double>(std::max(figure.marked.size(), figure.with_path.size()));
  dot = std::clamp(std::min(8.5 * std::pow(4 / shown, 0.28), 0.32 * figure.spacing), 1.8, 8.5);
  ring = 1.35 * dot + std::min(1.4, 0.4 * dot);
  stroke = std::clamp(0.3 * dot, 0.9, 2.4);
  path = std::clamp(0.5 * dot, 1.1, 4.0);
  outline = std::clamp(0.4 * dot, 1.1, 2.4);
}

void draw_shape(Canvas& canvas, const Points& pixels, const Figure& figure, const Colour& colour) {
  const Marks marks(figure);
  for (std::size_t group = 0; group < figure.groups.size(); ++group) {
    const Colour own = figure.names.empty() ? colour : group_colour(group);
    canvas.lines(trace(figure, false, pixels, group), {own, marks.outline});
    canvas.lines(trace(figure, true, pixels, group), {own, kDenseOutline});
    const Points marked = pixels(Eigen::all, figure.groups[group]);
    canvas.dots(marked, marks.dot + std::min(1.2, 0.25 * marks.dot), colour::kPaper);
    canvas.dots(marked, marks.dot, own);
  }
}

void draw_numbers(Canvas& canvas, const Points& pixels, const Figure& figure) {
  if (pixels.cols() > kMostNumbers || !figure.outlines.empty() || figure.spacing < 2 * kNumberSize) return;
  const double offset = Marks(figure).ring + 3;
  for (Eigen::Index a = 0; a < pixels.cols(); ++a)
    canvas.text(pixels(0, a) + offset, pixels(1, a) + offset, std::to_string(a + 1), kNumberSize, colour::kTicText);
}

void draw_target(Canvas& canvas, const Points& pixels, const Figure& figure) {
  const Marks marks(figure);
  canvas.lines(trace(figure, false, pixels), {faded(colour::kTarget, 0.45), marks.outline});
  canvas.lines(trace(figure, true, pixels), {colour::kTarget, 1.6 * kDenseOutline});
  canvas.rings(pixels(Eigen::all, figure.marked), marks.ring, {colour::kTarget, marks.stroke});
}

void draw_paths_by_time(Canvas& canvas, const std::vector<Points>& trajectory, const std::vector<double>& times,
                        const Figure& figure) {
  const std::vector<int>& shown = figure.with_path;
  const std::size_t n = shown.size();
  const double width = Marks(figure).path;
  const std::size_t most = std::clamp(kMostVertices / n, kLeastKnots, kMostKnots);
  const std::vector<std::size_t> k = knots(trajectory.size() - 1, most);
  const double start = times.front(), duration = times.back() - times.front();
  const auto bin = [&](std::size_t i) {  // of the step that begins at knot i
    const double middle = (times[k[i]] + times[k[i + 1]]) / 2;
    return static_cast<int>(kTimeColours * (middle - start) / duration);
  };

  for (std::size_t begin = 0, end = 0; begin + 1 < k.size(); begin = end) {
    while (end + 1 < k.size() && bin(end) == bin(begin)) ++end;
    std::vector<Points> pieces(n, Points(2, end - begin + 1));
    for (std::size_t i = begin; i <= end; ++i)
      for (std::size_t a = 0; a < n; ++a) pieces[a].col(i - begin) = trajectory[k[i]].col(shown[a]);
    canvas.lines(pieces, {time_colour((bin(begin) + 0.5) / kTimeColours), width});
  }
}

std::vector<LegendEntry> legend_of_shapes(const Figure& figure) {
  if (!figure.names.empty()) {
    std::vector<LegendEntry> entries;
    for (std::size_t group = 0; group < std::min(figure.names.size(), kMostGroupEntries); ++group)
      entries.push_back({Sample::kDot, group_colour(group), figure.names[group], ""});
    entries.push_back({Sample::kRing, colour::kTarget, "target", ""});
    return entries;
  }
  const bool lines = figure.marked.empty();
  return {{lines ? Sample::kLine : Sample::kDot, colour::kSource, "source", ""},
          {lines ? Sample::kLine : Sample::kRing, colour::kTarget, "target", ""},
          {lines ? Sample::kLine : Sample::kDot, colour::kResult, "result", ""}};
}

LegendEntry legend_of_time(const std::vector<double>& times) {
  return {Sample::kTimeBar, "", fmt::format("path, t = {:.4g}", times.front()), fmt::format("{:.4g}", times.back())};
}

LegendEntry legend_of_grid(const std::string& text) { return {Sample::kLine, colour::kGrid, text, ""}; }

void draw_legend(Canvas& canvas, const std::vector<LegendEntry>& entries) {
  double width = kLegendGap * static_cast<double>(entries.size() - 1);
  for (const LegendEntry& entry : entries) width += entry_width(entry);
  double left = (canvas.width() - width) / 2;
  for (const LegendEntry& entry : entries) {
    draw_entry(canvas, left, kLegendHeight, entry);
    left += entry_width(entry) + kLegendGap;
  }
}

double title_height(const RegistrationPicture& picture) {
  return 24 + (picture.title.empty() ? 0 : 1.35 * kTitleSize) + (picture.subtitle.empty() ? 0 : 1.6 * kSubtitleSize);
}

void draw_titles(Canvas& canvas, const RegistrationPicture& picture, double left) {
  const double room = canvas.width() - left - 24;
  double y = canvas.height() - 24;
  if (!picture.title.empty()) {
    canvas.text(left, y - 0.6 * kTitleSize, picture.title, kTitleSize, colour::kTitle, Align::kLeft, room);
    y -= 1.35 * kTitleSize;
  }
  if (!picture.subtitle.empty())
    canvas.text(left, y - 0.7 * kSubtitleSize, picture.subtitle, kSubtitleSize, colour::kText, Align::kLeft, room);
}

std::vector<Colour> colours_by_position(const Points& source) {
  const auto n = static_cast<std::size_t>(source.cols());
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return source(0, a) < source(0, b); });
  std::vector<Colour> colours(n);
  for (std::size_t rank = 0; rank < n; ++rank)
    colours[order[rank]] = time_colour(n < 2 ? 0.4 : static_cast<double>(rank) / static_cast<double>(n - 1));
  return colours;
}

}  // namespace pulson::picture
