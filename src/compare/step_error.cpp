#include "step_error.hpp"

#include <algorithm>
#include <cmath>

#include "cohort_model.hpp"
#include "core/undefined.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "sampled.hpp"

namespace pulson::compare {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using posterior::LinearAt;
using posterior::Minimum;

// Of its change: of 12 ovals of large deformations it was −0.17 and 0.73 where that of 4000 samples was −0.08 and 0.38.
constexpr double kErrorOfLaplace = 0.5;

// A fit that noise did not improve is that of none.
bool is_without_noise(const CohortFit& fit) {
  return fit.noise_vanishes() && std::all_of(fit.shapes.begin(), fit.shapes.end(),
                                             [](const ShapeFit& shape) { return shape.increments.isZero(0); });
}

ShapeFit refined(const ShapeFit& shape, int doublings) {
  ShapeFit fine;
  fine.momenta = shape.momenta;
  if (shape.increments.isZero(0)) return fine;
  fine.increments = shape.increments;
  for (int i = 0; i < doublings; ++i) {
    const MatrixXd halves = fine.increments / 2;
    fine.increments.resize(halves.rows(), 2 * halves.cols());
    for (Index k = 0; k < halves.cols(); ++k) fine.increments.middleCols(2 * k, 2).colwise() = halves.col(k);
  }
  return fine;
}

Matches matches_of(const CohortModel& finer, const CohortFit& fit, int doublings) {
  std::vector<double> values;
  for (const ModelNumber& number : finer.open())
    values.push_back(std::find_if(fit.fitted.begin(), fit.fitted.end(), [&](const FittedNumber& fitted) {
                       return fitted.name == number.name;
                     })->value);
  std::vector<ShapeFit> starts;
  for (const ShapeFit& shape : fit.shapes) starts.push_back(refined(shape, doublings));
  std::vector<const ShapeFit*> near;
  for (const ShapeFit& start : starts) near.push_back(&start);
  return finer.match_from(finer.place(values), near, CohortModel::Effort::kExact);
}

// By draws with the same numbers, so that what they have in common cancels.
Estimate change_of_samples(const VectorXd& coarse, const VectorXd& fine) {
  const auto weights = [](const VectorXd& logs) -> ArrayXd {
    const ArrayXd of_sets = (logs.array() - logs.maxCoeff()).exp();
    return of_sets / of_sets.mean();
  };
  const ArrayXd influence = weights(fine) - weights(coarse);
  const auto count = static_cast<double>(influence.size());
  return {sum_of_log_means({fine}) - sum_of_log_means({coarse}),
          std::sqrt(influence.square().sum() / (count * std::max(count - 1, 1.0)))};
}

}  // namespace

StepChange change_of_finer_steps(const Cohort& cohort, const NoiseChoice& noise, CohortSettings settings,
                                 const CohortFit& fit, int doublings) {
  const SerialBlas serial;
  settings.grid.steps <<= doublings;
  settings.on_match = {};
  const auto shapes = fit.shapes.size();
  StepChange change{
      std::vector<double>(shapes, kUndefined), std::vector<double>(shapes, kUndefined), 0, {kUndefined, kUndefined}};
  std::vector<double> errors(shapes);
  try {
    const CohortModel finer(cohort, make_open_noise(is_without_noise(fit) ? "none" : noise, cohort.source), settings);
    const Matches matches = matches_of(finer, fit, doublings);
    parallel_for(static_cast<int>(shapes), [&](int s) {
      const ShapeFit& shape = fit.shapes[at(s)];
      const Minimum& match = matches.minima[at(s)];
      if (shape.converged && !match.converged) return;
      change.laplace[at(s)] = LinearAt(*match.linear, matches.model).laplace() - shape.laplace;
      change.shapes[at(s)] = change.laplace[at(s)];
      if (shape.log_sets.size() == 0 || !is_sampled(shape)) return;
      DrawStarts starts;
      const auto samples = static_cast<int>(kMostOfOneSet * shape.log_sets.size());
      const ImportanceEstimate sampled =
          sample_shape(finer, s, matches.model, *match.linear, samples, 0, starts, doublings);
      const Estimate found = change_of_samples(shape.log_sets, sampled.log_sets);
      const double error = kErrorOfLaplace * std::abs(change.laplace[at(s)]);
      errors[at(s)] = std::min(error, found.standard_error);
      if (found.standard_error < error) change.shapes[at(s)] = found.value;
    });
    change.of_own_mean = finer.of_own_mean(matches.x) - fit.of_own_mean;
  } catch (const NumericalError&) {
    return change;
  }
  change.total = {change.of_own_mean, 0};
  for (std::size_t s = 0; s < shapes; ++s) {
    change.total.value += change.shapes[s];
    change.total.standard_error = std::hypot(change.total.standard_error, errors[s]);
  }
  return change;
}

void correct_for_steps(const StepChange& change, const CohortSettings& settings, CohortFit& fit) {
  const double ratio = std::pow(2.0, make_integrator(settings.integrator)->traits().order);
  const double to_limit = ratio / (ratio - 1);
  fit.step_error = {to_limit * change.total.value, to_limit * change.total.standard_error};
  fit.log_evidence += fit.step_error.value;
  fit.of_own_mean += to_limit * change.of_own_mean;
  fit.laplace += to_limit * change.of_own_mean;
  for (std::size_t s = 0; s < fit.shapes.size(); ++s) {
    fit.shapes[s].log_evidence += to_limit * change.shapes[s];
    fit.shapes[s].laplace += to_limit * change.laplace[s];
    fit.laplace += to_limit * change.laplace[s];
  }
}

}  // namespace pulson::compare
