#include <algorithm>
#include <cmath>
#include <limits>

#include "compare/forward_samples.hpp"
#include "core/text.hpp"
#include "pulson/compare/comparison.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "statistics.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kCentralPart = 0.9;

std::vector<Index> known(const VectorXd& outcome) {
  std::vector<Index> places;
  for (Index i = 0; i < outcome.size(); ++i)
    if (!std::isnan(outcome[i])) places.push_back(i);
  return places;
}

double quantile(const std::vector<double>& sorted, double part) {
  const double at = part * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

// (1/(2M(M−1))) Σ_ij |X_i − X_j|
double half_mean_distance(const MatrixXd& x) {
  const auto count = static_cast<double>(x.cols());
  double sum = 0;
  for (Index i = 1; i < x.cols(); ++i) sum += (x.leftCols(i).colwise() - x.col(i)).colwise().norm().sum();
  return sum / (count * (count - 1));
}

double mean_distance(const MatrixXd& x, const VectorXd& from) {
  return (x.colwise() - from).colwise().norm().sum() / static_cast<double>(x.cols());
}

}  // namespace

double energy_score(const MatrixXd& samples, const VectorXd& outcome) {
  require_size("the samples of an outcome", samples, outcome.size(), samples.cols());
  if (samples.cols() < 2) throw InputError("the energy score needs at least two samples");
  const std::vector<Index> places = known(outcome);
  const MatrixXd x = samples(places, Eigen::all);
  return mean_distance(x, outcome(places)) - half_mean_distance(x);
}

double coverage(const MatrixXd& samples, const VectorXd& outcome, double part) {
  require_size("the samples of an outcome", samples, outcome.size(), samples.cols());
  const std::vector<Index> places = known(outcome);
  int within = 0;
  for (const Index i : places) {
    const VectorXd row = samples.row(i);
    std::vector<double> sorted(row.begin(), row.end());
    std::sort(sorted.begin(), sorted.end());
    if (outcome[i] >= quantile(sorted, (1 - part) / 2) && outcome[i] <= quantile(sorted, (1 + part) / 2)) ++within;
  }
  return within / static_cast<double>(places.size());
}

MatrixXd aligned_samples(const Cohort& cohort, const matching::MatchingProblem& model, int count, std::uint64_t seed) {
  MatrixXd samples = draw_shapes(model, count, seed).ends;
  if (cohort.alignment == AlignmentKind::kNone) return samples;
  const Points& source = cohort.source.points;
  parallel_for(static_cast<int>(samples.cols()), [&](int s) {
    const Points drawn = samples.col(s).reshaped(source.rows(), source.cols());
    samples.col(s) = align(drawn, source, cohort.alignment).apply(drawn).reshaped();
  });
  return samples;
}

std::vector<ShapePrediction> predict(const Cohort& held, const MatrixXd& samples) {
  std::vector<ShapePrediction> shapes(held.targets.size());
  if (samples.cols() < 2) throw InputError("the energy score needs at least two samples");
  const double between = half_mean_distance(samples);  // of all complete shapes
  parallel_for(static_cast<int>(shapes.size()), [&](int s) {
    const auto place = static_cast<std::size_t>(s);
    const VectorXd outcome = held.targets[place].points.reshaped();
    const auto landmarks = static_cast<double>(known(outcome).size()) / held.source.dimension();
    const double score =
        outcome.allFinite() ? mean_distance(samples, outcome) - between : energy_score(samples, outcome);
    shapes[place] = {score / std::sqrt(landmarks), coverage(samples, outcome, kCentralPart)};
  });
  return shapes;
}

Prediction summary(std::vector<ShapePrediction> shapes) {
  VectorXd scores(std::ssize(shapes));
  VectorXd covered(std::ssize(shapes));
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    scores[static_cast<Index>(s)] = shapes[s].energy_score;
    covered[static_cast<Index>(s)] = shapes[s].coverage;
  }
  return {scores.mean(), standard_error(scores), covered.mean(), standard_error(covered), std::move(shapes)};
}

}  // namespace pulson::compare
