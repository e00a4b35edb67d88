#include "layers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "draw/checks.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson::draw {
namespace {

constexpr Eigen::Index kFewestPoints = 12;
constexpr double kLargestGap = 3;   // in median gaps
constexpr double kLargestStep = 2;  // median gap in median distances to the nearest point
constexpr Eigen::Index kFewestOfRing = 6;
constexpr double kRingGap = 2;     // in median gaps: between the ends of a ring
constexpr double kSharpTurn = 60;  // degrees
constexpr double kMostSharp = 6;   // of so many turns, one may be sharp
constexpr double kDenseGap = 7;    // pixels between neighbours, below which marks would run into one another

std::vector<double> gaps_of(const Points& points) {
  std::vector<double> gaps(static_cast<std::size_t>(points.cols() - 1));
  for (Eigen::Index i = 0; i + 1 < points.cols(); ++i) gaps[i] = (points.col(i + 1) - points.col(i)).norm();
  return gaps;
}

// Whether so many turns are sharp that the points in their order are corners and not samples of a curve.
bool is_jagged(const Points& points) {
  const double least = std::cos(kSharpTurn * std::numbers::pi / 180);
  Eigen::Index sharp = 0;
  for (Eigen::Index i = 1; i + 1 < points.cols(); ++i) {
    const Eigen::VectorXd before = points.col(i) - points.col(i - 1), after = points.col(i + 1) - points.col(i);
    if (before.dot(after) < least * before.norm() * after.norm()) ++sharp;
  }
  return kMostSharp * static_cast<double>(sharp) > static_cast<double>(points.cols() - 2);
}

double cross(const Eigen::Vector2d& u, const Eigen::Vector2d& v) { return u.x() * v.y() - u.y() * v.x(); }

// Whether the open segments ab and cd cross.
bool cross_each_other(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
                      const Eigen::Vector2d& d) {
  return cross(b - a, c - a) * cross(b - a, d - a) < 0 && cross(d - c, a - c) * cross(d - c, b - c) < 0;
}

// Of segments in the order of their left ends, those that begin before one ends.
bool crosses_itself(const Points& points) {
  const Eigen::Index count = points.cols() - 1;
  const Eigen::VectorXd left = points.row(0).head(count).cwiseMin(points.row(0).tail(count));
  const Eigen::VectorXd right = points.row(0).head(count).cwiseMax(points.row(0).tail(count));
  std::vector<Eigen::Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), Eigen::Index(0));
  std::sort(order.begin(), order.end(), [&](Eigen::Index i, Eigen::Index j) { return left[i] < left[j]; });
  for (auto i = order.begin(); i != order.end(); ++i)
    for (auto j = i + 1; j != order.end() && left[*j] <= right[*i]; ++j)
      if (std::abs(*i - *j) > 1 &&
          cross_each_other(points.col(*i), points.col(*i + 1), points.col(*j), points.col(*j + 1)))
        return true;
  return false;
}

// Whether the largest gap joins two rings: both parts that it separates close by themselves.
bool are_two_rings(const Points& points, const std::vector<double>& gaps) {
  const Eigen::Index first = 1 + (std::max_element(gaps.begin(), gaps.end()) - gaps.begin());
  const auto closes = [&](const Points& part) {
    const Eigen::Index n = part.cols();
    return n >= kFewestOfRing && (part.col(n - 1) - part.col(0)).norm() <= kRingGap * median(gaps_of(part));
  };
  return closes(points.leftCols(first)) && closes(points.rightCols(points.cols() - first));
}

void remove(std::vector<int>& from, const std::vector<int>& landmarks) {
  std::erase_if(from, [&](int a) { return std::binary_search(landmarks.begin(), landmarks.end(), a); });
}

std::vector<std::vector<int>> complete_landmarks_by_group(const Landmarks& shape) {
  const std::vector<int> incomplete = incomplete_points(shape.points);
  std::vector<std::vector<int>> groups = landmarks_by_group(shape);
  for (std::vector<int>& members : groups) remove(members, incomplete);
  std::erase_if(groups, [](const std::vector<int>& members) { return members.empty(); });
  return groups;
}

/// The links of complete landmarks that no outline of the figure draws.
std::vector<Link> links_beside_outlines(const Landmarks& shape, const Figure& figure,
                                        const std::vector<std::vector<int>>& groups) {
  std::vector<Link> links;
  if (shape.links.empty() || shape.dimension() < 2) return links;
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> group_of(static_cast<std::size_t>(shape.count()), kNone);
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const int a : groups[g]) group_of[static_cast<std::size_t>(a)] = g;
  std::set<std::pair<int, int>> drawn;
  for (const Outline& outline : figure.outlines)
    for (std::size_t i = 1; i < outline.members.size(); ++i)
      drawn.insert(std::minmax({outline.members[i - 1], outline.members[i]}));
  for (const auto& [a, b] : shape.links) {
    const std::size_t group = group_of[static_cast<std::size_t>(a)];
    if (group != kNone && group_of[static_cast<std::size_t>(b)] != kNone && drawn.insert(std::minmax({a, b})).second)
      links.push_back({a, b, group});
  }
  return links;
}

constexpr std::size_t kFewestVertices = 24;  // of one path
constexpr std::size_t kMostVertices = 3000;
constexpr double kDenseOutline = 2.2, kNumberSize = 15;
constexpr Eigen::Index kMostNumbers = 60;
constexpr std::size_t kMostGroups = 2 * kGroupColours;  // in the legend

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

}  // namespace

OutlineKind outline_kind(const Points& points) {
  const Eigen::Index n = points.cols();
  if (points.rows() < 2 || n < kFewestPoints) return OutlineKind::kNone;
  std::vector<double> gaps = gaps_of(points);
  const double largest = *std::max_element(gaps.begin(), gaps.end());
  if (are_two_rings(points, gaps)) return OutlineKind::kNone;
  const double typical = median(std::move(gaps));
  if (!(typical > 0) || largest > kLargestGap * typical) return OutlineKind::kNone;
  if (typical > kLargestStep * median_nearest_distance(points)) return OutlineKind::kNone;
  if (is_jagged(points)) return OutlineKind::kNone;
  if (points.rows() == 2 && crosses_itself(points)) return OutlineKind::kNone;
  const bool closes = (points.col(n - 1) - points.col(0)).norm() <= kLargestGap * typical;
  return closes ? OutlineKind::kClosed : OutlineKind::kOpen;
}

Figure plan_figure(const Landmarks& shape, double scale) {
  Figure figure{};
  const std::vector<std::vector<int>> groups = complete_landmarks_by_group(shape);
  for (const std::vector<int>& members : groups) {
    const Points points = shape.points(Eigen::all, members);
    const OutlineKind kind = outline_kind(points);
    std::size_t stride = 1;
    if (kind != OutlineKind::kNone) {
      const double gap = scale * median(gaps_of(points));
      const auto most = static_cast<double>(members.size());
      if (gap < kDenseGap) stride = static_cast<std::size_t>(std::min(most, std::ceil(kDenseGap / gap)));
      figure.outlines.push_back({members, figure.groups.size(), stride > 1});
      if (kind == OutlineKind::kClosed) figure.outlines.back().members.push_back(members.front());
    }
    figure.groups.push_back(stride == 1 ? members : std::vector<int>());
    if (!shape.groups.empty()) figure.names.push_back(shape.groups[static_cast<std::size_t>(members.front())]);
    figure.marked.insert(figure.marked.end(), figure.groups.back().begin(), figure.groups.back().end());
    for (std::size_t i = 0; i < members.size(); i += stride) figure.with_path.push_back(members[i]);
  }
  if (figure.groups.size() < 2) figure.names.clear();
  figure.links = links_beside_outlines(shape, figure, groups);
  figure.spacing = std::numeric_limits<double>::infinity();
  if (figure.marked.size() > 1)
    figure.spacing = scale * median_nearest_distance(shape.points(Eigen::all, figure.marked));
  return figure;
}

Figure without(Figure figure, const std::vector<int>& left_out) {
  for (std::vector<int>& members : figure.groups) remove(members, left_out);
  remove(figure.marked, left_out);
  for (Outline& outline : figure.outlines) {
    const bool closed = outline.members.front() == outline.members.back();
    if (closed) outline.members.pop_back();
    remove(outline.members, left_out);
    if (closed && outline.members.size() > 1) outline.members.push_back(outline.members.front());
  }
  std::erase_if(figure.outlines, [](const Outline& outline) { return outline.members.size() < 2; });
  std::erase_if(figure.links, [&](const Link& link) {
    return std::binary_search(left_out.begin(), left_out.end(), link.from) ||
           std::binary_search(left_out.begin(), left_out.end(), link.to);
  });
  return figure;
}

std::vector<Points> trace(const Figure& figure, bool dense, const Points& points, std::optional<std::size_t> group) {
  std::vector<Points> lines;
  for (const Outline& outline : figure.outlines)
    if (outline.dense == dense && outline.group == group.value_or(outline.group))
      lines.emplace_back(points(Eigen::all, outline.members));
  for (const Link& link : figure.links)
    if (!dense && link.group == group.value_or(link.group))
      lines.emplace_back(points(Eigen::all, std::array{link.from, link.to}));
  return lines;
}

TextPlace freest_place(const Eigen::Vector2d& mark, double width, double height, double ring, const Points& marks,
                       const std::vector<Box>& taken) {
  constexpr double kApart = 2;
  const double away = ring + kApart, beside = 0.7 * away;
  const auto place = [&](double x, double y, double left, double below) {
    const Box box{mark.x() + x - left * width, mark.y() + y - below * height, width, height};
    return TextPlace{box, covered(box, ring, marks, taken)};
  };
  const std::array<TextPlace, 8> places = {place(beside, beside, 0, 0),  place(beside, -beside, 0, 1),
                                           place(-beside, beside, 1, 0), place(-beside, -beside, 1, 1),
                                           place(away, 0, 0, 0.5),       place(-away, 0, 1, 0.5),
                                           place(0, away, 0.5, 0),       place(0, -away, 0.5, 1)};
  return *std::min_element(places.begin(), places.end(),
                           [](const TextPlace& a, const TextPlace& b) { return a.covered < b.covered; });
}

Colour group_colour(std::size_t group) { return kLightPalette.groups.at(group % kGroupColours); }

SeriesLook group_look(std::size_t group) { return {group_colour(group), group / kGroupColours}; }

Marks::Marks(const Figure& figure) {
  const double shown = static_cast<double>(std::max(figure.marked.size(), figure.with_path.size()));
  dot = std::clamp(std::min(8.5 * std::pow(4 / shown, 0.28), 0.32 * figure.spacing), 1.8, 8.5);
  ring = 1.35 * dot + std::min(1.4, 0.4 * dot);
  if (figure.spacing < kDenseGap) ring = std::clamp(0.6 * figure.spacing, 1.4, ring);  // or they fill a band
  stroke = std::clamp(0.3 * dot, 0.9, 2.4);
  path = std::clamp(0.5 * dot, 1.1, 4.0);
  outline = std::clamp(0.4 * dot, 1.1, 2.4);
}

void draw_shape(Canvas& canvas, const Points& pixels, const Figure& figure, const Colour& colour, double most_dot) {
  const Marks marks(figure);
  const double dot = std::min(marks.dot, most_dot);
  for (std::size_t group = 0; group < figure.groups.size(); ++group) {
    const SeriesLook own = figure.names.empty() ? SeriesLook{colour} : group_look(group);
    canvas.lines(trace(figure, false, pixels, group), {own.colour, marks.outline});
    canvas.lines(trace(figure, true, pixels, group), {own.colour, kDenseOutline});
    draw_marks(canvas, pixels(Eigen::all, figure.groups[group]), dot, own, std::min(1.2, 0.25 * dot));
  }
}

namespace {

std::vector<std::string> landmark_numbers(const Landmarks& shape) {
  std::vector<std::string> numbers;
  for (int a = 0; a < shape.count(); ++a) numbers.push_back(std::to_string(shape.number(a)));
  return numbers;
}

}  // namespace

std::vector<std::string> mark_names(const Landmarks& shape) {
  constexpr std::size_t kLongestLabel = 12;  // bytes
  const auto is_short = [](const std::string& label) { return !label.empty() && label.size() <= kLongestLabel; };
  const std::set<std::string> different(shape.labels.begin(), shape.labels.end());
  if (std::ssize(different) == shape.count() && std::all_of(shape.labels.begin(), shape.labels.end(), is_short))
    return shape.labels;
  return landmark_numbers(shape);
}

void draw_names(Canvas& canvas, const Points& pixels, const Figure& figure, const Landmarks& shape,
                const Points& others) {
  if (pixels.cols() > kMostNumbers || !figure.outlines.empty() || figure.spacing < 2 * kNumberSize) return;
  const double ring = Marks(figure).ring;
  Points marks(2, pixels.cols() + others.cols());
  marks << pixels, others;
  // The places of these texts, and how much they cover.
  const auto place_all = [&](const std::vector<std::string>& texts, std::vector<Box>& taken) {
    int covered = 0;
    for (Eigen::Index a = 0; a < pixels.cols(); ++a) {
      const double width = text_width(texts[static_cast<std::size_t>(a)], kNumberSize);
      const TextPlace place = freest_place(pixels.col(a), width, kNumberSize, ring, marks, taken);
      taken.push_back(place.box);
      covered += place.covered;
    }
    return covered;
  };
  std::vector<std::string> texts = mark_names(shape);
  std::vector<Box> taken;
  constexpr double kMostCovered = 0.2;  // marks and texts for each name, above which numbers are easier to read
  if (place_all(texts, taken) > kMostCovered * static_cast<double>(pixels.cols()) && !shape.labels.empty()) {
    texts = landmark_numbers(shape);
    taken.clear();
    place_all(texts, taken);
  }
  for (std::size_t a = 0; a < texts.size(); ++a)
    canvas.text_on_image(taken[a].left, taken[a].bottom + taken[a].height / 2, texts[a], kNumberSize, colour::kTitle);
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

void draw_image(Canvas& canvas, const View& view, const std::optional<PlacedImage>& image) {
  if (!image) return;
  constexpr double kPaleness = 0.35;
  Points corners(2, 2);
  corners << image->low, image->high;
  const Points pixels = view.pixels(corners);
  const Eigen::Vector2d low = pixels.rowwise().minCoeff(), high = pixels.rowwise().maxCoeff();
  const Box box{low.x(), low.y(), high.x() - low.x(), high.y() - low.y()};
  canvas.raster(image->pixels, box);
  canvas.areas({border_of(box)}, faded(colour::kPaper, 1 - kPaleness));
}

void draw_start(Canvas& canvas, const Points& pixels, const Figure& figure) {
  for (std::size_t group = 0; group < figure.groups.size(); ++group) {
    const SeriesLook own = figure.names.empty() ? SeriesLook{colour::kSource} : group_look(group);
    canvas.lines(trace(figure, true, pixels, group), {own.colour, 1});
    draw_marks(canvas, pixels(Eigen::all, figure.groups[group]), 0.6 * Marks(figure).dot, own);
  }
}

std::vector<Colour> colours_by_position(const Points& source) {
  const auto n = static_cast<std::size_t>(source.cols());
  std::vector<Colour> colours;
  for (std::size_t a = 0; a < n; ++a) colours.push_back(group_colour(a));
  if (n <= kGroupColours) return colours;
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return source(0, a) < source(0, b); });
  for (std::size_t rank = 0; rank < n; ++rank)
    colours[order[rank]] = time_colour(static_cast<double>(rank) / static_cast<double>(n - 1));
  return colours;
}

std::vector<LegendEntry> legend_of_shape(const Figure& figure, const Colour& colour, const std::string& text) {
  if (figure.names.empty()) return {figure.marked.empty() ? line_entry(text, colour) : dot_entry(text, {colour})};
  std::vector<LegendEntry> entries;
  for (std::size_t group = 0; group < std::min(figure.names.size(), kMostGroups); ++group) {
    const std::string& name = figure.names[group];
    const bool is_number = name.find_first_not_of("0123456789") == std::string::npos;
    entries.push_back(dot_entry(is_number ? "group " + name : name, group_look(group)));
  }
  if (figure.names.size() > kMostGroups)
    entries.back().text += fmt::format(", {} more", figure.names.size() - kMostGroups);
  return entries;
}

LegendEntry legend_of_time(const std::vector<double>& times) {
  return bar_entry(fmt::format("path, t = {:.4g}", times.front()), fmt::format("{:.4g}", times.back()));
}

}  // namespace pulson::draw
