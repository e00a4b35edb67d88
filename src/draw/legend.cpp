#include "draw/legend.hpp"

#include <algorithm>

#include "layout.hpp"

namespace pulson::draw {
namespace {

constexpr double kLegendText = 20;
constexpr double kEntryGap = 48, kLeastEntryGap = 22;  // between entries
constexpr double kLegendHeight = 30;                   // above the bottom edge
constexpr double kSampleGap = 11;                      // between a sample and its text
constexpr double kSampleHeight = 20, kSampleWidth = 20, kLineLength = 36;
constexpr double kLegendRow = 34;
constexpr double kBarLength = 190, kBarHeight = 12;

void draw_colour_bar(Canvas& canvas, double left, double y, const std::function<Colour(double)>& colour) {
  // Round ends reach out by r. Each piece covers the end of the one before it, so no seams show.
  constexpr double r = kBarHeight / 2, kPiece = (kBarLength - 2 * r) / kTimeColours;
  for (int i = 0; i < kTimeColours; ++i) {
    const double from = left + r + kPiece * i;
    canvas.lines({line(from, y, from + kPiece, y)}, {colour((i + 0.5) / kTimeColours), kBarHeight});
  }
}

/// Of a text with the gap to its sample.
double text_room(const std::string& text) { return text.empty() ? 0 : kSampleGap + text_width(text, kLegendText); }

double entry_width(const LegendEntry& entry) {
  return text_room(entry.text_before) + entry.width + text_room(entry.text);
}

/// @param room for the entry; its text is made smaller where it needs more
void draw_entry(Canvas& canvas, double left, double y, const LegendEntry& entry, double room) {
  const double before = text_room(entry.text_before), sample_left = left + before;
  if (before > 0) canvas.text(left, y, entry.text_before, kLegendText, colour::kText);
  entry.draw(canvas, {sample_left, y - kSampleHeight / 2, entry.width, kSampleHeight});
  canvas.text(sample_left + entry.width + kSampleGap, y, entry.text, kLegendText, colour::kText, Align::kLeft,
              room - before - entry.width - kSampleGap);
}

/// The entries in rows: as many in each as fit at the least distance.
std::vector<std::vector<LegendEntry>> legend_rows(const std::vector<LegendEntry>& entries, double room) {
  std::vector<std::vector<LegendEntry>> rows;
  double used = 0;
  for (const LegendEntry& entry : entries) {
    const double width = entry_width(entry);
    if (rows.empty() || used + kLeastEntryGap + width > room) {
      rows.push_back({entry});
      used = width;
    } else {
      rows.back().push_back(entry);
      used += kLeastEntryGap + width;
    }
  }
  return rows;
}

}  // namespace

LegendEntry dot_entry(const std::string& text, const SeriesLook& look) {
  return {text, kSampleWidth, [=](Canvas& canvas, const Box& box) { draw_marks(canvas, box.middle(), 6.5, look); }};
}

LegendEntry ring_entry(const std::string& text, const Colour& colour) {
  return {text, kSampleWidth, [=](Canvas& canvas, const Box& box) { canvas.rings(box.middle(), 8.5, {colour, 2.2}); }};
}

LegendEntry line_entry(const std::string& text, const Colour& colour) {
  return {text, kLineLength, [=](Canvas& canvas, const Box& box) {
            canvas.lines({line(box.left, box.middle().y(), box.right(), box.middle().y())}, {colour, 2.4});
          }};
}

LegendEntry arrow_entry(const std::string& text, const Colour& colour) {
  return {text, kLineLength, [=](Canvas& canvas, const Box& box) {
            const Eigen::Vector2d half(box.width / 2, 0);
            canvas.arrows(box.middle() - half, box.middle() + half, {colour, 2});
          }};
}

LegendEntry bar_entry(const std::string& text_before, const std::string& text,
                      const std::function<Colour(double)>& colour) {
  const auto draw = [=](Canvas& canvas, const Box& box) {
    draw_colour_bar(canvas, box.left, box.middle().y(), colour);
  };
  return {text, kBarLength, draw, text_before};
}

void draw_legend(Canvas& canvas, const std::vector<LegendEntry>& entries) {
  const double room = canvas.width() - 2 * kEdge;
  const std::vector<std::vector<LegendEntry>> rows = legend_rows(entries, room);
  double y = kLegendHeight;
  for (const std::vector<LegendEntry>& row : rows) {
    double widths = 0;
    for (const LegendEntry& entry : row) widths += entry_width(entry);
    const auto gaps = static_cast<double>(row.size() - 1);
    const double gap = std::clamp((room - widths) / std::max(gaps, 1.0), kLeastEntryGap, kEntryGap);
    double left = std::max(kEdge, (canvas.width() - widths - gap * gaps) / 2);
    for (const LegendEntry& entry : row) {
      draw_entry(canvas, left, y, entry, canvas.width() - kEdge - left);
      left += entry_width(entry) + gap;
    }
    y -= kLegendRow;
  }
  if (rows.size() > 1) canvas.extend_below(kLegendRow * static_cast<double>(rows.size() - 1));
}

}  // namespace pulson::draw
