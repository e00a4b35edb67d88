#include "compared_model.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include <Eigen/Eigenvalues>
#include <fmt/core.h>

#include "cohort_model.hpp"
#include "fit.hpp"
#include "least_cost_paths.hpp"
#include "map_facts.hpp"
#include "pulson/core/errors.hpp"
#include "statistics.hpp"

namespace pulson::compare {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

KernelBasis kernel_basis(const KernelChoice& kernel, const Points& source) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(kernel.make(source).gram(source, source));
  return {solver.eigenvalues().reverse(), solver.eigenvectors().rowwise().reverse()};
}

std::pair<VectorXd, VectorXd> spectrum_of(const KernelBasis& basis, const Points& source, const MatrixXd& ends) {
  const Index n = source.cols();
  MatrixXd squares(n, ends.cols());
  for (Index s = 0; s < ends.cols(); ++s) {
    const Points displacement = ends.col(s).reshaped(source.rows(), n) - source;
    squares.col(s) =
        (displacement * basis.vectors).colwise().squaredNorm().transpose() / static_cast<double>(source.rows());
  }
  VectorXd errors(n);
  for (Index i = 0; i < n; ++i) errors[i] = standard_error(squares.row(i));
  return {squares.rowwise().mean(), errors};
}

namespace {

template <class Value>
Estimate mean_over(const CohortFit& fit, const Value& value) {
  VectorXd values(std::ssize(fit.shapes));
  for (Index s = 0; s < values.size(); ++s) values[s] = value(fit.shapes[static_cast<std::size_t>(s)]);
  return {values.mean(), standard_error(values)};
}

VectorXd noise_displacement(const CohortFit& fit, Index landmarks) {
  VectorXd squares = VectorXd::Zero(landmarks);
  int count = 0;
  for (const ShapeFit& shape : fit.shapes)
    if (shape.flow_end.size() > 0) {
      squares += (shape.end - shape.flow_end).colwise().squaredNorm().transpose();
      ++count;
    }
  return count > 0 ? VectorXd((squares / count).cwiseSqrt()) : VectorXd(squares);
}

void sum_up(ComparedModel& model, double sigma) {
  const CohortFit& fit = model.fit;
  model.energy = mean_over(fit, [](const ShapeFit& s) { return s.cost.energy; });
  model.action = mean_over(fit, [](const ShapeFit& s) { return s.cost.action; });
  model.total = mean_over(fit, [](const ShapeFit& s) { return s.cost.total(); });
  model.rms = mean_over(fit, [](const ShapeFit& s) { return s.rms; });
  model.matched = static_cast<int>(
      std::count_if(fit.shapes.begin(), fit.shapes.end(), [&](const ShapeFit& s) { return s.rms <= 3 * sigma; }));
  model.score = fit.score();
}

// With the kernel that was fitted to all shapes, and from those numbers.
Prediction cross_validated(const CohortShapes& shapes, const NoiseChoice& noise, const CompareOptions& options,
                           const CohortFit& of_all) {
  const auto count = static_cast<int>(shapes.targets.size());
  const int folds = std::min(options.folds, count);
  std::vector<ShapePrediction> predictions(shapes.targets.size());
  for (int fold = 0; fold < folds; ++fold) {
    std::vector<int> training;
    std::vector<int> held;
    for (int s = 0; s < count; ++s) (s % folds == fold ? held : training).push_back(s);
    const Cohort cohort = shapes.cohort(training);
    CohortSettings settings = options.settings;
    settings.importance_samples = 0;
    settings.kernel = of_all.kernel;
    settings.fit_width = false;
    const CohortFit fit =
        fit_again(CohortModel(cohort, make_open_noise(noise, cohort.source), settings), of_all, training);
    const MatrixXd samples = aligned_samples(cohort, shape_problem(cohort, fit, settings, 0), options.forward_samples,
                                             settings.seed + static_cast<std::uint64_t>(fold));
    if (samples.cols() < 2) throw NumericalError("it draws too few shapes that have a path; use more `grid.steps`");
    std::vector<Landmarks> targets;
    for (const int s : held) targets.push_back(shapes.targets[static_cast<std::size_t>(s)]);
    const std::vector<ShapePrediction> found = predict(make_cohort(cohort.source, targets, shapes.alignment), samples);
    for (std::size_t i = 0; i < held.size(); ++i) predictions[static_cast<std::size_t>(held[i])] = found[i];
  }
  return summary(std::move(predictions));
}

}  // namespace

ComparedModel compared_model(const Comparison& comparison, const CohortShapes& shapes, const KernelBasis& basis,
                             const NoiseChoice& noise, const CompareOptions& options, const CohortFit* none,
                             std::string& failure) {
  const auto start = std::chrono::steady_clock::now();
  const Points& source = comparison.cohort.source.points;
  ComparedModel model;
  model.noise = noise.spec();
  model.fit = fit_cohort(comparison.cohort, noise, options.settings, none);
  sum_up(model, model.fit.sigma);
  const MatrixXd samples =
      aligned_samples(comparison.cohort, shape_problem(comparison.cohort, model.fit, options.settings, 0),
                      options.forward_samples, options.settings.seed);
  model.lost_samples = options.forward_samples - static_cast<int>(samples.cols());
  model.spectrum = spectrum_of(basis, source, samples).first;
  model.noise_displacement = noise_displacement(model.fit, source.cols());
  measure_maps(comparison.cohort, options, model);
  if (options.maps) model.paths = least_cost_paths(comparison.cohort, model.fit, options.settings);
  if (options.folds > 1 && shapes.targets.size() > 1) try {
      model.prediction = cross_validated(shapes, noise, options, model.fit);
    } catch (const NumericalError& error) {
      failure = fmt::format("{}: no prediction: {}", model.noise, error.what());
    }
  model.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return model;
}

}  // namespace pulson::compare
