#include "layout.hpp"

#include <array>
#include <cmath>

#include <fmt/format.h>

namespace pulson::draw {
namespace {

constexpr double kTicLength = 7;
constexpr double kTicText = 18;
constexpr double kWidestNumber = 0.85;  // of the distance between tics

/// The round step (1, 2 or 5 times a power of ten) nearest above `least`.
double round_step(double least) {
  const double power = std::pow(10.0, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * power >= least * (1 - 1e-9)) return factor * power;
  return 10 * power;
}

std::string tic_text(double value, double step) {
  if (std::abs(value) < step * 1e-6) value = 0;
  const double digits = -std::floor(std::log10(step) + 1e-9);
  std::string text = std::abs(value) >= 1e9 || digits > 6 ? fmt::format("{:.10g}", value)
                                                          : fmt::format("{:.{}f}", value, std::max(0, int(digits)));
  if (text.starts_with('-')) text.replace(0, 1, "−");
  return text;
}

constexpr double kTitleSize = 30;
constexpr double kSubtitleSize = 21;
constexpr double kTitleEdge = 24;
constexpr double kNumberRoom = 90;  // first guess of the numbers at the left

}  // namespace

double round_factor(double most) {
  if (!(most > 0) || !std::isfinite(most)) return 1;
  const double power = std::pow(10, std::floor(std::log10(most)));
  return most >= 5 * power ? 5 * power : most >= 2 * power ? 2 * power : power;
}

Interval range_of(const std::vector<const Points*>& sets, int row) {
  Interval range{INFINITY, -INFINITY};
  for (const Points* set : sets)
    if (set->cols() > 0)
      range = range.joined(
          {set->row(row).minCoeff<Eigen::PropagateNumbers>(), set->row(row).maxCoeff<Eigen::PropagateNumbers>()});
  return range;
}

std::vector<Interval> ranges_of(const std::vector<const Points*>& sets, int coordinates, double flattest) {
  std::vector<Interval> ranges;
  for (int row = 0; row < coordinates; ++row) ranges.push_back(range_of(sets, row));
  return with_margins(std::move(ranges), flattest);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Points path_of(const std::vector<Points>& trajectory, Eigen::Index landmark) {
  Points path(trajectory.front().rows(), static_cast<Eigen::Index>(trajectory.size()));
  for (Eigen::Index k = 0; k < path.cols(); ++k) path.col(k) = trajectory[static_cast<std::size_t>(k)].col(landmark);
  return path;
}

Points border_of(const Box& box) {
  Points border(2, 5);
  border << box.left, box.right(), box.right(), box.left, box.left,  //
      box.bottom, box.bottom, box.top(), box.top(), box.bottom;
  return border;
}

double number_width(const std::string& text) { return text_width(text, kTicText); }

Tics make_tics(const Interval& range, double pixels, double distance) {
  constexpr std::size_t kFewTics = 3;
  double step = round_step(range.span() * distance / pixels);
  const auto count = [&] { return std::floor(range.high / step) - std::ceil(range.low / step) + 1; };
  if (count() < kFewTics) step = round_step(range.span() * 0.45 * distance / pixels);
  Tics tics;
  for (double k = std::ceil(range.low / step); k * step <= range.high; ++k) {
    tics.values.push_back(k * step);
    tics.texts.push_back(tic_text(k * step, step));
    if (tics.values.size() > 20) break;  // the span is lost in rounding
  }
  return tics;
}

Tics make_tics_below(const Interval& range, double pixels, double distance) {
  const Tics tics = make_tics(range, pixels, distance);
  double widest = 0;
  for (const std::string& text : tics.texts) widest = std::max(widest, number_width(text));
  const double room = tics.values.size() < 2 ? pixels : (tics.values[1] - tics.values[0]) / range.span() * pixels;
  return widest < kWidestNumber * room ? tics : make_tics(range, pixels, widest / kWidestNumber);
}

Points View::pixels(const Points& data) const {
  Points result(2, data.cols());
  result.row(0) = (data.row(row_x).array() - x.low) * (box.width / x.span()) + box.left;
  result.row(1) =
      (data.row(row_y).array() - (y_down ? y.high : y.low)) * ((y_down ? -1 : 1) * box.height / y.span()) + box.bottom;
  return result;
}

double View::height_of(double coordinate) const {
  return box.bottom + (y_down ? y.high - coordinate : coordinate - y.low) / y.span() * box.height;
}

std::vector<Points> View::pixels(const std::vector<Points>& data) const {
  std::vector<Points> result;
  result.reserve(data.size());
  for (const Points& points : data) result.push_back(pixels(points));
  return result;
}

std::string axis_names(const View& view) {
  constexpr std::string_view kNames = "xyz";
  return fmt::format("{} →   {} ↑", kNames[view.row_x], kNames[view.row_y]);
}

std::string power_of_ten(int exponent, bool negative) {
  constexpr std::array<std::string_view, 10> kRaised = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  const std::string sign = negative ? "−" : "";
  if (exponent == 0 || exponent == 1) return sign + (exponent == 0 ? "1" : "10");
  std::string text = sign + (exponent < 0 ? "10⁻" : "10");
  for (const char digit : std::to_string(std::abs(exponent))) text += kRaised.at(static_cast<std::size_t>(digit - '0'));
  return text;
}

void draw_heading(Canvas& canvas, const Box& box, const std::string& heading, double height) {
  canvas.text(box.left, box.top() + height, heading, 22, colour::kTitle, Align::kLeft, box.width);
}

void draw_frame(Canvas& canvas, const View& view, const std::string& heading, const Tics& x_tics, const Tics& y_tics) {
  const Box& box = view.box;
  std::vector<Points> lines{border_of(box)};
  for (std::size_t i = 0; i < x_tics.values.size(); ++i) {
    const double x = box.left + (x_tics.values[i] - view.x.low) / view.x.span() * box.width;
    lines.push_back(line(x, box.bottom, x, box.bottom - kTicLength));
    const double half = number_width(x_tics.texts[i]) / 2;
    canvas.text(std::min(x, canvas.width() - half), box.bottom - kTicLength - 14, x_tics.texts[i], kTicText,
                colour::kTicText, Align::kCentre);
  }
  for (std::size_t i = 0; i < y_tics.values.size(); ++i) {
    const double y = view.height_of(y_tics.values[i]);
    lines.push_back(line(box.left, y, box.left - kTicLength, y));
    canvas.text(box.left - kTicLength - 7, y, y_tics.texts[i], kTicText, colour::kTicText, Align::kRight);
  }
  canvas.lines(lines, {colour::kFrame, 1.4});
  if (!heading.empty()) draw_heading(canvas, box, heading);
}

void draw_frame(Canvas& canvas, const View& view, const std::string& heading, bool left_numbers) {
  draw_frame(canvas, view, heading, make_tics_below(view.x, view.box.width),
             left_numbers ? make_tics(view.y, view.box.height) : Tics());
}

double left_number_width(const Tics& tics) {
  double widest = 0;
  for (const std::string& text : tics.texts) widest = std::max(widest, number_width(text));
  return widest + kTicLength + 7;
}

double left_number_width(const Interval& y, double pixels) { return left_number_width(make_tics(y, pixels)); }

double title_height(const Titles& titles) {
  return kTitleEdge + (titles.title.empty() ? 0 : 1.35 * kTitleSize) +
         (titles.subtitle.empty() ? 0 : 1.6 * kSubtitleSize);
}

Canvas titled_canvas(const Titles& titles, double left, double width, double height) {
  Canvas canvas(std::round(width), std::round(height + title_height(titles)));
  const double room = canvas.width() - left - kTitleEdge;
  double y = canvas.height() - kTitleEdge;
  if (!titles.title.empty()) {
    canvas.text(left, y - 0.6 * kTitleSize, titles.title, kTitleSize, colour::kTitle, Align::kLeft, room);
    y -= 1.35 * kTitleSize;
  }
  if (!titles.subtitle.empty())
    canvas.text(left, y - 0.7 * kSubtitleSize, titles.subtitle, kSubtitleSize, colour::kText, Align::kLeft, room);
  return canvas;
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
  double scale = std::min((arrangement.most_width - frame_width()) / sum_x, arrangement.tallest / most_y);
  numbers = arrangement.number_room;
  for (const View& view : views) numbers = std::max(numbers, left_number_width(view.y, scale * view.y.span()));
  scale = std::min((arrangement.most_width - frame_width()) / sum_x, arrangement.tallest / most_y);

  const double width = std::max(arrangement.least_width, frame_width() + scale * sum_x);
  const double spare = (width - frame_width() - scale * sum_x) / columns / scale;
  const double rows_height = stacked ? scale * sum_y + static_cast<double>(views.size()) * (kHeading + kTicRoom)
                                     : scale * most_y + kHeading + kTicRoom;
  const double height = rows_height + arrangement.room_below + kLegendRoom;
  double left = kEdge + numbers, top = height - kHeading;
  for (View& view : views) {
    view.x = view.x.with_span(view.x.span() + spare);
    view.box = {left, top - scale * view.y.span(), scale * view.x.span(), scale * view.y.span()};
    if (stacked)
      top -= view.box.height + kHeading + kTicRoom;
    else
      left += view.box.width + kGap + (all_numbered ? numbers : 0);
  }
  return {titled_canvas(titles, kEdge + numbers, width, height), std::move(views)};
}

}  // namespace pulson::draw
