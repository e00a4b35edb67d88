#include "noise_map.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

#include "draw/layers.hpp"
#include "draw/layout.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "summary.hpp"

namespace pulson {
namespace {

constexpr double kLargestDisc = 0.1;  // radius, of the shape's diagonal, about
constexpr double kTransparency = 0.45;
constexpr double kMark = 3;  // radius, pixels: a landmark, smaller than its disc
const draw::Stroke kDiscOutline{draw::colour::kReference, 1.2};
constexpr double kTallestMap = 620;
constexpr std::size_t kMostPanels = 4;

bool is_moved(const compare::ComparedModel& model, double size) {
  return model.noise_displacement.size() > 0 && model.noise_displacement.maxCoeff() > 1e-6 * size;
}

// In the order given, at most so many.
std::vector<const compare::ComparedModel*> moved_models(const compare::Comparison& comparison) {
  const double size = diameter(comparison.cohort.source.points);
  std::vector<const compare::ComparedModel*> moved;
  for (const compare::ComparedModel& model : comparison.models)
    if (is_moved(model, size) && moved.size() < kMostPanels) moved.push_back(&model);
  return moved;
}

Points circle(double x, double y, double radius) {
  constexpr int kCorners = 48;
  const Eigen::RowVectorXd angle = Eigen::RowVectorXd::LinSpaced(kCorners + 1, 0, 2 * M_PI);
  Points corners(2, kCorners + 1);
  corners.row(0) = x + radius * angle.array().cos();
  corners.row(1) = y + radius * angle.array().sin();
  return corners;
}

}  // namespace

bool has_noise_map(const compare::Comparison& comparison) {
  return comparison.cohort.source.dimension() == 2 && !moved_models(comparison).empty();
}

void write_noise_map(const compare::Comparison& comparison, const draw::PictureFiles& files) {
  const Landmarks& source = comparison.cohort.source;
  const std::vector<const compare::ComparedModel*> models = moved_models(comparison);
  double largest = 0;
  for (const compare::ComparedModel* model : models) largest = std::max(largest, model->noise_displacement.maxCoeff());
  const double factor = draw::round_factor(kLargestDisc * diameter(source.points) / largest);
  const std::vector<const Points*> sets{&source.points};
  draw::View view{.box = {}, .x = draw::range_of(sets, 0), .y = draw::range_of(sets, 1), .y_down = source.frame.y_down};
  for (draw::Interval* range : {&view.x, &view.y}) *range = range->with_span(range->span() + 2.4 * factor * largest);
  const std::vector<draw::Interval> ranges = draw::with_margins({view.x, view.y}, 0.2);
  view.x = ranges[0];
  view.y = ranges[1];
  draw::Plan plan =
      arrange({"Where the noise moves the landmarks",
               fmt::format("root mean square displacement by the noise over {}, as the radius of a disc, {}",
                           counted(comparison.cohort.targets.size(), "shape"),
                           factor == 1 ? "true to scale" : fmt::format("magnified {:g} times", factor))},
              std::vector<draw::View>(models.size(), view), {.tallest = kTallestMap});
  const draw::Figure figure = draw::plan_figure(source, scale_of(plan.views.front()));
  for (std::size_t m = 0; m < models.size(); ++m) {
    const draw::View& panel = plan.views[m];
    draw_frame(
        plan.canvas, panel,
        fmt::format("{}, at most {:.3g}", shortened_spec(models[m]->noise), models[m]->noise_displacement.maxCoeff()),
        m == 0);
    const Points pixels = panel.pixels(source.points);
    std::vector<Points> discs;
    for (Eigen::Index a = 0; a < pixels.cols(); ++a)
      discs.push_back(circle(pixels(0, a), pixels(1, a),
                             std::max(factor * models[m]->noise_displacement[a] * scale_of(panel), 0.1)));
    plan.canvas.areas(discs, draw::faded(draw::colour::kMomentum, kTransparency));
    for (const bool dense : {true, false}) plan.canvas.lines(trace(figure, dense, pixels), kDiscOutline);
    plan.canvas.dots(pixels, kMark, draw::colour::kResult);
    draw_names(plan.canvas, pixels, figure, source);
  }
  draw_legend(plan.canvas,
              {draw::dot_entry("landmark of the source", {draw::colour::kResult}),
               draw::dot_entry("displacement by the noise", {draw::faded(draw::colour::kMomentum, kTransparency)})});
  plan.canvas.write(files);
}

}  // namespace pulson
