#include "line_system.hpp"

#include <algorithm>
#include <cmath>

#include "kernels/line_state.hpp"
#include "kernels/line_sums.hpp"

namespace pulson::matching {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

LineSystem::LineSystem(const KernelTerm& term, const MatrixXd& places, const MatrixXd& weights, const VectorXd& noise)
    : moments_(line_moments(term.profile)) {
  arrange(term, places);
  if (moments_ == 1)
    filter<1>(term.weight, weights, noise);
  else if (moments_ == 2)
    filter<2>(term.weight, weights, noise);
  else
    filter<3>(term.weight, weights, noise);
  if (!movers_.empty()) complement(term, places, weights, noise);
}

namespace {

// The most of these landmarks, which are in some order, whose x ascends in it (Fredman 1975).
std::vector<Index> longest_ascending(const std::vector<Index>& order, const VectorXd& x) {
  std::vector<std::size_t> ends;  // of the ascending sequences of each length the one that ends at the least x
  std::vector<std::size_t> before(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto at = std::upper_bound(ends.begin(), ends.end(), x[order[i]],
                                     [&](double value, std::size_t end) { return value < x[order[end]]; });
    before[i] = at == ends.begin() ? order.size() : *(at - 1);
    if (at == ends.end())
      ends.push_back(i);
    else
      *at = i;
  }
  std::vector<Index> longest;
  for (std::size_t i = ends.empty() ? order.size() : ends.back(); i < order.size(); i = before[i])
    longest.push_back(order[i]);
  std::reverse(longest.begin(), longest.end());
  return longest;
}

}  // namespace

void LineSystem::arrange(const KernelTerm& term, const MatrixXd& places) {
  order_ = sorted_order(places.col(0));
  for (Index k = places.cols(); k-- > 1;) order_ = longest_ascending(order_, places.col(k));
  std::vector<char> is_ordered(static_cast<std::size_t>(places.rows()), 0);
  for (const Index a : order_) is_ordered[static_cast<std::size_t>(a)] = 1;
  for (Index a = 0; a < places.rows(); ++a)
    if (is_ordered[static_cast<std::size_t>(a)] == 0) movers_.push_back(a);
  gaps_.resize(places.cols(), std::ssize(order_));
  gaps_.col(0).setZero();
  for (Index i = 1; i < gaps_.cols(); ++i) {
    const Index here = order_[static_cast<std::size_t>(i)], before = order_[static_cast<std::size_t>(i) - 1];
    gaps_.col(i) = (line_scale(term) * (places.row(here) - places.row(before))).cwiseMin(kFurthestOnLine).transpose();
  }
  decays_ = line_decays(gaps_);
}

namespace {

// PFᵀ, F block-diagonal.
template <int S>
void multiply(const MatrixXd& p, const std::vector<LineMatrix<S>>& f, MatrixXd& product) {
  for (std::size_t k = 0; k < f.size(); ++k) {
    const auto from = static_cast<Index>(k) * S;
    for (int s = 0; s < S; ++s) {
      auto to = product.col(from + s);
      to = f[k](s, 0) * p.col(from);
      for (int r = 1; r < S; ++r) to += f[k](s, r) * p.col(from + r);
    }
  }
}

}  // namespace

template <int S>
void LineSystem::filter(double weight, const MatrixXd& weights, const VectorXd& noise) {
  const Index steps = gaps_.rows(), size = steps * S;
  std::vector<LineMatrix<S>> f(static_cast<std::size_t>(steps));
  MatrixXd p = MatrixXd::Zero(size, size), product(size, size);
  for (Index k = 0; k < steps; ++k) p.block<S, S>(k * S, k * S) = weight * line_stationary<S>();
  gains_.resize(size, gaps_.cols());
  weights_.resize(steps, gaps_.cols());
  variances_.resize(gaps_.cols());
  VectorXd covariance(size);  // of the state and what is observed
  for (Index i = 0; i < gaps_.cols(); ++i) {
    if (i > 0) {
      for (Index k = 0; k < steps; ++k) f[static_cast<std::size_t>(k)] = line_propagator<S>(gaps_(k, i), decays_(k, i));
      multiply<S>(p, f, product);
      p = product.transpose();
      multiply<S>(p, f, product);
      p.swap(product);
      for (Index k = 0; k < steps; ++k) p.block<S, S>(k * S, k * S) += weight * line_driven<S>(gaps_(k, i));
    }
    const Index landmark = order_[static_cast<std::size_t>(i)];
    weights_.col(i) = weights.row(landmark).transpose();
    covariance.setZero();
    for (Index k = 0; k < steps; ++k) covariance += weights_(k, i) * p.col(k * S);
    variances_[i] = noise[landmark];
    for (Index k = 0; k < steps; ++k) variances_[i] += weights_(k, i) * covariance[k * S];
    gains_.col(i) = covariance / variances_[i];
    p.noalias() -= gains_.col(i) * covariance.transpose();
  }
}

// With A of the landmarks in order, C of these and the movers, B of the movers: B − CᵀA⁻¹C.
void LineSystem::complement(const KernelTerm& term, const MatrixXd& places, const MatrixXd& weights,
                            const VectorXd& noise) {
  const KernelOperator kernel({term});
  MatrixXd across = MatrixXd::Zero(std::ssize(order_), movers());
  MatrixXd among = VectorXd(noise(movers_)).asDiagonal();
  for (Index k = 0; k < places.cols(); ++k) {
    const VectorXd all = places.col(k), weight = weights.col(k);
    const Points ordered = all(order_).transpose(), moving = all(movers_).transpose();
    const VectorXd here = weight(movers_);
    across += VectorXd(weight(order_)).asDiagonal() * kernel.gram(ordered, moving) * here.asDiagonal();
    among += here.asDiagonal() * kernel.gram(moving, moving) * here.asDiagonal();
  }
  solved_ = across;
  solve_ordered(solved_);
  among.noalias() -= across.transpose() * solved_;
  schur_.compute(among);
}

void LineSystem::solve_in_place(VectorXd& v) const {
  MatrixXd ordered = v(order_);
  solve_ordered(ordered);
  if (!movers_.empty()) {
    // solved_ᵀ v of those in order is CᵀA⁻¹v.
    const VectorXd moving = schur_.solve(VectorXd(v(movers_) - solved_.transpose() * v(order_)));
    ordered.noalias() -= solved_ * moving;
    v(movers_) = moving;
  }
  v(order_) = ordered.col(0);
}

void LineSystem::solve_ordered(Eigen::Ref<MatrixXd> v) const {
  if (moments_ == 1)
    solve_with<1>(v);
  else if (moments_ == 2)
    solve_with<2>(v);
  else
    solve_with<3>(v);
}

template <int S>
void LineSystem::solve_with(Eigen::Ref<MatrixXd> v) const {
  const Index steps = gaps_.rows();
  // Of the state, for each column of v.
  MatrixXd mean = MatrixXd::Zero(v.cols(), steps * S), adjoint = mean, part(v.cols(), S);
  MatrixXd values = v.transpose();
  for (Index i = 0; i < gaps_.cols(); ++i) {
    auto value = values.col(i);
    for (Index k = 0; k < steps; ++k) {
      auto of_step = mean.middleCols<S>(k * S);
      part.noalias() = of_step.lazyProduct(line_propagator<S>(gaps_(k, i), decays_(k, i)).transpose());
      of_step = part;
      value -= weights_(k, i) * part.col(0);
    }
    mean.noalias() += value * gains_.col(i).transpose();
  }
  for (Index i = gaps_.cols(); i-- > 0;) {
    auto value = values.col(i);
    value /= variances_[i];
    value.noalias() += adjoint * gains_.col(i);
    for (Index k = 0; k < steps; ++k) {
      auto of_step = adjoint.middleCols<S>(k * S);
      part = of_step;
      part.col(0) -= weights_(k, i) * value;
      of_step.noalias() = part.lazyProduct(line_propagator<S>(gaps_(k, i), decays_(k, i)));
    }
  }
  v = values.transpose();
}

}  // namespace pulson::matching
