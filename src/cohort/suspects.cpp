#include "suspects.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>

#include "pulson/core/parallel.hpp"
#include "pulson/matching/robust_loss.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// t² of each landmark, NaN where it is missing.
VectorXd prediction_squares(const PosedShapes& law, const Points& placed) {
  const Index d = placed.rows();
  const PosedShapes::Conditional found = law.condition(placed);
  const VectorXd pr = found.information * (placed - law.mean()).reshaped()(found.observed);
  VectorXd squares = VectorXd::Constant(placed.cols(), std::nan(""));
  for (Index i = 0; i < std::ssize(found.observed); i += d) {
    const MatrixXd own = found.information.block(i, i, d, d);
    squares[found.observed[static_cast<std::size_t>(i)] / d] = pr.segment(i, d).dot(own.ldlt().solve(pr.segment(i, d)));
  }
  return squares;
}

// Of the numbers that are not NaN; 0 where there are none.
double median(const MatrixXd& values) {
  std::vector<double> known;
  for (const double value : values.reshaped())
    if (!std::isnan(value)) known.push_back(value);
  if (known.empty()) return 0;
  const auto middle = known.begin() + std::ssize(known) / 2;
  std::nth_element(known.begin(), middle, known.end());
  return *middle;
}

}  // namespace

std::vector<int> find_suspects(const PosedShapes& law, const std::vector<Points>& placed) {
  const Index d = law.mean().rows(), n = std::ssize(placed);
  MatrixXd squares(law.mean().cols(), n);
  parallel_for(static_cast<int>(n),
               [&](int i) { squares.col(i) = prediction_squares(law, placed[static_cast<std::size_t>(i)]); });
  const double all = median(squares);
  for (Index a = 0; a < squares.rows(); ++a)
    squares.row(a) *=
        matching::kMedianSquare.at(static_cast<std::size_t>(d - 1)) / std::max(all, median(squares.row(a)));
  const matching::LossWeight weight(matching::RobustLoss{}, d);
  std::vector<int> suspects(placed.size(), -1);
  for (Index i = 0; i < n; ++i) {
    Index worst = 0;
    const double largest = squares.col(i).array().isNaN().select(-1, squares.col(i)).maxCoeff(&worst);
    if (largest > 0 && weight(largest) == 0) suspects[static_cast<std::size_t>(i)] = static_cast<int>(worst);
  }
  return suspects;
}

}  // namespace pulson::cohort
