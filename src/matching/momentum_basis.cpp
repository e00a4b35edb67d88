#include "matching/momentum_basis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Where so many pivots are needed, all landmarks are taken, by a factorisation in blocks.
constexpr Index kPivotsBeforeAll = 512;

// Beyond this rank eigenvectors cost more than they are worth.
constexpr Index kMostEigenvectors = 1200;

// Beside K(0), what is left of a landmark below this is round-off.
constexpr double kSingular = 1e-13;

struct Factorisation {
  std::vector<Index> pivots;
  MatrixXd factor;
  double left_over = 0;
};

// K + A at the landmarks.
struct Metric {
  const KernelOperator& kernel;
  const Points& q;
  const MatrixXd& added;

  Index size() const { return q.cols(); }
  MatrixXd matrix() const { return added.size() > 0 ? MatrixXd(kernel.gram(q, q) + added) : kernel.gram(q, q); }
  VectorXd column(Index i) const {
    const VectorXd of_kernel = kernel.gram(q, q.col(i));
    return added.size() > 0 ? VectorXd(of_kernel + added.col(i)) : of_kernel;
  }
  VectorXd diagonal() const {
    const VectorXd of_kernel = VectorXd::Constant(size(), kernel.at_zero());
    return added.size() > 0 ? VectorXd(of_kernel + added.diagonal()) : of_kernel;
  }
};

// All landmarks in their order; none where K is singular to rounding.
std::optional<Factorisation> factor_all(const Metric& metric) {
  Factorisation result;
  result.factor = metric.matrix();
  if (Eigen::LLT<Eigen::Ref<MatrixXd>>(result.factor).info() != Eigen::Success) return std::nullopt;
  result.pivots.resize(static_cast<std::size_t>(metric.size()));
  std::iota(result.pivots.begin(), result.pivots.end(), Index(0));
  return result;
}

// Columns of the pivoted factor, each added when its pivot is taken.
Factorisation factor_pivots(const Metric& metric, double tolerance, Index most) {
  const Index n = metric.size();
  VectorXd left = metric.diagonal();
  const double whole = left.maxCoeff();
  MatrixXd columns(n, std::min<Index>(n, 64));
  Factorisation result;
  for (Index m = 0; m < n && m < most; ++m) {
    Index pivot = 0;
    const double largest = left.maxCoeff(&pivot);
    if (!(left.sum() > tolerance && largest > kSingular * whole)) break;
    if (m == columns.cols()) columns.conservativeResize(n, std::min(n, 2 * m));
    VectorXd column = metric.column(pivot);
    column.noalias() -= columns.leftCols(m) * columns.row(pivot).head(m).transpose();
    columns.col(m) = column / std::sqrt(column[pivot]);
    left = (left - columns.col(m).cwiseAbs2()).cwiseMax(0);
    left[pivot] = 0;
    result.pivots.push_back(pivot);
  }
  result.left_over = left.cwiseMax(0).sum();
  result.factor = columns(result.pivots, Eigen::seqN(0, static_cast<Index>(result.pivots.size())));
  return result;
}

Factorisation factor(const Metric& metric, double tolerance) {
  const Index n = metric.size();
  Factorisation first = factor_pivots(metric, tolerance, std::max(kPivotsBeforeAll, n / 2));
  if (first.left_over <= tolerance) return first;
  if (std::optional<Factorisation> all = factor_all(metric)) {
    return std::move(*all);
  }
  return factor_pivots(metric, tolerance, n);
}

// Between −1 and 1, where its first two derivatives vanish.
double smooth_step(double x) {
  const double t = std::clamp(0.5 * (x + 1), 0.0, 1.0);
  return t * t * t * (10 + t * (6 * t - 15));
}

}  // namespace

std::vector<Index> pivoted_landmarks(const KernelOperator& kernel, const Points& q, double tolerance, Index most) {
  return factor_pivots({kernel, q, {}}, tolerance, most).pivots;
}

MomentumBasis::MomentumBasis(KernelOperator kernel, const Points& q0, double lambda, double tolerance, double faint,
                             MatrixXd added)
    : kernel_(std::move(kernel)), q0_(q0), lambda_(lambda), added_(std::move(added)), dimension_(q0.rows()) {
  const SerialBlas serial;
  Factorisation result = factor({kernel_, q0_, added_}, tolerance);
  pivots_ = std::move(result.pivots);
  left_over_ = result.left_over;
  factor_ = std::sqrt(lambda) * result.factor;
  if (rank() > kMostEigenvectors) return;
  const MatrixXd lower = factor_.triangularView<Eigen::Lower>();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(lower * lower.transpose());
  const double floor = kSingular * eigen.eigenvalues()[rank() - 1];
  const VectorXd all = eigen.eigenvalues().cwiseMax(floor);
  const VectorXd strength =
      all.unaryExpr([&](double value) { return faint > 0 ? smooth_step(std::log10(value / faint)) : 1; });
  Index left = 0;  // eigenvalues ascend
  while (left < rank() - 1 && strength[left] == 0) ++left;
  eigenvalues_ = all.tail(rank() - left);
  strength_ = strength.tail(rank() - left);
  eigenvectors_ = eigen.eigenvectors().rightCols(rank() - left);
  eigen_root_ = eigenvectors_ * strength_.cwiseQuotient(eigenvalues_.cwiseSqrt()).asDiagonal();
}

Points MomentumBasis::scatter(const Points& at_pivots) const {
  Points p = Points::Zero(dimension_, q0_.cols());
  p(Eigen::all, pivots_) = at_pivots;
  return p;
}

Points MomentumBasis::momenta(const VectorXd& z0) const {
  const SerialBlas serial;
  require_size("the unknowns of the momenta", z0, unknowns(), 1);
  const auto z = z0.reshaped(dimension_, directions());
  if (eigen_root_.size() > 0) return scatter(z * eigen_root_.transpose());
  return scatter(factor_.triangularView<Eigen::Lower>().transpose().solve(MatrixXd(z.transpose())).transpose());
}

VectorXd MomentumBasis::pull_back(const Points& p_bar) const {
  const SerialBlas serial;
  require_size("the derivative by the momenta", p_bar, q0_.rows(), q0_.cols());
  const Points at_pivots = p_bar(Eigen::all, pivots_);
  if (eigen_root_.size() > 0) return (at_pivots * eigen_root_).reshaped();
  return factor_.triangularView<Eigen::Lower>().solve(MatrixXd(at_pivots.transpose())).transpose().reshaped();
}

// With p = Wz, WWᵀ = (λK)⁻¹: z = WᵀλKp. Where directions fade, p = WFz and z = F⁻¹WᵀλKp, but no more than ten times
// the latter, and less where F is nearly 0.
VectorXd MomentumBasis::white(const Points& p) const {
  require_size("the momenta", p, q0_.rows(), q0_.cols());
  Points velocity = Points::Zero(dimension_, q0_.cols());
  velocity(Eigen::all, pivots_) = lambda_ * kernel_.apply(q0_(Eigen::all, pivots_), q0_, p);
  if (added_.size() > 0) velocity(Eigen::all, pivots_) += lambda_ * p * added_(Eigen::all, pivots_);
  VectorXd z = pull_back(velocity);
  constexpr double kLeast = 0.1;  // F
  for (Index i = 0; i < strength_.size(); ++i)
    z.segment(i * dimension_, dimension_) /= std::pow(std::max(strength_[i], kLeast), 2);
  return z;
}

VectorXd MomentumBasis::in_directions(const VectorXd& normals) const {
  if (eigen_root_.size() == 0) return normals.head(unknowns());
  return (normals.reshaped(dimension_, q0_.cols())(Eigen::all, pivots_) * eigenvectors_).reshaped();
}

MatrixXd MomentumBasis::changes() const {
  const SerialBlas serial;
  MatrixXd changes(dimension_ * q0_.cols(), unknowns());
  for (Index i = 0; i < changes.cols(); ++i) changes.col(i) = momenta(VectorXd::Unit(unknowns(), i)).reshaped();
  return changes;
}

VectorXd MomentumBasis::eigenvalues() const {
  if (eigenvalues_.size() == 0) return VectorXd::Constant(unknowns(), std::numeric_limits<double>::infinity());
  return eigenvalues_.transpose().replicate(dimension_, 1).reshaped();
}

VectorXd MomentumBasis::frequency() const {
  if (eigenvalues_.size() == 0) return VectorXd::Ones(unknowns());
  return eigenvalues_[eigenvalues_.size() - 1] * eigenvalues().cwiseInverse();
}

}  // namespace pulson::matching
