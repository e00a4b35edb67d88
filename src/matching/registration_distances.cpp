// Distances of a registration's landmarks from their targets.

#include <algorithm>
#include <cmath>
#include <limits>

#include "pulson/matching/data_term.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::matching {
namespace {

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

bool Registration::matched() const {
  const double before = initial_rms(), after = rms();
  return std::isfinite(before) && after <= std::max(3 * sigma, before / 20);
}

}  // namespace pulson::matching
