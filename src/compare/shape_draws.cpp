#include "shape_draws.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "matching/momentum_basis.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::compare {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMostIterations = 60, kMostNewton = 30;
constexpr double kLeastPart = 1.0 / 64;    // of a step of Newton's method
constexpr double kWider = 2;               // than Laplace's approximation, draws from elsewhere
constexpr double kNegligibleWeight = -14;  // nats, beside the evidence
constexpr double kFlat = 1e-9;             // of s, where (1 − (1 + s)^-½)/s is ½
constexpr double kExact = 1e-3;            // as kAccuracy, where it is asked to what root the iteration leads
constexpr double kSamePlace = 0.1;         // in white unknowns; roots that differ are farther apart
// Of ε + r(z) − v, in standard deviations of the data. What is missing varies with the draw, so that a draw has not
// quite the density it is weighed with. Where up to 1 was missing the evidence of 20 ovals was 0.1 nats too great,
// where up to 3, 0.6.
constexpr double kAccuracy = 1e-2;

}  // namespace

ShapeDraws::ShapeDraws(const matching::MatchingObjective& objective, const Observation& observation,
                       const Linearised& match)
    : objective_(objective),
      observation_(observation),
      match_(match),
      momentum_unknowns_(objective.basis().unknowns()) {
  MatrixXd covariance = MatrixXd::Identity(observation.count(), observation.count());
  covariance.selfadjointView<Eigen::Lower>().rankUpdate(match.jacobian);
  factors_.compute(covariance);
  half_log_determinant_ = factors_.matrixLLT().diagonal().array().log().sum();
  if (LaneShots::knows(objective)) shots_.emplace(objective, observation, match.jacobian);
}

VectorXd ShapeDraws::log_weights(const MatrixXd& normals, const std::vector<VectorXd*>& v) const {
  VectorXd weights = VectorXd::Constant(normals.cols(), -std::numeric_limits<double>::infinity());
  if (shots_) {
    for (Index first = 0; first < normals.cols(); first += LaneShots::lanes()) {
      const Index some = std::min<Index>(LaneShots::lanes(), normals.cols() - first);
      shoot_all(normals.middleCols(first, some), v.data() + first, weights.segment(first, some));
    }
    return weights;
  }
  for (Index l = 0; l < weights.size(); ++l)
    if (const auto weight = log_weight(normals.col(l), *v[static_cast<std::size_t>(l)])) weights[l] = *weight;
  return weights;
}

MatrixXd ShapeDraws::with_all_signs(const VectorXd& normals) const {
  MatrixXd columns(normals.size(), of_one_set());
  columns.leftCols(2) << normals, -normals;
  if (columns.cols() == 2) return columns;
  columns.rightCols(2) = columns.leftCols(2);
  columns.bottomRightCorner(controls(), 2) *= -1;
  return columns;
}

// Of the evidence, where there is a path.
// `v` is where the iteration begins and ends, if it has a size.
std::optional<double> ShapeDraws::log_weight(const VectorXd& normals, VectorXd& v) const {
  const std::optional<Place> end = fitted(normals.head(observation_.count()), white(normals), v, kAccuracy);
  if (!end) return std::nullopt;
  const std::optional<double> density = log_density(*end);
  if (!density) return std::nullopt;
  return log_joint(end->at.z, end->residual) - *density;
}

std::optional<double> ShapeDraws::log_weight_beyond(const VectorXd& normals, bool from_prior) const {
  const VectorXd white = normals.head(match_.jacobian.cols());
  const VectorXd z = from_prior ? white : VectorXd(match_.at.z + kWider * posterior_root(white));
  bool contracts = true;
  const std::optional<VectorXd> residual = residual_at(z, contracts);
  if (!residual) return std::nullopt;
  const VectorXd off = (z - match_.at.z) / kWider;
  const double of_prior = -0.5 * z.squaredNorm();
  const double of_laplace = -0.5 * (off.squaredNorm() + (match_.jacobian * off).squaredNorm()) + half_log_determinant_ -
                            static_cast<double>(z.size()) * std::log(kWider);
  const double larger = std::max(of_prior, of_laplace);
  const double density = larger + std::log(0.5 * (std::exp(of_prior - larger) + std::exp(of_laplace - larger)));
  const double weight = log_joint(z, *residual) - density;
  if (weight < match_.log_evidence + kNegligibleWeight) return std::nullopt;
  if (contracts && is_reached(z, *residual)) return std::nullopt;
  return weight;
}

// ζ of the normals of a draw.
VectorXd ShapeDraws::white(const VectorXd& normals) const {
  VectorXd zeta(match_.jacobian.cols());
  zeta << objective_.basis().in_directions(normals.segment(observation_.count(), objective_.problem().source.size())),
      normals.tail(controls());
  return zeta;
}

// As fitted() and log_density() in all lanes at once.
// @param begin of each column
void ShapeDraws::shoot_all(const MatrixXd& normals, VectorXd* const* begin, Eigen::Ref<VectorXd> weights) const {
  const MatrixXd& jacobian = match_.jacobian;
  const Index count = normals.cols();
  const MatrixXd epsilon = normals.topRows(observation_.count());
  MatrixXd zeta(jacobian.cols(), count), v(epsilon.rows(), count);
  for (Index l = 0; l < count; ++l) {
    zeta.col(l) = white(normals.col(l));
    const VectorXd& first = *begin[l];
    v.col(l) = first.size() > 0 ? first
                                : factors_.solve(VectorXd(epsilon.col(l) + match_.innovation - jacobian * zeta.col(l)));
  }
  std::vector<char> found(static_cast<std::size_t>(count), 0);
  MatrixXd nearest = v;  // of the places with a path
  VectorXd least = VectorXd::Constant(count, std::numeric_limits<double>::infinity());
  std::vector<char> moves(static_cast<std::size_t>(count), 1);
  MatrixXd z = match_.at.z.replicate(1, count), residual(v.rows(), count);
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    for (Index l = 0; l < count; ++l)
      if (moves[static_cast<std::size_t>(l)]) z.col(l) = zeta.col(l) + jacobian.transpose() * v.col(l);
    const LaneShots::Shots shots = shots_->shoot(z, LaneShots::With::kNothing);
    bool any = false;
    for (Index l = 0; l < count; ++l) {
      char& moving = moves[static_cast<std::size_t>(l)];
      if (!moving) continue;
      if (!shots.found[static_cast<std::size_t>(l)]) {
        moving = 0;
        z.col(l) = match_.at.z;
        continue;
      }
      residual.col(l) = observation_.target - observation_.projection * shots.ends.col(l);
      const VectorXd missing = epsilon.col(l) + residual.col(l) - v.col(l);
      if (missing.norm() < least[l]) {
        least[l] = missing.norm();
        nearest.col(l) = v.col(l);
      }
      found[static_cast<std::size_t>(l)] = missing.norm() <= kAccuracy ? 1 : 0;
      moving = found[static_cast<std::size_t>(l)] ? 0 : 1;
      if (moving) v.col(l) += factors_.solve(missing);
      any |= moving != 0;
    }
    if (!any) break;
  }
  if (std::find(found.begin(), found.end(), char{0}) != found.end())
    find_by_newton(epsilon, zeta, nearest, v, z, residual, found);
  const LaneShots::Shots shots = shots_->shoot(z, LaneShots::With::kSlopes);
  for (Index l = 0; l < count; ++l) {
    const bool is_found = found[static_cast<std::size_t>(l)] != 0;
    *begin[l] = is_found ? VectorXd(v.col(l)) : VectorXd();
    if (!is_found) continue;
    if (const auto density = log_density(z.col(l), residual.col(l), shots.slopes[static_cast<std::size_t>(l)]))
      weights[l] = log_joint(z.col(l), residual.col(l)) - *density;
  }
}

// Where steps with the slopes of the match lead nowhere: those of Newton's method, halved until they come nearer.
void ShapeDraws::find_by_newton(const MatrixXd& epsilon, const MatrixXd& zeta, const MatrixXd& nearest, MatrixXd& v,
                                MatrixXd& z, MatrixXd& residual, std::vector<char>& found) const {
  const Index count = v.cols();
  const MatrixXd& jacobian = match_.jacobian;
  MatrixXd here = nearest, step = MatrixXd::Zero(v.rows(), count);
  VectorXd error = VectorXd::Constant(count, std::numeric_limits<double>::infinity()), part = VectorXd::Ones(count);
  std::vector<char> moves(found.size());
  for (std::size_t l = 0; l < found.size(); ++l) moves[l] = found[l] ? 0 : 1;
  for (int iteration = 0; iteration < kMostNewton; ++iteration) {
    for (Index l = 0; l < count; ++l) {
      if (!moves[static_cast<std::size_t>(l)]) continue;
      v.col(l) = here.col(l) + part[l] * step.col(l);
      z.col(l) = zeta.col(l) + jacobian.transpose() * v.col(l);
    }
    const LaneShots::Shots shots = shots_->shoot(z, LaneShots::With::kSlopes);
    bool any = false;
    for (Index l = 0; l < count; ++l) {
      char& moving = moves[static_cast<std::size_t>(l)];
      if (!moving) continue;
      VectorXd missing;
      if (shots.found[static_cast<std::size_t>(l)]) {
        residual.col(l) = observation_.target - observation_.projection * shots.ends.col(l);
        missing = epsilon.col(l) + residual.col(l) - v.col(l);
      }
      if (missing.size() > 0 && missing.norm() < error[l]) {
        here.col(l) = v.col(l);
        error[l] = missing.norm();
        part[l] = 1;
        MatrixXd slope = shots.slopes[static_cast<std::size_t>(l)];
        slope.diagonal().array() += 1;
        step.col(l) = slope.partialPivLu().solve(missing);
        found[static_cast<std::size_t>(l)] = error[l] <= kAccuracy ? 1 : 0;
      } else {
        part[l] /= 2;
      }
      moving = found[static_cast<std::size_t>(l)] || part[l] < kLeastPart ? 0 : 1;
      if (!moving && !found[static_cast<std::size_t>(l)]) z.col(l) = match_.at.z;
      any |= moving != 0;
    }
    if (!any) break;
  }
  for (Index l = 0; l < count; ++l)
    if (!found[static_cast<std::size_t>(l)]) z.col(l) = match_.at.z;
}

// z = ζ + Jᵀv with v = ε + r(z).
std::optional<ShapeDraws::Place> ShapeDraws::fitted(const VectorXd& epsilon, const VectorXd& zeta, VectorXd& v,
                                                    double accuracy) const {
  const MatrixXd& jacobian = match_.jacobian;
  if (v.size() == 0) v = factors_.solve(VectorXd(epsilon + match_.innovation - jacobian * zeta));
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    const VectorXd z = zeta + jacobian.transpose() * v;
    auto at = objective_.evaluate(z);
    if (!at) break;
    VectorXd residual = observation_.residual(at->path().final().q);
    const VectorXd missing = epsilon + residual - v;
    if (missing.norm() <= accuracy) return Place{std::move(*at), std::move(residual)};
    v += factors_.solve(missing);
  }
  v.resize(0);
  return std::nullopt;
}

// Of the path from z, wherever there is one: a search among those whose steps contract does not come to the others.
std::optional<VectorXd> ShapeDraws::residual_at(const VectorXd& z, bool& contracts) const {
  const auto at = objective_.evaluate(z);
  contracts = at.has_value();
  if (at) return observation_.residual(at->path().final().q);
  const matching::MatchingProblem& problem = objective_.problem();
  try {
    return observation_.residual(
        problem.integrator
            ->integrate(problem.system, {problem.source, objective_.momenta(z)}, problem.grid, objective_.increments(z))
            .final()
            .q);
  } catch (const StepError&) {
    return std::nullopt;
  }
}

// Whether the iteration of the draw of this η ends there: it depends on ζ and ε by η = ζ + Jᵀε alone.
bool ShapeDraws::is_reached(const VectorXd& z, const VectorXd& residual) const {
  const VectorXd eta = z - match_.jacobian.transpose() * residual;
  VectorXd v;
  const auto end = fitted(VectorXd::Zero(observation_.count()), eta, v, kExact);
  return end && (end->at.z - z).norm() <= kSamePlace;
}

// (I + JᵀJ)^-½ x
// x − Σ_k (1 − (1 + s_k)^-½) u_k u_kᵀx, u_k = Jᵀw_k/√s_k, with s_k, w_k eigenvalues and vectors of JJᵀ.
VectorXd ShapeDraws::posterior_root(const VectorXd& white) const {
  VectorXd along = axes_->eigenvectors().transpose() * (match_.jacobian * white);
  for (Index k = 0; k < along.size(); ++k) {
    const double s = axes_->eigenvalues()[k];
    along[k] *= s > kFlat ? (1 - 1 / std::sqrt(1 + s)) / s : 0.5;
  }
  return white - match_.jacobian.transpose() * (axes_->eigenvectors() * along);
}

// Up to (2π)^-½ for each unknown, which densities leave out too.
double ShapeDraws::log_joint(const VectorXd& z, const VectorXd& residual) const {
  return -0.5 * (z.squaredNorm() + residual.squaredNorm()) - observation_.log_volume;
}

std::optional<double> ShapeDraws::log_density(const Place& place) const {
  const MatrixXd changes = observation_.projection * objective_.endpoint_changes(place.at.path());
  return log_density(place.at.z, place.residual, changes * match_.jacobian.transpose());
}

// @param slope J(z)Jᵀ
std::optional<double> ShapeDraws::log_density(const VectorXd& z, const VectorXd& residual, MatrixXd slope) const {
  const MatrixXd& jacobian = match_.jacobian;
  slope.diagonal().array() += 1;
  const Eigen::PartialPivLU<MatrixXd> lu(slope);
  if (lu.determinant() == 0) return std::nullopt;
  const VectorXd eta = z - jacobian.transpose() * residual;
  const VectorXd image = jacobian * eta;
  return -0.5 * (eta.squaredNorm() - image.dot(factors_.solve(image))) - half_log_determinant_ +
         lu.matrixLU().diagonal().array().abs().log().sum();
}

}  // namespace pulson::compare
