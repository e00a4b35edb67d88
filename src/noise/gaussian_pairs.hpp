#pragma once

#include <array>
#include <cmath>
#include <type_traits>

#include "noise/pair_noises_body.hpp"
#include "pulson/dynamics/noise_model.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

inline double value_of(double x) { return x; }
inline double value_of(const Dual& x) { return x.value; }

/// e^x of the value that is known.
inline double with_change(double value, double /*x*/) { return value; }
inline Dual with_change(double value, const Dual& x) { return {value, value * x.change}; }

/// exp(−|q_a − q_b|²/c) for pairs of landmarks, in any scalar; their values are those of vector code.
template <class T>
class GaussianExponentials {
 public:
  GaussianExponentials(const MatrixOf<T>& q, const T& c) : slope_(T(-1) / c) {
    const Points places = q.unaryExpr([](const T& x) { return value_of(x); });
    gram_ = KernelOperator({{.profile = KernelProfile::kGaussian, .alpha = std::sqrt(value_of(c)), .weight = 1}})
                .gram(places, places);
  }

  /// @param squared |q_a − q_b|²
  T operator()(std::size_t a, std::size_t b, const T& squared) const {
    return with_change(gram_(static_cast<Eigen::Index>(b), static_cast<Eigen::Index>(a)), slope_ * squared);
  }

 private:
  T slope_;
  Eigen::MatrixXd gram_;
};

/// visit(a, b, z, e) for the pairs a < b of landmarks, z = q_a − q_b, d numbers, and e = exp(−|z|²/c).
template <class T, class Visit>
void for_each_gaussian_pair(const MatrixOf<T>& q, const T& c, const Visit& visit) {
  const GaussianExponentials<T> exponentials(q, c);
  std::array<T, 3> z{};
  for (Eigen::Index b = 1; b < q.cols(); ++b)
    for (Eigen::Index a = 0; a < b; ++a) {
      T squared(0);
      for (Eigen::Index j = 0; j < q.rows(); ++j) {
        T& along = z[static_cast<std::size_t>(j)];
        along = q(j, a) - q(j, b);
        squared += along * along;
      }
      visit(a, b, z.data(), exponentials(static_cast<std::size_t>(b), static_cast<std::size_t>(a), squared));
    }
}

/// What the formulas of pair_noises_body.hpp need, for potentials with exp(−|z|²/range).
template <class T>
HWY_NAMESPACE::PairNoiseConstants<T> pair_noise_constants(const T& beta, const T& range) {
  return {T(0), beta, T(0.25) * beta * beta, T(-2) / range};
}

/// task(d) for d = 1, 2 or 3, as a constant.
template <class Task>
void with_dimension(Eigen::Index d, const Task& task) {
  if (d == 1) task(std::integral_constant<int, 1>());
  if (d == 2) task(std::integral_constant<int, 2>());
  if (d == 3) task(std::integral_constant<int, 3>());
}

}  // namespace pulson
