#include "map_facts.hpp"

#include <cmath>
#include <limits>

#include "pulson/core/parallel.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/warp/material_flow.hpp"
#include "pulson/warp/sampled_map.hpp"
#include "statistics.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kMargin = 0.05;  // around the shape's box, of its size
constexpr double kPlaces = 1000;  // about so many

// A regular grid of places over the box of a shape.
Points places_over(const Points& shape) {
  const auto [low, high] = bounding_box(shape);
  const Index d = shape.rows();
  const auto side = static_cast<Index>(std::lround(std::pow(kPlaces, 1.0 / static_cast<double>(d))));
  Index total = 1;
  for (Index axis = 0; axis < d; ++axis) total *= side;
  Points places(d, total);
  for (Index i = 0; i < total; ++i) {
    Index rest = i;
    for (Index axis = 0; axis < d; ++axis, rest /= side) {
      const double part = (static_cast<double>(rest % side) + 0.5) / static_cast<double>(side);
      places(axis, i) = low[axis] + (high[axis] - low[axis]) * ((1 + 2 * kMargin) * part - kMargin);
    }
  }
  return places;
}

Estimate estimate(const VectorXd& values) { return {values.mean(), standard_error(values)}; }

}  // namespace

void measure_maps(const Cohort& cohort, const CompareOptions& options, ComparedModel& model) {
  const Points& source = cohort.source.points;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto count = std::ssize(model.fit.shapes);
  VectorXd inversions = VectorXd::Constant(count, nan);
  VectorXd flipped = VectorXd::Constant(count, nan);
  VectorXd folded = VectorXd::Constant(count, nan);
  const Points places = places_over(source);
  parallel_for(static_cast<int>(count), [&](int s) {
    const ShapeFit& shape = model.fit.shapes[static_cast<std::size_t>(s)];
    if (source.rows() == 1) inversions[s] = matching::order_inversions(source, shape.end);
    if (source.rows() == 2) flipped[s] = warp::flipped_triangles(source, shape.end);
    if (!options.maps) return;
    const matching::MatchingProblem problem = shape_problem(cohort, model.fit, options.settings, s);
    try {
      const warp::MaterialFlow flow(
          problem.system, problem.integrator->integrate(problem.system, {source, shape.momenta}, options.settings.grid,
                                                        shape.increments));
      folded[s] = flow.end_with_gradients(places).folded_fraction();
    } catch (const StepError&) {
      // the map of this shape is not known between its landmarks; so then is no mean
    }
  });
  model.order_inversions = estimate(inversions);
  model.flipped_triangles = estimate(flipped);
  model.folded_fraction = estimate(folded);
}

}  // namespace pulson::compare
