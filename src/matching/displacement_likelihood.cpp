#include "displacement_likelihood.hpp"

#include <algorithm>
#include <cmath>

#include "core/factorisations.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kMostFitted = 128;
constexpr double kSmallestVariance = 1e-300;

}  // namespace

std::vector<Index> fitted_landmarks(Index count) {
  std::vector<Index> few(static_cast<std::size_t>(std::min(count, kMostFitted)));
  for (std::size_t i = 0; i < few.size(); ++i) few[i] = static_cast<Index>(i) * count / std::ssize(few);
  return few;
}

MatrixXd on_each_axis(const MatrixXd& matrix, Index d) {
  MatrixXd all = MatrixXd::Zero(d * matrix.rows(), d * matrix.cols());
  for (Index b = 0; b < matrix.cols(); ++b)
    for (Index a = 0; a < matrix.rows(); ++a) all.block(a * d, b * d, d, d).diagonal().setConstant(matrix(a, b));
  return all;
}

DisplacementLikelihood::DisplacementLikelihood(const MatrixXd& gram, const DisplacementDraws& draws)
    : dimension_(draws.columns.rows() / gram.rows()), count_(draws.count), size_(draws.columns.rows()) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> factors(gram);
  values_ = factors.eigenvalues().cwiseMax(0);
  columns_ = rotated(draws.columns, factors.eigenvectors());
  directions_ = rotated(draws.directions, factors.eigenvectors());
  squares_ = columns_.rowwise().squaredNorm();
}

MatrixXd DisplacementLikelihood::rotated(const MatrixXd& columns, const MatrixXd& vectors) const {
  MatrixXd result(columns.rows(), columns.cols());
  for (Index i = 0; i < columns.cols(); ++i)
    result.col(i) = (columns.col(i).reshaped(dimension_, vectors.rows()) * vectors).reshaped();
  return result;
}

// For λ = 1: log det V + log det ZᵀV⁻¹Z, and Σ rᵀPr.
std::pair<double, double> DisplacementLikelihood::terms(double tau) const {
  const VectorXd v = (values_.array() + tau).max(kSmallestVariance);
  const VectorXd inverse = v.cwiseInverse().transpose().replicate(dimension_, 1).reshaped();
  double determinant = static_cast<double>(dimension_) * v.array().log().sum();
  double squares = inverse.dot(squares_);
  if (directions_.cols() > 0) {
    const MatrixXd scaled = inverse.asDiagonal() * directions_;
    const Eigen::LDLT<MatrixXd> normal(directions_.transpose() * scaled);
    determinant += normal.vectorD().array().abs().log().sum();
    const MatrixXd moved = scaled.transpose() * columns_;
    squares -= moved.cwiseProduct(normal.solve(moved)).sum();
  }
  return {determinant, std::max(squares, kSmallestVariance)};
}

double DisplacementLikelihood::degrees() const {
  return static_cast<double>(count_) * static_cast<double>(size_ - directions_.cols());
}

double DisplacementLikelihood::operator()(double tau, double variance) const {
  const auto [determinant, squares] = terms(tau);
  return -0.5 * (static_cast<double>(count_) * determinant + degrees() * std::log(variance) + squares / variance);
}

}  // namespace pulson::matching
