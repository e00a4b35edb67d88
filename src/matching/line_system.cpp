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
    : gaps_(places.cols(), places.rows()),
      weights_(weights.cols(), weights.rows()),
      variances_(places.rows()),
      moments_(line_moments(term.profile)) {
  arrange(term, places);
  if (moments_ == 1)
    filter<1>(term.weight, weights, noise);
  else if (moments_ == 2)
    filter<2>(term.weight, weights, noise);
  else
    filter<3>(term.weight, weights, noise);
}

void LineSystem::arrange(const KernelTerm& term, const MatrixXd& places) {
  order_ = sorted_order(places.rowwise().mean());
  for (Index k = 0; k < places.cols(); ++k) {
    VectorXd sorted = places.col(k)(order_);
    if (!std::is_sorted(sorted.begin(), sorted.end())) {
      exact_ = false;
      std::sort(sorted.begin(), sorted.end());
    }
    gaps_(k, 0) = 0;
    for (Index i = 1; i < sorted.size(); ++i)
      gaps_(k, i) = std::min(kFurthestOnLine, line_scale(term) * (sorted[i] - sorted[i - 1]));
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

void LineSystem::solve_in_place(VectorXd& v) const {
  if (moments_ == 1)
    solve_with<1>(v);
  else if (moments_ == 2)
    solve_with<2>(v);
  else
    solve_with<3>(v);
}

template <int S>
void LineSystem::solve_with(VectorXd& v) const {
  const Index steps = gaps_.rows();
  VectorXd mean = VectorXd::Zero(steps * S), adjoint = mean;  // of the state
  for (Index i = 0; i < gaps_.cols(); ++i) {
    double& value = v[order_[static_cast<std::size_t>(i)]];
    for (Index k = 0; k < steps; ++k) {
      auto part = mean.segment<S>(k * S);
      part = (line_propagator<S>(gaps_(k, i), decays_(k, i)) * part).eval();
      value -= weights_(k, i) * part[0];
    }
    mean += value * gains_.col(i);
  }
  for (Index i = gaps_.cols(); i-- > 0;) {
    double& value = v[order_[static_cast<std::size_t>(i)]];
    value = value / variances_[i] + gains_.col(i).dot(adjoint);
    for (Index k = 0; k < steps; ++k) {
      auto part = adjoint.segment<S>(k * S);
      part[0] -= weights_(k, i) * value;
      part = (line_propagator<S>(gaps_(k, i), decays_(k, i)).transpose() * part).eval();
    }
  }
}

}  // namespace pulson::matching
