#include "line_system.hpp"

#include <algorithm>
#include <cmath>

#include "kernels/line_state.hpp"
#include "kernels/line_sums.hpp"
#include "pulson/core/parallel.hpp"

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
  const Index lanes = (places.cols() + kLineLanes - 1) / kLineLanes * kLineLanes;
  gaps_ = MatrixXd::Zero(lanes, std::ssize(order_));
  for (Index i = 1; i < gaps_.cols(); ++i) {
    const Index here = order_[static_cast<std::size_t>(i)], before = order_[static_cast<std::size_t>(i) - 1];
    gaps_.col(i).head(places.cols()) =
        (line_scale(term) * (places.row(here) - places.row(before))).cwiseMin(kFurthestOnLine).transpose();
  }
  decays_ = line_decays(gaps_);
}

namespace {

// PFᵀ, F of blocks for each step, whose states' components lie n apart.
template <int S>
void multiply(const MatrixXd& p, const std::vector<LineMatrix<S>>& f, MatrixXd& product) {
  const auto n = static_cast<Index>(f.size());
  for (Index k = 0; k < n; ++k) {
    const LineMatrix<S>& of_step = f[static_cast<std::size_t>(k)];
    for (int s = 0; s < S; ++s) {
      auto to = product.col(s * n + k);
      to = of_step(s, 0) * p.col(k);
      for (int r = 1; r < S; ++r) to += of_step(s, r) * p.col(r * n + k);
    }
  }
}

}  // namespace

template <int S>
void LineSystem::filter(double weight, const MatrixXd& weights, const VectorXd& noise) {
  const Index steps = weights.cols(), size = steps * S;
  std::vector<LineMatrix<S>> f(static_cast<std::size_t>(steps));
  MatrixXd p = MatrixXd::Zero(size, size), product(size, size);
  const auto add = [&](Index k, const LineMatrix<S>& covariance) {
    for (int s = 0; s < S; ++s)
      for (int r = 0; r < S; ++r) p(r * steps + k, s * steps + k) += weight * covariance(r, s);
  };
  for (Index k = 0; k < steps; ++k) add(k, line_stationary<S>());
  weights_ = MatrixXd::Zero(gaps_.rows(), gaps_.cols());
  gains_.assign(S, weights_);
  variances_.resize(gaps_.cols());
  VectorXd covariance(size);  // of the state and what is observed
  for (Index i = 0; i < gaps_.cols(); ++i) {
    if (i > 0) {
      for (Index k = 0; k < steps; ++k) f[static_cast<std::size_t>(k)] = line_propagator<S>(gaps_(k, i), decays_(k, i));
      multiply<S>(p, f, product);
      p = product.transpose();
      multiply<S>(p, f, product);
      p.swap(product);
      for (Index k = 0; k < steps; ++k) add(k, line_driven<S>(gaps_(k, i)));
    }
    const Index landmark = order_[static_cast<std::size_t>(i)];
    const VectorXd here = weights.row(landmark).transpose();
    weights_.col(i).head(steps) = here;
    covariance.noalias() = p.leftCols(steps) * here;
    variances_[i] = noise[landmark] + here.dot(covariance.head(steps));
    const VectorXd gain = covariance / variances_[i];
    for (int s = 0; s < S; ++s) gains_[static_cast<std::size_t>(s)].col(i).head(steps) = gain.segment(s * steps, steps);
    p.noalias() -= gain * covariance.transpose();
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
  parallel_for(static_cast<int>(v.cols()), [&](int column) {
    if (moments_ == 1)
      solve_column<1>(v.col(column));
    else if (moments_ == 2)
      solve_column<2>(v.col(column));
    else
      solve_column<3>(v.col(column));
  });
}

template <int S>
void LineSystem::solve_column(Eigen::Ref<VectorXd> v) const {
  LineLaneStates<S> none;
  none.fill(LineLanes::Zero());
  const Index blocks = gaps_.rows() / kLineLanes;
  std::vector<LineLaneStates<S>> mean(static_cast<std::size_t>(blocks), none), adjoint = mean;
  const auto lanes = [](const MatrixXd& of, Index i, Index block) {
    return of.col(i).template segment<kLineLanes>(block * kLineLanes).array();
  };
  for (Index i = 0; i < v.size(); ++i) {
    LineLanes foreseen = LineLanes::Zero();
    for (Index b = 0; b < blocks; ++b) {
      LineLaneStates<S>& state = mean[static_cast<std::size_t>(b)];
      propagate<S>(state, lanes(gaps_, i, b), lanes(decays_, i, b));
      foreseen += lanes(weights_, i, b) * state[0];
    }
    v[i] -= foreseen.sum();
    for (Index b = 0; b < blocks; ++b)
      for (std::size_t s = 0; s < S; ++s) mean[static_cast<std::size_t>(b)][s] += v[i] * lanes(gains_[s], i, b);
  }
  for (Index i = v.size(); i-- > 0;) {
    LineLanes fed = LineLanes::Zero();
    for (Index b = 0; b < blocks; ++b)
      for (std::size_t s = 0; s < S; ++s) fed += lanes(gains_[s], i, b) * adjoint[static_cast<std::size_t>(b)][s];
    v[i] = v[i] / variances_[i] + fed.sum();
    for (Index b = 0; b < blocks; ++b) {
      LineLaneStates<S>& state = adjoint[static_cast<std::size_t>(b)];
      state[0] -= v[i] * lanes(weights_, i, b);
      propagate_back<S>(state, lanes(gaps_, i, b), lanes(decays_, i, b));
    }
  }
}

}  // namespace pulson::matching
