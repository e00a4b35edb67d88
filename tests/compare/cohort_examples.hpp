#pragma once

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "compare/forward_samples.hpp"
#include "pulson/compare/cohort_fit.hpp"

namespace pulson::compare {

inline Landmarks named_shape(Points points, std::string source = "a.csv") {
  Landmarks shape;
  shape.points = std::move(points);
  shape.source = std::move(source);
  return shape;
}

/// An oval of diameter 2.
inline Landmarks oval(int count) {
  Points points(2, count);
  for (int a = 0; a < count; ++a) {
    const double angle = 2 * std::numbers::pi * a / count;
    points.col(a) << std::cos(angle), 0.6 * std::sin(angle);
  }
  return named_shape(points, "oval.csv");
}

inline CohortSettings cohort_settings() {
  CohortSettings settings;
  settings.kernel = "gaussian:alpha=0.5";
  settings.sigma = 0.01;
  settings.grid = {1, 5};
  settings.importance_samples = 0;
  return settings;
}

/// The problem of a complete model, of which shapes are drawn.
inline matching::MatchingProblem model_problem(const Landmarks& source, const std::string& noise, double lambda,
                                               const CohortSettings& settings) {
  CohortFit fit;
  fit.kernel = settings.kernel.spec();
  fit.noise = noise;
  fit.lambda = lambda;
  return shape_problem({source, {source}}, fit, settings, 0);
}

inline std::vector<Landmarks> drawn_shapes(const Landmarks& source, const std::string& noise, double lambda,
                                           const CohortSettings& settings, int count, std::uint64_t seed) {
  const ForwardSamples drawn = draw_shapes(model_problem(source, noise, lambda, settings), count, seed);
  std::vector<Landmarks> shapes;
  for (const auto& end : drawn.ends.colwise())
    shapes.push_back(named_shape(end.reshaped(source.points.rows(), source.points.cols())));
  return shapes;
}

inline Cohort drawn_cohort(const Landmarks& source, const std::string& noise, double lambda,
                           const CohortSettings& settings, int count, std::uint64_t seed) {
  return {source, drawn_shapes(source, noise, lambda, settings, count, seed)};
}

/// A number that was fitted.
inline FittedNumber fitted_number(const CohortFit& fit, const std::string& name) {
  for (const FittedNumber& number : fit.fitted)
    if (number.name == name) return number;
  return {"nothing is named " + name};
}

}  // namespace pulson::compare
