#include "layers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "draw/thinning.hpp"

namespace pulson::picture {
namespace {

constexpr std::size_t kFewestVertices = 24;  // of one path
constexpr std::size_t kMostVertices = 3000;
constexpr double kDenseOutline = 2.2;
constexpr double kNumberSize = 15;
constexpr Eigen::Index kMostNumbers = 60;

const std::vector<Colour>& palette() {
  static const std::vector<Colour> kColours(kLightPalette.groups.begin(), kLightPalette.groups.end());
  return kColours;
}

/// What a text in `place` would cover: marks of radius `ring`, and texts.
int covered(const Box& place, double ring, const Points& marks, const std::vector<Box>& taken) {
  const Eigen::Vector2d low(place.left, place.bottom), high(place.left + place.width, place.bottom + place.height);
  int count = 0;
  for (const auto& mark : marks.colwise()) {
    const Eigen::Vector2d away = mark.cwiseMax(low).cwiseMin(high) - mark;
    if (away.norm() < ring) ++count;
  }
  for (const Box& other : taken)
    if (other.left < high.x() && low.x() < other.left + other.width && other.bottom < high.y() &&
        low.y() < other.bottom + other.height)
      ++count;
  return count;
}

/// The first of eight boxes around a mark, for a text of that width, that covers least.
Box freest_place(const Eigen::Vector2d& mark, double width, double ring, const Points& marks,
                 const std::vector<Box>& taken) {
  constexpr double kApart = 2;
  const double away = ring + kApart, beside = 0.7 * away, height = kNumberSize;
  const auto box = [&](double x, double y, double left, double below) {
    return Box{mark.x() + x - left * width, mark.y() + y - below * height, width, height};
  };
  const std::array<Box, 8> places = {
      box(beside, beside, 0, 0), box(beside, -beside, 0, 1), box(-beside, beside, 1, 0), box(-beside, -beside, 1, 1),
      box(away, 0, 0, 0.5),      box(-away, 0, 1, 0.5),      box(0, away, 0.5, 0),       box(0, -away, 0.5, 1)};
  const auto less = [&](const Box& a, const Box& b) {
    return covered(a, ring, marks, taken) < covered(b, ring, marks, taken);
  };
  return *std::min_element(places.begin(), places.end(), less);
}

}  // namespace

const Colour& group_colour(std::size_t group) { return palette()[group % kGroupColours]; }

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

void draw_numbers(Canvas& canvas, const Points& pixels, const Figure& figure, const std::vector<int>& numbers,
                  const Points& others) {
  if (pixels.cols() > kMostNumbers || !figure.outlines.empty() || figure.spacing < 2 * kNumberSize) return;
  const double ring = Marks(figure).ring;
  Points marks(2, pixels.cols() + others.cols());
  marks << pixels, others;
  std::vector<Box> taken;
  for (Eigen::Index a = 0; a < pixels.cols(); ++a) {
    const auto number = numbers.empty() ? static_cast<int>(a) + 1 : numbers[static_cast<std::size_t>(a)];
    const std::string text = std::to_string(number);
    const Box place = freest_place(pixels.col(a), text_width(text, kNumberSize), ring, marks, taken);
    taken.push_back(place);
    canvas.text_on_image(place.left, place.bottom + place.height / 2, text, kNumberSize, colour::kText);
  }
}

void draw_target(Canvas& canvas, const Points& pixels, const Figure& figure, const Marks& marks) {
  canvas.lines(trace(figure, false, pixels), {faded(colour::kTarget, 0.45), marks.outline});
  canvas.lines(trace(figure, true, pixels), {colour::kTarget, 1.6 * kDenseOutline});
  canvas.rings(pixels(Eigen::all, figure.marked), marks.ring, {colour::kTarget, marks.stroke});
}

void draw_paths_by_time(Canvas& canvas, const View& view, const Paths& paths, const Figure& figure, double width,
                        std::size_t vertices) {
  const std::vector<double>& times = paths.times;
  const double start = times.front(), duration = times.back() - times.front();
  const auto colour_of_step = [&](std::size_t from, std::size_t to) {
    const double middle = (times[from] - start) / 2 + (times[to] - start) / 2;
    return std::min(static_cast<std::size_t>(kTimeColours * (middle / duration)), std::size_t{kTimeColours - 1});
  };
  const std::size_t most = std::clamp(vertices / figure.with_path.size(), kFewestVertices, kMostVertices);
  const auto kept = thin_paths(paths.trajectory, figure.with_path, times, most);

  std::vector<std::vector<Points>> pieces(kTimeColours);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const std::vector<std::size_t>& k = kept[i];
    Points path(paths.trajectory.front().rows(), static_cast<Eigen::Index>(k.size()));
    for (std::size_t j = 0; j < k.size(); ++j) path.col(j) = paths.trajectory[k[j]].col(figure.with_path[i]);
    path = view.pixels(path);
    for (std::size_t begin = 0, end = 0; begin + 1 < k.size(); begin = end) {
      const std::size_t colour = colour_of_step(k[begin], k[begin + 1]);
      while (end + 1 < k.size() && colour_of_step(k[end], k[end + 1]) == colour) ++end;
      pieces[colour].emplace_back(path.middleCols(begin, end - begin + 1));
    }
  }
  for (std::size_t i = 0; i < pieces.size(); ++i)
    canvas.lines(pieces[i], {time_colour((static_cast<double>(i) + 0.5) / kTimeColours), width});
}

void draw_start(Canvas& canvas, const Points& pixels, const Figure& figure) {
  for (std::size_t group = 0; group < figure.groups.size(); ++group) {
    const Colour& own = figure.names.empty() ? colour::kSource : group_colour(group);
    canvas.lines(trace(figure, true, pixels, group), {own, 1});
    canvas.dots(pixels(Eigen::all, figure.groups[group]), 0.6 * Marks(figure).dot, own);
  }
}

std::vector<Colour> colours_by_position(const Points& source) {
  const auto n = static_cast<std::size_t>(source.cols());
  if (n <= kGroupColours) return {palette().begin(), palette().begin() + static_cast<std::ptrdiff_t>(n)};
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
