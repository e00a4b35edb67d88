#include "layout.hpp"

#include <algorithm>
#include <cmath>

namespace pulson::picture {
namespace {

constexpr double kTitleSize = 30;
constexpr double kSubtitleSize = 21;
constexpr double kTitleEdge = 24;
constexpr double kNumberRoom = 90;  // first guess of the numbers at the left

}  // namespace

double title_height(const Titles& titles) {
  return kTitleEdge + (titles.title.empty() ? 0 : 1.35 * kTitleSize) +
         (titles.subtitle.empty() ? 0 : 1.6 * kSubtitleSize);
}

void draw_titles(Canvas& canvas, const Titles& titles, double left) {
  const double room = canvas.width() - left - kTitleEdge;
  double y = canvas.height() - kTitleEdge;
  if (!titles.title.empty()) {
    canvas.text(left, y - 0.6 * kTitleSize, titles.title, kTitleSize, colour::kTitle, Align::kLeft, room);
    y -= 1.35 * kTitleSize;
  }
  if (!titles.subtitle.empty())
    canvas.text(left, y - 0.7 * kSubtitleSize, titles.subtitle, kSubtitleSize, colour::kText, Align::kLeft, room);
}

std::vector<Interval> with_margins(std::vector<Interval> ranges, double flattest) {
  double widest = 0, largest = 0;
  for (const Interval& range : ranges) {
    widest = std::max(widest, range.span());
    largest = std::max({largest, std::abs(range.low), std::abs(range.high)});
  }
  if (widest <= 1e-9 * largest) widest = largest > 0 ? 0.2 * largest : 1;  // all at one place
  for (Interval& range : ranges)
    range = range.with_span(std::max(range.span(), flattest * widest) + 2 * kMargin * widest);
  return ranges;
}

Plan arrange(const Titles& titles, std::vector<View> views, const Arrangement& arrangement) {
  const bool stacked = arrangement.stacked, all_numbered = arrangement.all_numbered;
  double sum_x = 0, most_y = 0, sum_y = 0;
  for (const View& view : views) {
    sum_x = stacked ? std::max(sum_x, view.x.span()) : sum_x + view.x.span();
    most_y = std::max(most_y, view.y.span());
    sum_y += view.y.span();
  }
  const double columns = stacked ? 1 : static_cast<double>(views.size());
  double numbers = std::max(kNumberRoom, arrangement.number_room);
  const auto frame_width = [&] { return 2 * kEdge + numbers + (columns - 1) * (all_numbered ? kGap + numbers : kGap); };
  double scale = std::min((kWidth - frame_width()) / sum_x, arrangement.tallest / most_y);
  numbers = arrangement.number_room;
  for (const View& view : views) numbers = std::max(numbers, left_number_width(view.y, scale * view.y.span()));
  scale = std::min((kWidth - frame_width()) / sum_x, arrangement.tallest / most_y);

  const double width = std::max(arrangement.least_width, frame_width() + scale * sum_x);
  const double spare = (width - frame_width() - scale * sum_x) / columns / scale;
  const double rows_height = stacked ? scale * sum_y + static_cast<double>(views.size()) * (kHeading + kTicRoom)
                                     : scale * most_y + kHeading + kTicRoom;
  const double height = title_height(titles) + rows_height + arrangement.room_below + kLegendRoom;
  double left = kEdge + numbers, top = height - title_height(titles) - kHeading;
  for (View& view : views) {
    view.x = view.x.with_span(view.x.span() + spare);
    view.box = {left, top - scale * view.y.span(), scale * view.x.span(), scale * view.y.span()};
    if (stacked)
      top -= view.box.height + kHeading + kTicRoom;
    else
      left += view.box.width + kGap + (all_numbered ? numbers : 0);
  }
  Canvas canvas(std::round(width), std::round(height));
  draw_titles(canvas, titles, kEdge + numbers);
  return {std::move(canvas), std::move(views)};
}

}  // namespace pulson::picture
