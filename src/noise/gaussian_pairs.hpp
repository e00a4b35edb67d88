#pragma once

#include <array>
#include <cmath>

#include "pulson/dynamics/noise_model.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

inline double value_of(double x) { return x; }
inline double value_of(const Dual& x) { return x.value; }

/// e^x of the value that is known.
inline double with_change(double value, double /*x*/) { return value; }
inline Dual with_change(double value, const Dual& x) { return {value, value * x.change}; }

/// visit(a, b, z, e) for the pairs a < b of landmarks, z = q_a − q_b, d numbers, and e = exp(−|z|²/c), in any scalar;
/// the exponentials are those of vector code.
template <class T, class Visit>
void for_each_gaussian_pair(const MatrixOf<T>& q, const T& c, const Visit& visit) {
  const Eigen::Index d = q.rows(), n = q.cols();
  const Points places = q.unaryExpr([](const T& x) { return value_of(x); });
  const Eigen::MatrixXd gram =
      KernelOperator({{.profile = KernelProfile::kGaussian, .alpha = std::sqrt(value_of(c)), .weight = 1}})
          .gram(places, places);
  const T slope = T(-1) / c;
  const T* const x = q.data();
  std::array<T, 3> z{};
  for (Eigen::Index b = 1; b < n; ++b)
    for (Eigen::Index a = 0; a < b; ++a) {
      T squared(0);
      for (Eigen::Index j = 0; j < d; ++j) {
        T& along = z[static_cast<std::size_t>(j)];
        along = x[a * d + j] - x[b * d + j];
        squared += along * along;
      }
      visit(a, b, z.data(), with_change(gram(a, b), slope * squared));
    }
}

}  // namespace pulson
