#include "pulson/ceres/shot_cost.hpp"

#include <cmath>
#include <utility>

#include <Eigen/Eigenvalues>
#include <ceres/normal_prior.h>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// As Ceres stores them.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

void store(double* jacobian, const MatrixXd& values) {
  Eigen::Map<RowMatrix>(jacobian, values.rows(), values.cols()) = values;
}

// ∂q(T)/∂q0.
MatrixXd end_by_start(const Shot& shot, const Trajectory& path) {
  const Index size = shot.q0.size();
  MatrixXd by_end = MatrixXd::Zero(size, is_at_rest(shot.system, path.initial()) ? size : 2 * size);
  by_end.leftCols(size).setIdentity();
  return shot.integrator->adjoint_rows(shot.system, path, by_end).start.leftCols(size);
}

}  // namespace

ShotCost::ShotCost(Shot shot, Points target, double sigma, ShotParameters parameters)
    : shot_(std::move(shot)), target_(std::move(target)), sigma_(sigma), parameters_(parameters) {
  require_positive("sigma", sigma);
  const Index d = shot_.q0.rows(), n = shot_.q0.cols();
  if (target_.size() == 0) target_ = Points::Zero(d, n);
  require_size("the target of a shot", target_, d, n);
  const Index channels = shot_.system.noise->channels(static_cast<int>(d), static_cast<int>(n));
  if (shot_.increments.size() == 0) shot_.increments = MatrixXd::Zero(channels, shot_.grid.steps);
  require_size("the increments of a shot", shot_.increments, channels, shot_.grid.steps);
  set_num_residuals(static_cast<int>(d * n));
  mutable_parameter_block_sizes()->push_back(coordinates());
  if (parameters_.q0) mutable_parameter_block_sizes()->push_back(coordinates());
  if (parameters_.increments) mutable_parameter_block_sizes()->push_back(static_cast<int>(shot_.increments.size()));
}

Trajectory ShotCost::path_of(double const* const* parameters) const {
  const auto points = [&](const double* block) {
    return Points(Eigen::Map<const Points>(block, shot_.q0.rows(), shot_.q0.cols()));
  };
  PhaseState start{shot_.q0, points(*parameters++)};
  if (parameters_.q0) start.q = points(*parameters++);
  MatrixXd increments = shot_.increments;
  if (parameters_.increments)
    increments = Eigen::Map<const MatrixXd>(*parameters, increments.rows(), increments.cols());
  return shot_.integrator->integrate(shot_.system, start, shot_.grid, increments);
}

bool ShotCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const SerialBlas serial;
  Trajectory path;
  try {
    path = path_of(parameters);
  } catch (const StepError&) {
    return false;
  }
  Eigen::Map<Points>(residuals, target_.rows(), target_.cols()) = (path.final().q - target_) / sigma_;
  if (jacobians == nullptr) return true;
  double* const by_p0 = *jacobians++;
  double* const by_q0 = parameters_.q0 ? *jacobians++ : nullptr;
  double* const by_increments = parameters_.increments ? *jacobians : nullptr;
  if (by_p0 != nullptr || by_increments != nullptr) {
    const EndpointJacobian jacobian = shot_.integrator->endpoint_jacobian(shot_.system, path);
    if (by_p0 != nullptr) store(by_p0, jacobian.momenta / sigma_);
    if (by_increments != nullptr) store(by_increments, jacobian.increments / sigma_);
  }
  if (by_q0 != nullptr) store(by_q0, end_by_start(shot_, path) / sigma_);
  return true;
}

std::unique_ptr<::ceres::CostFunction> energy_prior(const KernelOperator& kernel, const Points& q0, double lambda) {
  const SerialBlas serial;
  if (!(lambda >= 0)) throw InputError("lambda is negative, or no number; it must be 0 or greater");
  const Eigen::SelfAdjointEigenSolver<MatrixXd> factors(kernel.gram(q0, q0));
  const Eigen::VectorXd roots = (lambda * factors.eigenvalues()).cwiseMax(0).cwiseSqrt();
  const MatrixXd each = roots.asDiagonal() * factors.eigenvectors().transpose();
  const Index d = q0.rows(), n = q0.cols();
  ::ceres::Matrix all = ::ceres::Matrix::Zero(d * n, d * n);
  for (Index b = 0; b < n; ++b)
    for (Index a = 0; a < n; ++a) all.block(a * d, b * d, d, d).diagonal().setConstant(each(a, b));
  return std::make_unique<::ceres::NormalPrior>(all, ::ceres::Vector::Zero(d * n));
}

}  // namespace pulson
