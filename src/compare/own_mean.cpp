#include "own_mean.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/factorisations.hpp"

namespace pulson::compare {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using posterior::LinearModel;
using posterior::Specimen;

namespace {

// Of the precision of the best determined direction of the mean, 1 a shape: what rounding leaves of directions that the
// alignment takes out of every shape.
constexpr double kUndetermined = 1e-9;

}  // namespace

OwnMean::OwnMean(const std::vector<Specimen>& specimens, posterior::RestModel whole) : whole_(std::move(whole)) {
  const double sigma = whole_.specimen().problem().sigma;
  const Index count = whole_.specimen().data();
  MatrixXd precision = MatrixXd::Zero(count, count);
  for (const Specimen& specimen : specimens) {
    MatrixXd observed = sigma * specimen.source_projection();
    precision += observed.transpose() * observed;
    const auto same = std::find_if(groups_.begin(), groups_.end(), [&](const Alike& group) {
      return group.observed.rows() == observed.rows() && group.observed == observed;
    });
    if (same == groups_.end())
      groups_.push_back({std::move(observed), 1});
    else
      ++same->shapes;
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(precision);
  const Index unknown = (axes.eigenvalues().array() < kUndetermined * axes.eigenvalues().maxCoeff()).count();
  basis_ = axes.eigenvectors().rightCols(axes.eigenvalues().size() - unknown);
}

double OwnMean::log_factor(const LinearModel& at_rest, const Specimen::Model& model) const {
  const double error = model.sigma * model.sigma;  // in units of the σ of the data, as all here
  MatrixXd of_ends = at_rest.covariance(model);
  of_ends.diagonal().array() -= error;
  MatrixXd precision = MatrixXd::Zero(basis_.cols(), basis_.cols());
  for (const Alike& group : groups_) {
    MatrixXd covariance = group.observed * of_ends * group.observed.transpose();
    covariance.diagonal().array() += error;
    const Eigen::LLT<MatrixXd> factors(covariance);
    const MatrixXd white = factors.matrixL().solve(MatrixXd(group.observed * basis_));
    precision.noalias() += group.shapes * white.transpose() * white;
  }
  const Eigen::LLT<MatrixXd> factors(precision);
  const auto determined = static_cast<double>(basis_.cols());
  return determined * (0.5 * std::log(2 * std::numbers::pi) + std::log(whole_.specimen().problem().sigma)) -
         factors.matrixLLT().diagonal().array().log().sum();
}

}  // namespace pulson::compare
