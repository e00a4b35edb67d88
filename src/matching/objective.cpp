#include "pulson/matching/objective.hpp"

#include <cmath>

#include <Eigen/Eigenvalues>
#include <fmt/core.h>

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Below the first, K is numerically singular; below the second, the energy holds a direction of p0 so firmly that it
// explains less than this part of any misfit; but nothing above the third is left out.
constexpr double kRankTolerance = 1e-13;
constexpr double kUsefulPart = 1e-4;
constexpr double kMostLeftOut = 1e-6;

void check_positive(double value, std::string_view what) {
  if (!(std::isfinite(value) && value > 0))
    throw InputError(fmt::format("{} is {}; it must be a finite number greater than 0", what, value));
}

void check(const MatchingProblem& problem) {
  check_positive(problem.sigma, "sigma");
  check_positive(problem.lambda, "lambda");
  check_positive(problem.grid.time, "time");
  if (problem.grid.steps < 1) throw InputError(fmt::format("steps is {}; at least 1 is needed", problem.grid.steps));
  if (problem.source.rows() != problem.target.rows() || problem.source.cols() != problem.target.cols())
    throw InputError(fmt::format("the source has {} landmarks in {}D, the target {} in {}D", problem.source.cols(),
                                 problem.source.rows(), problem.target.cols(), problem.target.rows()));
  if (const auto pair = find_coincident(problem.source))
    throw InputError(
        fmt::format("source landmarks {} and {} are at the same place", pair->first + 1, pair->second + 1));
  if (!problem.source.allFinite() || !problem.target.allFinite())
    throw InputError("a landmark coordinate is not a finite number");
}

// N×rank: V D^{-½} for the eigenvalues of K above the tolerances, λK = VDVᵀ; `roughness` is the largest over each.
MatrixXd whitening(const MatchingProblem& problem, VectorXd& roughness) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(problem.system.kernel.gram(problem.source, problem.source));
  const VectorXd& values = eigen.eigenvalues();
  const double observable = problem.lambda * std::pow(problem.sigma / problem.grid.time, 2);
  const double largest = values[values.size() - 1];
  const double floor = std::max(kRankTolerance * largest, std::min(kUsefulPart * observable, kMostLeftOut * largest));
  const Index rank = (values.array() > floor).count();
  roughness = largest * values.tail(rank).cwiseInverse();
  return eigen.eigenvectors().rightCols(rank) *
         (problem.lambda * values.tail(rank)).cwiseSqrt().cwiseInverse().asDiagonal();
}

}  // namespace

MatchingObjective::MatchingObjective(MatchingProblem problem) : problem_(std::move(problem)) {
  check(problem_);
  const int d = static_cast<int>(problem_.source.rows());
  const int n = static_cast<int>(problem_.source.cols());
  problem_.system.noise->check(d, n);
  channels_ = problem_.system.noise->channels(d, n);
  VectorXd roughness;
  momenta_from_white_ = whitening(problem_, roughness);
  white_from_momenta_ = (momenta_from_white_.transpose() * momenta_from_white_).diagonal().cwiseInverse().asDiagonal() *
                        momenta_from_white_.transpose();
  roughness_ = VectorXd::Ones(unknowns());
  for (Index axis = 0; axis < d; ++axis) roughness_(Eigen::seqN(axis, roughness.size(), Index(d))) = roughness;
}

Index MatchingObjective::unknowns() const {
  return problem_.source.rows() * momenta_from_white_.cols() + static_cast<Index>(channels_) * problem_.grid.steps;
}

VectorXd MatchingObjective::white(const Points& p, const MatrixXd& dw) const {
  const Points z0 = p * white_from_momenta_.transpose();
  VectorXd z(unknowns());
  z << z0.reshaped(), dw.reshaped() / std::sqrt(problem_.grid.dt());
  return z;
}

Points MatchingObjective::momenta(const VectorXd& z) const {
  const Index d = problem_.source.rows();
  return z.head(d * momenta_from_white_.cols()).reshaped(d, momenta_from_white_.cols()) *
         momenta_from_white_.transpose();
}

MatrixXd MatchingObjective::increments(const VectorXd& z) const {
  const Index controls = static_cast<Index>(channels_) * problem_.grid.steps;
  return std::sqrt(problem_.grid.dt()) * z.tail(controls).reshaped(channels_, problem_.grid.steps);
}

std::optional<MatchingObjective::Evaluation> MatchingObjective::evaluate(const VectorXd& z) const {
  try {
    Evaluation at{z,
                  problem_.integrator->integrate(problem_.system, {problem_.source, momenta(z)}, problem_.grid,
                                                 increments(z), RootSearch::kContracting),
                  {},
                  {}};
    at.residual = (at.path.final().q - problem_.target).reshaped() / problem_.sigma;
    const Index momentum_unknowns = problem_.source.rows() * momenta_from_white_.cols();
    at.cost.energy = 0.5 * z.head(momentum_unknowns).squaredNorm();
    at.cost.action = 0.5 * z.tail(z.size() - momentum_unknowns).squaredNorm();
    at.cost.data = 0.5 * at.residual.squaredNorm();
    if (!std::isfinite(at.cost.total())) return std::nullopt;
    return at;
  } catch (const StepError&) {
    return std::nullopt;
  }
}

VectorXd MatchingObjective::gradient(const Evaluation& at) const {
  const Points& source = problem_.source;
  const Points q_bar = at.residual.reshaped(source.rows(), source.cols()) / problem_.sigma;
  const PathGradient bar =
      problem_.integrator->adjoint(problem_.system, at.path, {q_bar, Points::Zero(source.rows(), source.cols())});
  const Points z0_bar = bar.p0_bar * momenta_from_white_;
  VectorXd gradient = at.z;
  gradient.head(z0_bar.size()) += z0_bar.reshaped();
  gradient.tail(bar.increments_bar.size()) += std::sqrt(problem_.grid.dt()) * bar.increments_bar.reshaped();
  return gradient;
}

MatrixXd MatchingObjective::jacobian(const Evaluation& at) const {
  const Index d = problem_.source.rows();
  const Index rank = momenta_from_white_.cols();
  const EndpointJacobian end = problem_.integrator->endpoint_jacobian(problem_.system, at.path);
  MatrixXd jacobian(residuals(), unknowns());
  for (Index axis = 0; axis < d; ++axis) {
    const MatrixXd by_landmark = end.momenta(Eigen::all, Eigen::seqN(axis, problem_.source.cols(), d));
    const MatrixXd by_white = by_landmark * momenta_from_white_;
    jacobian(Eigen::all, Eigen::seqN(axis, rank, d)) = by_white;
  }
  jacobian.rightCols(end.increments.cols()) = std::sqrt(problem_.grid.dt()) * end.increments;
  return jacobian / problem_.sigma;
}

}  // namespace pulson
