#include "legend.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "layers.hpp"
#include "layout.hpp"

namespace pulson::picture {
namespace {

constexpr double kLeastEntryGap = 22;
constexpr std::size_t kMostGroups = kGroupColours;
constexpr double kBarLength = 190;
constexpr double kBarHeight = 12;

Points point(double x, double y) { return (Points(2, 1) << x, y).finished(); }

Points horizontal(double from, double to, double y) { return (Points(2, 2) << from, to, y, y).finished(); }

void draw_colour_bar(Canvas& canvas, double left, double y) {
  // Round ends reach out by r. Each piece covers the end of the one before it, so no seams show.
  constexpr double r = kBarHeight / 2, kPiece = (kBarLength - 2 * r) / kTimeColours;
  for (int i = 0; i < kTimeColours; ++i) {
    const double from = left + r + kPiece * i;
    canvas.lines({horizontal(from, from + kPiece, y)}, {time_colour((i + 0.5) / kTimeColours), kBarHeight});
  }
}

double sample_width(Sample sample) {
  return sample == Sample::kColourBar ? kBarLength : sample == Sample::kDot || sample == Sample::kRing ? 20 : 36;
}

/// `scale`: of the texts.
double entry_width(const LegendEntry& entry, double scale) {
  double width = sample_width(entry.sample) + kSampleGap + scale * text_width(entry.text, kLegendText);
  if (!entry.end_text.empty()) width += kSampleGap + scale * text_width(entry.end_text, kLegendText);
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
    case Sample::kArrow:
      return canvas.arrows(point(left, y), point(left + width, y), {entry.colour, 2});
    case Sample::kColourBar:
      return draw_colour_bar(canvas, left, y);
  }
}

void draw_entry(Canvas& canvas, double left, const LegendEntry& entry, double scale) {
  const double sample = sample_width(entry.sample);
  const auto write = [&](double x, const std::string& text) {
    canvas.text(x, kLegendHeight, text, kLegendText, colour::kText, Align::kLeft,
                scale < 1 ? scale * text_width(text, kLegendText) : 1e9);
  };
  if (entry.sample == Sample::kColourBar) {
    const double sample_left = left + scale * text_width(entry.text, kLegendText) + kSampleGap;
    write(left, entry.text);
    draw_sample(canvas, sample_left, kLegendHeight, entry);
    write(sample_left + sample + kSampleGap, entry.end_text);
  } else {
    draw_sample(canvas, left, kLegendHeight, entry);
    write(left + sample + kSampleGap, entry.text);
  }
}

}  // namespace

std::vector<LegendEntry> legend_of_shape(const Figure& figure, const Colour& colour, const std::string& text) {
  if (figure.names.empty()) return {{figure.marked.empty() ? Sample::kLine : Sample::kDot, colour, text, ""}};
  std::vector<LegendEntry> entries;
  for (std::size_t group = 0; group < std::min(figure.names.size(), kMostGroups); ++group) {
    const std::string& name = figure.names[group];
    const bool is_number = name.find_first_not_of("0123456789") == std::string::npos;
    entries.push_back({Sample::kDot, group_colour(group), is_number ? "group " + name : name, ""});
  }
  if (figure.names.size() > kMostGroups)
    entries.back().text += fmt::format(", {} more in these colours", figure.names.size() - kMostGroups);
  return entries;
}

LegendEntry legend_of_time(const std::vector<double>& times) {
  return {Sample::kColourBar, "", fmt::format("path, t = {:.4g}", times.front()), fmt::format("{:.4g}", times.back())};
}

void draw_legend(Canvas& canvas, const std::vector<LegendEntry>& entries) {
  const double gaps = std::max<double>(static_cast<double>(entries.size()) - 1, 1), room = canvas.width() - 2 * kEdge;
  double samples = 0, texts = 0;
  for (const LegendEntry& entry : entries) {
    samples += entry_width(entry, 0);
    texts += entry_width(entry, 1) - entry_width(entry, 0);
  }
  const double gap = std::clamp((room - samples - texts) / gaps, kLeastEntryGap, kEntryGap);
  const double scale = std::min(1.0, (room - samples - gap * gaps) / std::max(texts, 1.0));
  double left = (canvas.width() - samples - scale * texts - gap * (static_cast<double>(entries.size()) - 1)) / 2;
  for (const LegendEntry& entry : entries) {
    draw_entry(canvas, left, entry, scale);
    left += entry_width(entry, scale) + gap;
  }
}

}  // namespace pulson::picture
