#include "pulson/cohort/prediction.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "core/factorisations.hpp"
#include "inference/log_maximum.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kRounds = 30;
constexpr std::size_t kParts = 10;  // in which specimens are left out by turns
constexpr double kCentral = 0.9;    // of a coordinate, within the band

std::vector<Index> coordinates_of(const Points& points, bool observed) {
  std::vector<Index> chosen;
  for (Index a = 0; a < points.cols(); ++a)
    for (Index axis = 0; axis < points.rows(); ++axis)
      if (points.col(a).allFinite() == observed) chosen.push_back(a * points.rows() + axis);
  return chosen;
}

// log Γ_m(x), but for a constant
double log_gamma(Index m, double x) {
  double sum = 0;
  for (Index j = 0; j < m; ++j) sum += std::lgamma(x - 0.5 * static_cast<double>(j));
  return sum;
}

// The weight δ and scale s of the prior with the greatest marginal likelihood of a scatter with n degrees of freedom,
// whose eigenvalues in the metric V⁻¹ are `scatter`.
struct PriorFit {
  double weight, scale;

  PriorFit(double given_weight, double given_scale) : weight(given_weight), scale(given_scale) {}

  PriorFit(const VectorXd& scatter, double n) {
    const Index m = scatter.size();
    const auto log_marginal = [&](double log_weight, double log_scale) {
      const double delta = std::exp(log_weight), nu = delta + static_cast<double>(m) + 1;
      const auto dimension = static_cast<double>(m);
      return 0.5 * nu * dimension * log_weight - 0.5 * n * dimension * log_scale -
             0.5 * (nu + n) * (delta + scatter.array() * std::exp(-log_scale)).log().sum() +
             log_gamma(m, (nu + n) / 2) - log_gamma(m, nu / 2);
    };
    const double log_scale = std::log(std::max(scatter.sum() / (n * static_cast<double>(m)), 1e-300));
    double log_weight = 0, best = -std::numeric_limits<double>::infinity();
    constexpr double kLeast = -3, kMost = 14;  // from a twentieth of a specimen to a million
    for (double at = kLeast; at <= kMost; at += 1)
      if (const double here = log_marginal(at, log_scale); here > best) log_weight = at, best = here;
    inference::LogSearch search = inference::log_search(2, 1.5, 1e-3, 100);
    search.with_deviations = false;
    const inference::LogMaximum found = maximise_over_logs(
        [&](const VectorXd& x) { return log_marginal(log_weight + x[0], log_scale + x[1]); }, search);
    weight = std::exp(log_weight + found.x[0]);
    scale = std::exp(log_scale + found.x[1]);
  }
};

// d×N displacements along one axis after the other, for each axis: (matrix ⊗ I).
MatrixXd for_each_axis(const MatrixXd& matrix, Index d) {
  MatrixXd all = MatrixXd::Zero(d * matrix.rows(), d * matrix.cols());
  for (Index b = 0; b < matrix.cols(); ++b)
    for (Index a = 0; a < matrix.rows(); ++a) all.block(a * d, b * d, d, d).diagonal().setConstant(matrix(a, b));
  return all;
}

// An orthonormal basis of what is orthogonal to the columns.
MatrixXd complement(const MatrixXd& columns) {
  if (columns.cols() == 0) return MatrixXd::Identity(columns.rows(), columns.rows());
  const Eigen::HouseholderQR<MatrixXd> factors(columns);
  return MatrixXd(factors.householderQ()).rightCols(columns.rows() - columns.cols());
}

}  // namespace

// Of the missing coordinates given the others: mean and scale matrix of Student's distribution.
struct ShapePredictor::Conditional {
  std::vector<Index> missing;
  VectorXd mean;  // displacements
  MatrixXd scale;
  double degrees;
  MatrixXd covariance_given_model;  // of a normal distribution with the covariance Σ
};

ShapePredictor::Conditional ShapePredictor::condition(const Points& aligned) const {
  const std::vector<Index> seen = coordinates_of(aligned, true), missing = coordinates_of(aligned, false);
  // With some variance along Z the matrix is regular; as Z has a flat prior anyway, any will do.
  const double along = covariance_.trace() / static_cast<double>(covariance_.rows());
  const MatrixXd all = covariance_ + along * directions_ * directions_.transpose();
  const VectorXd displacement = (aligned - mean_).reshaped()(seen);
  const Eigen::LLT<MatrixXd> factors(all(seen, seen));
  const MatrixXd z = directions_(seen, Eigen::all), vz = factors.solve(z);
  const Eigen::LDLT<MatrixXd> normal(z.transpose() * vz);
  const VectorXd moved = z.cols() > 0 ? VectorXd(normal.solve(vz.transpose() * displacement)) : VectorXd(0);
  const VectorXd rest = displacement - z * moved;
  const MatrixXd weights = factors.solve(all(seen, missing));
  Conditional found{missing, directions_(missing, Eigen::all) * moved + weights.transpose() * rest, {}, 0, {}};
  MatrixXd covariance = all(missing, missing) - all(missing, seen) * weights;
  if (z.cols() > 0) {
    const MatrixXd left = directions_(missing, Eigen::all) - weights.transpose() * z;
    covariance += left * normal.solve(left.transpose());
  }
  found.covariance_given_model = covariance;
  // Student's: the scale of the joint distribution, and by how much this shape is more or less unusual than most.
  const double joint = (degrees_ > 2 ? (degrees_ - 2) / degrees_ : 1) * (1 + 1 / specimens_);
  const double unusual = rest.dot(factors.solve(rest)) / joint;
  const auto count = static_cast<double>(std::ssize(seen) - z.cols());
  found.degrees = degrees_ + count;
  found.scale = covariance * joint * (degrees_ + unusual) / found.degrees;
  return found;
}

void ShapePredictor::update(const MatrixXd& prior, const std::vector<Points>& complete, const MatrixXd& uncertain) {
  const auto n = static_cast<double>(complete.size());
  mean_ = Points::Zero(mean_.rows(), mean_.cols());
  for (const Points& shape : complete) mean_ += shape / n;
  std::vector<Index> all(static_cast<std::size_t>(mean_.size()));
  std::iota(all.begin(), all.end(), 0);
  directions_ = motion_directions(mean_, alignment_, all);
  const MatrixXd basis = complement(directions_);
  MatrixXd displacements(mean_.size(), static_cast<Index>(complete.size()));
  for (std::size_t i = 0; i < complete.size(); ++i)
    displacements.col(static_cast<Index>(i)) = (complete[i] - mean_).reshaped();
  const MatrixXd free = basis.transpose() * displacements;
  const MatrixXd scatter = free * free.transpose() + basis.transpose() * uncertain * basis;
  const MatrixXd v = basis.transpose() * prior * basis;
  const Eigen::LLT<MatrixXd> factors(v);
  const MatrixXd half = factors.matrixL().solve(scatter);
  const MatrixXd whitened = factors.matrixL().solve(half.transpose());
  const VectorXd values = Eigen::SelfAdjointEigenSolver<MatrixXd>(whitened, Eigen::EigenvaluesOnly).eigenvalues();
  // One shape alone has no scatter: the prior is that of the atlas, which as many coordinates determined as one
  // displacement from its mean has.
  const PriorFit fit = n > 1 ? PriorFit(values.cwiseMax(0), n - 1) : PriorFit{static_cast<double>(basis.cols()), 1};
  prior_weight_ = fit.weight;
  prior_scale_ = fit.scale;
  specimens_ = n;
  degrees_ = fit.weight + n + 1;  // ν + (n − 1) − m + 1 with ν = δ + m + 1
  covariance_ = basis * (fit.weight * fit.scale * v + scatter) * basis.transpose() / (fit.weight + n - 1);
}

void ShapePredictor::fit(const Atlas& atlas, const std::vector<Points>& aligned) {
  const SerialBlas serial;
  alignment_ = atlas.alignment;
  mean_ = atlas.mean.points;
  const Index d = mean_.rows();
  MatrixXd gram = atlas.kernel.gram(mean_, mean_) / atlas.lambda;
  gram.diagonal().array() += std::max(atlas.sigma * atlas.sigma, 1e-12 * gram(0, 0));
  const MatrixXd prior = for_each_axis(gram, d);
  std::vector<Points> complete = aligned;
  bool has_missing = false;
  for (Points& shape : complete)
    for (Index a = 0; a < shape.cols(); ++a)
      if (!shape.col(a).allFinite()) shape.col(a) = mean_.col(a), has_missing = true;
  MatrixXd uncertain = MatrixXd::Zero(d * mean_.cols(), d * mean_.cols());
  update(prior, complete, uncertain);
  for (int round = 0; has_missing && round < kRounds; ++round) {
    uncertain.setZero();
    for (std::size_t i = 0; i < aligned.size(); ++i) {
      if (aligned[i].allFinite()) continue;
      const Conditional found = condition(aligned[i]);
      complete[i].reshaped()(found.missing) = mean_.reshaped()(found.missing) + found.mean;
      uncertain(found.missing, found.missing) += found.covariance_given_model;
      if (alignment_ != AlignmentKind::kNone) complete[i] = align(complete[i], mean_, alignment_).apply(complete[i]);
    }
    update(prior, complete, uncertain);
  }
}

ShapePredictor::ShapePredictor(const Atlas& atlas) {
  std::vector<Points> aligned;
  for (const AtlasSpecimen& specimen : atlas.specimens) aligned.push_back(specimen.shape.points);
  fit(atlas, aligned);
}

ShapePredictor::ShapePredictor(const Atlas& atlas, const std::vector<Points>& aligned) { fit(atlas, aligned); }

PredictedLandmarks ShapePredictor::predict(const Landmarks& shape) const {
  Landmarks mean;
  mean.points = mean_;
  mean.source = "the atlas";
  require_alike(mean, shape);
  PredictedLandmarks predicted;
  Points points = shape.points;
  predicted.landmarks = incomplete_points(points);
  for (const int a : predicted.landmarks) points.col(a).setConstant(std::nan(""));
  const Index d = points.rows(), left = points.cols() - std::ssize(predicted.landmarks);
  if (d * left <= directions_.cols())
    throw InputError(
        fmt::format("{}: {} landmarks are not missing; the alignment alone needs more", shape.source, left));
  Alignment map{AlignmentKind::kNone, 1, MatrixXd::Identity(d, d), VectorXd::Zero(d)};
  if (alignment_ != AlignmentKind::kNone) map = align(points, mean_, alignment_);
  const Conditional found = condition(map.apply(points));
  const double quantile = student_quantile(0.5 * (1 + kCentral), found.degrees);
  predicted.positions.resize(d, std::ssize(predicted.landmarks));
  predicted.half_widths.resize(d, std::ssize(predicted.landmarks));
  for (Index k = 0; k < predicted.positions.cols(); ++k) {
    const VectorXd place = mean_.col(predicted.landmarks[static_cast<std::size_t>(k)]) + found.mean.segment(k * d, d);
    predicted.positions.col(k) = map.linear.transpose() * (place - map.translation) / map.scale;
    const MatrixXd scale = map.linear.transpose() * found.scale.block(k * d, k * d, d, d) * map.linear;
    predicted.half_widths.col(k) = quantile / map.scale * scale.diagonal().cwiseMax(0).cwiseSqrt();
  }
  return predicted;
}

std::vector<PredictedLandmarks> predict_missing(const Atlas& atlas, const std::vector<Landmarks>& shapes) {
  const SerialBlas serial;
  std::vector<std::size_t> incomplete;
  for (std::size_t i = 0; i < shapes.size(); ++i)
    if (!incomplete_points(shapes[i].points).empty()) incomplete.push_back(i);
  std::vector<PredictedLandmarks> predicted(shapes.size());
  const std::size_t parts = std::min(kParts, incomplete.size());
  parallel_for(static_cast<int>(parts), [&](int part) {
    std::vector<bool> left_out(shapes.size());
    for (auto k = static_cast<std::size_t>(part); k < incomplete.size(); k += parts) left_out[incomplete[k]] = true;
    std::vector<Points> others;
    for (std::size_t i = 0; i < shapes.size(); ++i)
      if (!left_out[i]) others.push_back(atlas.specimens[i].shape.points);
    const ShapePredictor predictor(atlas, others);
    for (std::size_t i = 0; i < shapes.size(); ++i)
      if (left_out[i]) predicted[i] = predictor.predict(shapes[i]);
  });
  return predicted;
}

}  // namespace pulson::cohort
