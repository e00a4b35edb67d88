// Could the fitted model have drawn these shapes?

#include "pulson/compare/predictive_checks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

#include "compare/forward_samples.hpp"
#include "compare/statistics.hpp"
#include "core/undefined.hpp"
#include "pulson/compare/comparison.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "random/normals.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLevel = 0.05 / 4;   // of each of four statistics
constexpr double kTail = 0.05;        // on either side of the central 90 %
constexpr double kLeastWeight = 0.1;  // of a landmark that counts, as for suspects
constexpr int kFewestShapes = 2000;   // drawn, of which cohorts are subsets
constexpr int kShapesPerShape = 10;   // the same for large cohorts: 10 for each shape
constexpr int kReference = 200;       // shapes that the energy score compares with

// Of one cohort.
struct Statistics {
  VectorXd variances;  // N
  double share = kUndefined, energy = kUndefined, distance = kUndefined;
};

VectorXd landmark_variances(const Cohort& cohort) {
  const auto d = static_cast<double>(cohort.source.dimension());
  VectorXd sum = VectorXd::Zero(cohort.source.count()), count = sum;
  for (const Landmarks& target : cohort.targets)
    for (Index a = 0; a < sum.size(); ++a)
      if (target.points.col(a).allFinite()) {
        sum[a] += (target.points.col(a) - cohort.source.points.col(a)).squaredNorm() / d;
        count[a] += 1;
      }
  return sum.cwiseQuotient(count);  // NaN of a landmark that no shape has
}

// Of the first eigenvalue of the covariance of the complete shapes.
double first_share(const Cohort& cohort) {
  std::vector<const Points*> complete;
  for (const Landmarks& target : cohort.targets)
    if (target.points.allFinite()) complete.push_back(&target.points);
  if (std::ssize(complete) < kFewestToJudge) return kUndefined;
  MatrixXd rows(std::ssize(complete), complete.front()->size());
  for (std::size_t i = 0; i < complete.size(); ++i)
    rows.row(static_cast<Index>(i)) = complete[i]->reshaped().transpose();
  rows.rowwise() -= rows.colwise().mean().eval();
  const MatrixXd gram =
      rows.rows() <= rows.cols() ? MatrixXd(rows * rows.transpose()) : MatrixXd(rows.transpose() * rows);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(gram, Eigen::EigenvaluesOnly);
  return solver.eigenvalues().maxCoeff() / gram.trace();
}

double largest_distance(const Cohort& cohort) {
  double largest = 0;
  for (std::size_t i = 1; i < cohort.targets.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      double square = 0;
      int count = 0;
      const Points &a = cohort.targets[i].points, &b = cohort.targets[j].points;
      for (Index k = 0; k < a.cols(); ++k)
        if (a.col(k).allFinite() && b.col(k).allFinite()) {
          square += (a.col(k) - b.col(k)).squaredNorm();
          ++count;
        }
      if (count > 0) largest = std::max(largest, std::sqrt(square / count));
    }
  return largest;
}

// @param drawn shapes of the model, dN×M, as they were drawn
Statistics statistics_of(const Cohort& cohort, const MatrixXd& drawn) {
  Statistics found{landmark_variances(cohort), first_share(cohort), kUndefined, largest_distance(cohort)};
  MatrixXd samples = drawn;
  const Points& source = cohort.source.points;
  if (cohort.alignment != AlignmentKind::kNone)
    for (auto sample : samples.colwise()) {
      const Points shape = sample.reshaped(source.rows(), source.cols());
      sample = align(shape, source, cohort.alignment).apply(shape).reshaped();
    }
  found.energy = 0;
  for (const ShapePrediction& shape : predict(cohort, samples))
    found.energy += shape.energy_score / static_cast<double>(cohort.targets.size());
  return found;
}

// As the data are: the same landmarks missing, those of little weight too.
Cohort like_the_data(const CohortShapes& shapes, const std::vector<Points>& points) {
  CohortShapes like = shapes;
  for (std::size_t s = 0; s < like.targets.size(); ++s) {
    Points& target = like.targets[s].points;
    for (Index a = 0; a < target.cols(); ++a) {
      const bool counts = target.col(a).allFinite() && (shapes.weights.empty() || shapes.weights[s][a] >= kLeastWeight);
      if (counts)
        target.col(a) = points[s].col(a);
      else
        target.col(a).setConstant(kUndefined);
    }
  }
  return like.cohort();
}

// `count` of 0 … size − 1 in random order, by a partial shuffle of uniform numbers from normal ones.
std::vector<int> chosen_of(int size, int count, std::uint64_t seed, std::uint64_t index) {
  const VectorXd normals = standard_normals(seed, index, count, 1);
  std::vector<int> order(static_cast<std::size_t>(size));
  std::iota(order.begin(), order.end(), 0);
  for (int i = 0; i < count; ++i) {
    const double uniform = 0.5 * std::erfc(-normals[i] / std::sqrt(2.0));
    const int other = std::min(i + static_cast<int>(uniform * (size - i)), size - 1);
    std::swap(order[static_cast<std::size_t>(i)], order[static_cast<std::size_t>(other)]);
  }
  order.resize(static_cast<std::size_t>(count));
  return order;
}

double quantile(const VectorXd& sorted, double part) {
  const double at = part * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<Index>(at);
  const Index above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

PredictiveCheck check(double observed, VectorXd drawn) {
  if (!std::isfinite(observed) || !drawn.allFinite()) return {observed, kUndefined, kUndefined, kUndefined};
  const double above = 1.0 + static_cast<double>((drawn.array() >= observed).count());
  const double below = 1.0 + static_cast<double>((drawn.array() <= observed).count());
  std::sort(drawn.begin(), drawn.end());
  return {observed, quantile(drawn, kTail), quantile(drawn, 1 - kTail),
          std::min(1.0, 2 * std::min(above, below) / (1.0 + static_cast<double>(drawn.size())))};
}

double variances_p(const VectorXd& observed, const std::vector<Statistics>& drawn) {
  Eigen::ArrayXXd logs(observed.size(), std::ssize(drawn));
  for (Index k = 0; k < logs.cols(); ++k) logs.col(k) = drawn[static_cast<std::size_t>(k)].variances.array().log();
  const Eigen::ArrayXd mean = logs.rowwise().mean();
  const Eigen::ArrayXd variance = (logs.colwise() - mean).square().rowwise().mean();
  const auto deviation = [&](const Eigen::ArrayXd& of) {
    double sum = 0;
    for (Index a = 0; a < of.size(); ++a)
      if (std::isfinite(of[a]) && variance[a] > 0) sum += (of[a] - mean[a]) * (of[a] - mean[a]) / variance[a];
    return sum;
  };
  const double here = deviation(observed.array().log());
  int as_large = 0;
  for (Index k = 0; k < logs.cols(); ++k)
    if (deviation(logs.col(k)) >= here) ++as_large;
  return (1.0 + as_large) / (1.0 + static_cast<double>(logs.cols()));
}

template <class Value>
VectorXd values_of(const std::vector<Statistics>& all, const Value& value) {
  VectorXd values(std::ssize(all));
  for (std::size_t i = 0; i < all.size(); ++i) values[static_cast<Index>(i)] = value(all[i]);
  return values;
}

}  // namespace

PredictiveChecks check_predictions(const CohortShapes& shapes, const Cohort& cohort, const CohortFit& fit,
                                   const CohortSettings& settings, int cohorts) {
  const SerialBlas serial;
  const auto count = static_cast<int>(cohort.targets.size());
  const int size = std::max(kFewestShapes, kShapesPerShape * count);
  const MatrixXd drawn = draw_shapes(shape_problem(cohort, fit, settings, 0), size + kReference, settings.seed).ends;
  const auto pool = static_cast<int>(drawn.cols()) - kReference;
  if (pool < 2 * count) throw NumericalError("the model draws too few shapes that have a path; use more `grid.steps`");
  const MatrixXd reference = drawn.rightCols(kReference);
  const Points& source = cohort.source.points;
  std::vector<Points> observed_points;
  for (const Landmarks& target : shapes.targets) observed_points.push_back(target.points);
  const Statistics observed = statistics_of(like_the_data(shapes, observed_points), reference);
  std::vector<Statistics> all(static_cast<std::size_t>(cohorts));
  parallel_for(cohorts, [&](int k) {
    std::vector<Points> points;
    for (const int i : chosen_of(pool, count, settings.seed, static_cast<std::uint64_t>(k)))
      points.emplace_back(drawn.col(i).reshaped(source.rows(), source.cols()));
    all[static_cast<std::size_t>(k)] = statistics_of(like_the_data(shapes, points), reference);
  });
  PredictiveChecks found;
  found.cohorts = cohorts;
  for (Index a = 0; a < source.cols(); ++a)
    found.variances.push_back(
        check(observed.variances[a], values_of(all, [a](const Statistics& s) { return s.variances[a]; })));
  found.outside =
      static_cast<int>(std::count_if(found.variances.begin(), found.variances.end(),
                                     [](const PredictiveCheck& landmark) { return landmark.is_outside(); }));
  found.variances_p = variances_p(observed.variances, all);
  found.share = check(observed.share, values_of(all, [](const Statistics& s) { return s.share; }));
  found.energy = check(observed.energy, values_of(all, [](const Statistics& s) { return s.energy; }));
  found.distance = check(observed.distance, values_of(all, [](const Statistics& s) { return s.distance; }));
  return found;
}

std::vector<std::string> PredictiveChecks::unexplained() const {
  std::vector<std::string> found;
  if (variances_p <= kLevel && outside > 0)
    found.push_back(fmt::format("the variances of {} of {} landmarks", outside, variances.size()));
  if (share.p_value <= kLevel)
    found.push_back(fmt::format("the share of the first mode ({:.0f} %, {:.0f} to {:.0f} % by the model)",
                                100 * share.observed, 100 * share.low, 100 * share.high));
  if (energy.p_value <= kLevel)
    found.push_back(fmt::format("the mean energy score ({:.3g}, {:.3g} to {:.3g} by the model)", energy.observed,
                                energy.low, energy.high));
  if (distance.p_value <= kLevel)
    found.push_back(fmt::format("the {} distance between two shapes ({:.3g}, {:.3g} to {:.3g} by the model)",
                                distance.observed > distance.high ? "large" : "small", distance.observed, distance.low,
                                distance.high));
  return found;
}

}  // namespace pulson::compare
