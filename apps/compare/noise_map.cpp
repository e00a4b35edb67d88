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

// What all panels show.
struct NoisePanels {
  std::vector<const compare::ComparedModel*> models;
  draw::View view;
  double factor;  // of displacements
  std::string length;
};

NoisePanels panels_of(const compare::Comparison& comparison) {
  const Points& source = comparison.cohort.source.points;
  NoisePanels panels{.models = moved_models(comparison), .view = {}, .factor = 1, .length = "true to scale"};
  double largest = 0;
  for (const compare::ComparedModel* model : panels.models)
    largest = std::max(largest, model->noise_displacement.maxCoeff());
  panels.factor = draw::round_factor(kLargestDisc * diameter(source) / largest);
  if (panels.factor != 1) panels.length = fmt::format("magnified {:g} times", panels.factor);
  draw::View& view = panels.view;
  view.x = draw::range_of({&source}, 0);
  view.y = draw::range_of({&source}, 1);
  view.y_down = comparison.cohort.source.frame.y_down;
  for (draw::Interval* range : {&view.x, &view.y})
    *range = range->with_span(range->span() + 2.4 * panels.factor * largest);
  const std::vector<draw::Interval> ranges = draw::with_margins({view.x, view.y}, 0.2);
  view.x = ranges[0];
  view.y = ranges[1];
  return panels;
}

draw::Canvas compose(const compare::Comparison& comparison, const NoisePanels& panels, bool narrow) {
  const Landmarks& source = comparison.cohort.source;
  const draw::Titles titles{"Where the noise moves the landmarks",
                            fmt::format("root mean square displacement by the noise over {}, as the radius of a disc",
                                        counted(comparison.cohort.targets.size(), "shape"))};
  draw::Plan plan =
      arrange(narrow ? draw::Titles() : titles, std::vector<draw::View>(panels.models.size(), panels.view),
              narrow ? draw::narrow_arrangement() : draw::Arrangement{.tallest = kTallestMap});
  const draw::Figure figure = draw::plan_figure(source, scale_of(plan.views.front()));
  for (std::size_t m = 0; m < panels.models.size(); ++m) {
    const draw::View& panel = plan.views[m];
    const Eigen::VectorXd& displacement = panels.models[m]->noise_displacement;
    draw_frame(plan.canvas, panel,
               fmt::format("{}, at most {:.3g}", shortened_spec(panels.models[m]->noise), displacement.maxCoeff()),
               m == 0 || narrow);
    const Points pixels = panel.pixels(source.points);
    std::vector<Points> discs;
    for (Eigen::Index a = 0; a < pixels.cols(); ++a)
      discs.push_back(
          circle(pixels(0, a), pixels(1, a), std::max(panels.factor * displacement[a] * scale_of(panel), 0.1)));
    plan.canvas.areas(discs, draw::faded(draw::colour::kMomentum, kTransparency));
    for (const bool dense : {true, false}) plan.canvas.lines(trace(figure, dense, pixels), kDiscOutline);
    plan.canvas.dots(pixels, kMark, draw::colour::kResult);
    draw_names(plan.canvas, pixels, figure, source);
  }
  draw_legend(plan.canvas, {draw::dot_entry("landmark of the source", {draw::colour::kResult}),
                            draw::dot_entry("displacement by the noise, " + panels.length,
                                            {draw::faded(draw::colour::kMomentum, kTransparency)})});
  return std::move(plan.canvas);
}

}  // namespace

bool has_noise_map(const compare::Comparison& comparison) {
  return comparison.cohort.source.dimension() == 2 && !moved_models(comparison).empty();
}

void write_noise_map(const compare::Comparison& comparison, const draw::PictureFiles& files) {
  const NoisePanels panels = panels_of(comparison);
  write_layouts(files, [&](bool narrow) { return compose(comparison, panels, narrow); });
}

}  // namespace pulson
