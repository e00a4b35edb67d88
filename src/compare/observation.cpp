#include "observation.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/QR>
#include <fmt/core.h>

#include "pulson/core/errors.hpp"

namespace pulson {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Observation observe(const Cohort& cohort, int target, double sigma) {
  const Landmarks& shape = cohort.targets[static_cast<std::size_t>(target)];
  const VectorXd values = shape.points.reshaped();
  std::vector<Index> observed;
  for (Index i = 0; i < values.size(); ++i)
    if (!std::isnan(values[i])) observed.push_back(i);
  const auto n = std::ssize(observed);
  const MatrixXd motions = motion_directions(cohort.source.points, cohort.alignment, observed);
  if (n <= motions.cols())
    throw InputError(fmt::format(
        "{}: its {} observed coordinates are too few, as the alignment accounts for all of them", shape.source, n));
  MatrixXd basis = MatrixXd::Identity(n, n);
  if (motions.cols() > 0) basis.applyOnTheLeft(Eigen::HouseholderQR<MatrixXd>(motions).householderQ());
  const MatrixXd left = basis.rightCols(n - motions.cols()).transpose() / sigma;
  Observation observation;
  observation.projection = MatrixXd::Zero(left.rows(), values.size());
  for (Index i = 0; i < n; ++i) observation.projection.col(observed[static_cast<std::size_t>(i)]) = left.col(i);
  observation.target = left * values(observed);
  observation.log_volume = static_cast<double>(left.rows()) * std::log(std::sqrt(2 * std::numbers::pi) * sigma);
  return observation;
}

}  // namespace pulson
