// Distances of a registration's landmarks from their targets.

#include <algorithm>
#include <cmath>
#include <limits>

#include "pulson/matching/data_term.hpp"
#include "pulson/matching/landmark_predictions.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::matching {
namespace {

constexpr double kMatchedRms = 3;    // σ
constexpr double kMatchedPart = 20;  // a match leaves this fraction of the distance

// From each point to the nearest one on an edge.
Eigen::VectorXd distances_to_curve(const Points& q, const Curve& curve) {
  Eigen::VectorXd nearest = Eigen::VectorXd::Constant(q.cols(), std::numeric_limits<double>::infinity());
  for (const auto& [a, b] : curve.edges) {
    const Eigen::VectorXd start = curve.points.col(a);
    const Eigen::VectorXd edge = curve.points.col(b) - start;
    const double squared = edge.squaredNorm();
    for (Eigen::Index i = 0; i < q.cols(); ++i) {
      const double along = squared > 0 ? std::clamp((q.col(i) - start).dot(edge) / squared, 0.0, 1.0) : 0;
      nearest[i] = std::min(nearest[i], (q.col(i) - start - along * edge).norm());
    }
  }
  return nearest;
}

Eigen::VectorXd distances_in(const Registration& registration, const Points& q) {
  if (registration.data.kind == DataKind::kLandmarks) return distances(q, registration.target.points);
  return distances_to_curve(q, make_curve(registration.target, registration.data.ends));
}

// By the weights of a loss.
double root_mean_square(const Registration& registration, const Eigen::VectorXd& distances) {
  const auto observed = (!distances.array().isNaN()).cast<double>();
  const Eigen::ArrayXd weights =
      registration.robust ? Eigen::ArrayXd(observed * registration.robust->weights.array()) : Eigen::ArrayXd(observed);
  const Eigen::ArrayXd squares = distances.array().isNaN().select(0, distances).array().square();
  return std::sqrt((weights * squares).sum() / weights.sum());
}

// The σ that a match is held to: a user's may be finer than the shapes need.
double match_scale(const Registration& registration) {
  return std::max(registration.sigma, registration.initial_rms() / (kMatchedRms * kMatchedPart));
}

}  // namespace

Eigen::VectorXd Registration::distances() const { return distances_in(*this, result); }

double Registration::rms() const {
  Eigen::VectorXd all = distances();
  if (spread.size() > 0) {
    const Eigen::VectorXd squares = spread.colwise().squaredNorm();
    all = (all.array().square() + squares.array()).sqrt();
  }
  return root_mean_square(*this, all);
}

double Registration::initial_rms() const { return root_mean_square(*this, distances_in(*this, source.points)); }

double Registration::original_rms() const { return root_mean_square(*this, distances_in(*this, original.points)); }

double Registration::max_residual() const {
  const Eigen::VectorXd all = distances();
  return all.array().isNaN().select(0, all).maxCoeff();
}

Eigen::VectorXd Registration::residuals_over_sigma() const {
  Eigen::VectorXd parts = distances() / sigma;
  if (data.kind != DataKind::kLandmarks || (data.weights.size() == 0 && data.covariances.empty())) return parts;
  const LandmarkTerm term({target.points, sigma, data.weights, data.covariances});
  const Points misfit = result - term.target();
  for (Eigen::Index a = 0; a < parts.size(); ++a)
    if (std::isfinite(parts[a])) parts[a] = std::sqrt(misfit.col(a).dot(term.precision(a) * misfit.col(a)));
  return parts;
}

std::vector<int> Registration::unmatched_landmarks() const {
  if (data.kind != DataKind::kLandmarks) return {};
  const Eigen::VectorXd parts = residuals_over_sigma();
  const Eigen::Index observed = (!parts.array().isNaN()).count();
  const double most = largest_of_chi(source.dimension(), observed) * match_scale(*this) / sigma;
  std::vector<int> unmatched;
  for (Eigen::Index a = 0; a < parts.size(); ++a)
    if (parts[a] > most) unmatched.push_back(static_cast<int>(a));
  return unmatched;
}

bool Registration::matched() const {
  return std::isfinite(initial_rms()) && rms() <= kMatchedRms * match_scale(*this) && unmatched_landmarks().empty();
}

}  // namespace pulson::matching
