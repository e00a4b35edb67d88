#include "core/number_checks.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <fmt/core.h>

#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

using Eigen::MatrixXd;

constexpr double kCovarianceRounding = 1e-13;

}  // namespace

void require_finite(std::string_view what, double value) {
  if (!std::isfinite(value)) throw InputError(fmt::format("{} is {}; it must be finite", what, value));
}

void require_positive(std::string_view what, double value) {
  if (!std::isfinite(value) || !(value > 0))
    throw InputError(fmt::format("{} is {}; it must be a finite number greater than 0", what, value));
}

bool is_covariance(const MatrixXd& r) {
  if (r.size() == 0 || r.rows() != r.cols() || !r.allFinite()) return false;
  if ((r - r.transpose()).cwiseAbs().maxCoeff() > kCovarianceRounding * r.cwiseAbs().maxCoeff()) return false;
  const Eigen::LLT<MatrixXd> root(r);
  if (root.info() != Eigen::Success) return false;
  // Each axis must keep a part of its variance when those before it are known.
  return (root.matrixLLT().diagonal().array().square() > kCovarianceRounding * r.diagonal().array()).all();
}

void require_size(std::string_view what, Eigen::Index rows, Eigen::Index columns, Eigen::Index needed_rows,
                  Eigen::Index needed_columns) {
  if (rows != needed_rows || columns != needed_columns)
    throw InputError(
        fmt::format("{}: a matrix of {} x {}; {} x {} is needed", what, rows, columns, needed_rows, needed_columns));
}

}  // namespace pulson
