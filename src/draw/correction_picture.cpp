#include "correction_picture.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "checks.hpp"
#include "layers.hpp"
#include "layout.hpp"

namespace pulson::draw {
namespace {

constexpr double kTallestCorrection = 560;  // of a panel, pixels
constexpr double kLeastFlat = 0.2;          // height of a panel over its width
constexpr double kFarOut = 1;               // of landmarks that are drawn, spans of the reference beyond it
constexpr double kNameRoom = 0.04;          // beside the outermost landmarks, spans of the reference
constexpr double kNameSize = 17;
constexpr std::size_t kMostNamesBeside = 40;
const Colour kWrong{kLightPalette.target};
const Colour kMended{kLightPalette.groups[2]};

// The range of a coordinate that is shown: all of the reference, and what else is not too far out.
Interval shown_range(const CorrectionPicture& picture, int row) {
  const Interval reference = range_of({&picture.reference.points}, row);
  Interval all = range_of({&picture.reference.points, &picture.shape}, row);
  if (picture.corrected.size() > 0) all = all.joined(range_of({&picture.reference.points, &picture.corrected}, row));
  const double beyond = kFarOut * reference.span(), beside = kNameRoom * reference.span();
  return {std::max(all.low, reference.low - beyond) - beside, std::min(all.high, reference.high + beyond) + beside};
}

View view_of(const CorrectionPicture& picture) {
  const int dimension = picture.reference.dimension();
  std::vector<Interval> ranges;
  for (int row = 0; row < dimension; ++row) ranges.push_back(shown_range(picture, row));
  std::vector<int> axes(static_cast<std::size_t>(dimension));
  std::iota(axes.begin(), axes.end(), 0);
  if (dimension > 2)
    std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) { return ranges[a].span() > ranges[b].span(); });
  const std::vector<Interval> shown = with_margins({ranges[axes[0]], ranges[axes[1]]}, kLeastFlat);
  return {{}, shown[0], shown[1], axes[0], axes[1], dimension == 2 && picture.reference.frame.y_down};
}

std::vector<int> present_in(const Points& points, const std::vector<int>& landmarks) {
  std::vector<int> present;
  std::copy_if(landmarks.begin(), landmarks.end(), std::back_inserter(present),
               [&](int a) { return points.col(a).allFinite(); });
  return present;
}

// Where each landmark belongs: mended, else where what the shape is judged by has it.
Points destinations(const CorrectionPicture& picture) {
  Points all = picture.corrected.size() > 0 ? picture.corrected : picture.reference.points;
  for (Eigen::Index a = 0; a < all.cols(); ++a)
    if (!all.col(a).allFinite()) all.col(a) = picture.reference.points.col(a);
  return all;
}

void draw_reference(Canvas& canvas, const View& view, const CorrectionPicture& picture, const Figure& figure) {
  const Marks marks(figure);
  const Points reference = view.pixels(picture.reference.points);
  for (const bool dense : {true, false})
    canvas.lines(trace(figure, dense, reference), {colour::kReference, marks.outline});
  canvas.dots(reference(Eigen::all, figure.marked), 0.8 * marks.dot, colour::kReference);
}

bool is_within(const Box& box, const Eigen::Vector2d& place) {
  return place.x() > box.left && place.x() < box.right() && place.y() > box.bottom && place.y() < box.top();
}

void draw_names(Canvas& canvas, const Box& window, const Points& pixels, const std::vector<int>& landmarks,
                const Landmarks& reference, double ring, const Colour& colour) {
  if (landmarks.size() > kMostNamesBeside) return;
  std::vector<Box> taken;
  for (const int a : landmarks) {
    if (!is_within(window, pixels.col(a))) continue;
    const std::string text =
        reference.labels.empty() ? std::to_string(reference.number(a)) : reference.labels[static_cast<std::size_t>(a)];
    const Box place =
        freest_place(pixels.col(a), text_width(text, kNameSize), kNameSize, 1.3 * ring, pixels, taken).box;
    taken.push_back(place);
    canvas.text_on_image(place.left, place.bottom + place.height / 2, text, kNameSize, colour);
  }
}

// Radius of the marks of landmarks that are concerned.
double concerned_dot(const Figure& figure) { return std::max(3.0, 1.25 * Marks(figure).dot); }

// The shape over the reference, its outlines through the landmarks that it has.
void draw_over(Canvas& canvas, const View& view, const CorrectionPicture& picture, const Points& points,
               const Figure& figure, const Colour& colour) {
  const Points pixels = view.pixels(points);
  Figure of_shape = without(figure, incomplete_points(points));
  of_shape.names.clear();
  draw_shape(canvas, pixels, of_shape, colour::kResult);
  const double dot = concerned_dot(figure);
  const std::vector<int> present = present_in(points, picture.concerned);
  draw_marks(canvas, pixels(Eigen::all, present), dot, {colour}, 1.5);
  draw_names(canvas, view.box, pixels, present, picture.reference, dot, colour);
}

void draw_arrows(Canvas& canvas, const View& view, const CorrectionPicture& picture, const Figure& figure) {
  constexpr std::size_t kMany = 12;
  const std::vector<int> moved =
      present_in(picture.shape, picture.concerned.empty() ? figure.with_path : picture.concerned);
  Points from = view.pixels(picture.shape)(Eigen::all, moved);
  Points to = view.pixels(destinations(picture))(Eigen::all, moved);
  const double edge = concerned_dot(figure) + 1.5;  // marks at both ends would hide the tips
  for (Eigen::Index i = 0; i < to.cols(); ++i) {
    const Eigen::Vector2d displacement = to.col(i) - from.col(i);
    const double length = displacement.norm();
    if (length < 3 * edge) continue;
    from.col(i) += edge / length * displacement;
    to.col(i) -= edge / length * displacement;
  }
  const bool are_many = moved.size() > kMany;
  canvas.arrows(from, to, {are_many ? faded(kWrong, 0.45) : kWrong, are_many ? 1.2 : 2.4});
}

void draw_wrong(Canvas& canvas, const View& view, const CorrectionPicture& picture, const Figure& figure) {
  canvas.look_through(view.box);
  draw_reference(canvas, view, picture, figure);
  if (picture.corrected.size() > 0 || !picture.concerned.empty()) draw_arrows(canvas, view, picture, figure);
  draw_over(canvas, view, picture, picture.shape, figure, kWrong);
  canvas.look_through({});
  draw_frame(canvas, view, "", {}, {});
  draw_heading(canvas, view.box, picture.shape_heading);
}

void draw_mended(Canvas& canvas, const View& view, const CorrectionPicture& picture, const Figure& figure) {
  canvas.look_through(view.box);
  draw_reference(canvas, view, picture, figure);
  draw_over(canvas, view, picture, picture.corrected, figure, kMended);
  canvas.look_through({});
  draw_frame(canvas, view, "", {}, {});
  draw_heading(canvas, view.box, picture.corrected_heading);
}

Canvas compose_correction(const CorrectionPicture& picture, bool narrow) {
  View view = view_of(picture);
  const bool has_two = picture.corrected.size() > 0;
  const double columns = has_two && !narrow ? 2 : 1, rows = has_two && narrow ? 2 : 1;
  const double whole = narrow ? kNarrowWidth : kLeastWidth;
  const double room = narrow ? whole - 2 * kEdge : (whole - 2 * kEdge - kGap) / 2;
  const double scale = std::min(room / view.x.span(), kTallestCorrection / view.y.span());
  const double width = scale * view.x.span(), height = scale * view.y.span();
  const double used = columns * width + (columns - 1) * kGap, left = (whole - used) / 2;
  Canvas canvas(whole, rows * (height + kHeading) + kEdge + kLegendRoom);
  const Figure figure = plan_figure(picture.reference, scale);
  view.box = {left, kLegendRoom + (rows - 1) * (height + kHeading), width, height};
  draw_wrong(canvas, view, picture, figure);
  if (has_two) {
    if (narrow)
      view.box.bottom -= height + kHeading;
    else
      view.box.left += width + kGap;
    draw_mended(canvas, view, picture, figure);
  }
  std::vector<LegendEntry> legend{dot_entry("what it is judged by", {colour::kReference}),
                                  dot_entry("its landmarks", {colour::kResult})};
  if (!picture.concerned.empty()) legend.push_back(dot_entry("that look wrong", {kWrong}));
  if (has_two) legend.push_back(arrow_entry("to where they belong", kWrong));
  if (has_two && !present_in(picture.corrected, picture.concerned).empty())
    legend.push_back(dot_entry("mended", {kMended}));
  draw_legend(canvas, legend);
  return canvas;
}

}  // namespace

std::string correction_svg(const CorrectionPicture& picture, bool narrow) {
  const Checks checks("picture of a correction");
  checks.shape(picture.reference, "the reference");
  if (picture.reference.dimension() < 2) checks.refuse("shapes on a line are not drawn");
  checks.points(picture.reference.points, picture.reference.dimension(), "the reference");
  checks.count(picture.shape, picture.reference, "the reference", "the shape");
  if (picture.corrected.size() > 0)
    checks.count(picture.corrected, picture.reference, "the reference", "its correction");
  return compose_correction(picture, narrow).svg();
}

}  // namespace pulson::draw
