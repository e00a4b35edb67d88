#include "line_covariance.hpp"

#include <algorithm>
#include <cmath>

#include "line_state.hpp"
#include "line_sums.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

template <int S>
using State = LineState<S>;
template <int S>
using Square = LineMatrix<S>;

}  // namespace

LineCovariance::LineCovariance(const KernelTerm& term, const VectorXd& x, const VectorXd& noise)
    : size_(line_moments(term.profile)),
      order_(sorted_order(x)),
      gaps_(VectorXd::Zero(x.size())),
      variances_(x.size()),
      gains_(size_, x.size()) {
  for (Index i = 1; i < x.size(); ++i)
    gaps_[i] = std::min(kFurthestOnLine, line_scale(term) * (x[order_[static_cast<std::size_t>(i)]] -
                                                             x[order_[static_cast<std::size_t>(i) - 1]]));
  decays_ = line_decays(gaps_);
  if (size_ == 1)
    filter<1>(term, x, noise);
  else if (size_ == 2)
    filter<2>(term, x, noise);
  else
    filter<3>(term, x, noise);
}

template <int S>
void LineCovariance::filter(const KernelTerm& term, const VectorXd& x, const VectorXd& noise) {
  Square<S> p = term.weight * line_stationary<S>();
  for (Index i = 0; i < x.size(); ++i) {
    if (gaps_[i] > 0) {
      const Square<S> f = line_propagator<S>(gaps_[i], decays_[i]);
      p = f * p * f.transpose() + term.weight * line_driven<S>(gaps_[i]);
    }
    const double r = noise[order_[static_cast<std::size_t>(i)]];
    const double variance = p(0, 0) + r;
    regular_ = regular_ && variance > 0;
    variances_[i] = variance;
    const State<S> gain = p.col(0) / variance;
    gains_.col(i) = gain;
    // Less gain·gainᵀ·variance; of what is observed itself without a difference.
    const State<S> observed = p.col(0) * (r / variance);
    p -= gain * p.row(0).eval();
    p.col(0) = observed;
    p.row(0) = observed.transpose();
  }
}

void LineCovariance::solve_in_place(Eigen::Ref<Eigen::MatrixXd> v) const {
  for (Index column = 0; column < v.cols(); ++column) {
    if (size_ == 1)
      solve_column<1>(v.col(column));
    else if (size_ == 2)
      solve_column<2>(v.col(column));
    else
      solve_column<3>(v.col(column));
  }
}

template <int S>
void LineCovariance::solve_column(Eigen::Ref<VectorXd> v) const {
  const Index count = variances_.size();
  State<S> mean = State<S>::Zero();
  for (Index i = 0; i < count; ++i) {
    mean = (line_propagator<S>(gaps_[i], decays_[i]) * mean).eval();
    double& value = v[order_[static_cast<std::size_t>(i)]];
    value -= mean[0];  // the innovation
    mean += gains_.col(i).template head<S>() * value;
  }
  State<S> adjoint = State<S>::Zero();  // of the mean
  for (Index i = count; i-- > 0;) {
    double& value = v[order_[static_cast<std::size_t>(i)]];
    value = value / variances_[i] + gains_.col(i).template head<S>().dot(adjoint);
    adjoint[0] -= value;
    adjoint = (line_propagator<S>(gaps_[i], decays_[i]).transpose() * adjoint).eval();
  }
}

}  // namespace pulson
