#pragma once

// Kernels as the paper defines them, in plain scalar code for any number type: what the library is tested against.
// A new row of kernel_table() needs one line in profile(); without it every contract below fails for that row.

#include <cctype>
#include <cmath>
#include <ostream>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include <Eigen/Core>
#include <ceres/jet.h>

#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

/// A constant as a number, a Jet, or a Jet of Jets.
template <class T>
T constant(double x) {
  if constexpr (std::is_floating_point_v<T>)
    return x;
  else
    return T(constant<typename T::Scalar>(x));
}

/// k(x), x = r/α.
template <class T>
T profile(const std::string& name, const T& x) {
  using std::exp;
  if (name == "gaussian") return exp(-x * x);
  if (name == "peakon") return exp(-x);
  if (name == "matern32") {
    const T t = constant<T>(std::sqrt(3.0)) * x;
    return (constant<T>(1) + t) * exp(-t);
  }
  if (name == "matern52") {
    const T t = constant<T>(std::sqrt(5.0)) * x;
    return (constant<T>(1) + t + t * t * constant<T>(1.0 / 3)) * exp(-t);
  }
  throw std::logic_error("kernel '" + name + "' has no definition in the tests");
}

struct DefinedTerm {
  std::string name;
  double alpha;
  double weight;
};

/// K(r) = Σ w k(r/α).
struct DefinedKernel {
  std::vector<DefinedTerm> terms;

  std::string spec() const {
    std::ostringstream text;
    for (const DefinedTerm& term : terms)
      text << (&term == terms.data() ? "" : "+") << term.name << ":alpha=" << term.alpha << ",weight=" << term.weight;
    return text.str();
  }

  KernelOperator make() const { return make_kernel(spec(), Points()); }

  template <class T>
  T value(const T& r) const {
    T sum = constant<T>(0);
    for (const DefinedTerm& term : terms)
      sum += constant<T>(term.weight) * profile(term.name, T(r / constant<T>(term.alpha)));
    return sum;
  }

  /// K, and ∇K = first·z, ∇²K = first·I + second zzᵀ from K' and K'', where a kink at r = 0 counts as flat. At small r
  /// the digits of smooth kernels cancel, hence long double.
  RadialJet factors(double r) const {
    using Jet = ceres::Jet<long double, 1>;
    RadialJet sum;
    for (const DefinedTerm& term : terms) {
      const long double alpha = term.alpha;
      const ceres::Jet<Jet, 1> x(Jet(r / alpha, 0), 0);
      const ceres::Jet<Jet, 1> k = profile(term.name, x);
      const long double slope = term.weight / alpha * k.v[0].a;
      const long double curvature = term.weight / (alpha * alpha) * k.v[0].v[0];
      sum.value += static_cast<double>(term.weight * k.a.a);
      if (r == 0) {
        sum.first += slope == 0 ? static_cast<double>(curvature) : 0;
      } else {
        sum.first += static_cast<double>(slope / r);
        sum.second += static_cast<double>((curvature - slope / r) / r / r);
      }
    }
    return sum;
  }

  /// Whether ∇K is continuous at 0.
  bool smooth() const {
    for (const DefinedTerm& term : terms)
      if (std::abs(profile(term.name, ceres::Jet<double, 1>(0, 0)).v[0]) > 1e-12) return false;
    return true;
  }
};

inline std::ostream& operator<<(std::ostream& out, const DefinedKernel& kernel) { return out << kernel.spec(); }

/// Every row of the table, and a sum of all with widths and weights of their own.
inline std::vector<DefinedKernel> every_kernel() {
  std::vector<DefinedKernel> kernels;
  DefinedKernel sum;
  for (const auto& row : kernel_table().rows()) {
    kernels.push_back({{{row.name, 0.7, 1}}});
    const auto i = static_cast<double>(sum.terms.size());
    sum.terms.push_back({row.name, (4 + 2 * i) / 10, (15 - 2 * i) / 10});
  }
  kernels.push_back(sum);
  return kernels;
}

/// A specification as part of a test's name.
inline std::string test_name(std::string text) {
  for (char& letter : text)
    if (std::isalnum(static_cast<unsigned char>(letter)) == 0) letter = '_';
  return text;
}

template <class T>
using PointsOf = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic>;

/// K(q_i − q_j)
template <class T>
T kernel_between(const DefinedKernel& kernel, const PointsOf<T>& q, Eigen::Index i, Eigen::Index j) {
  using std::sqrt;
  if (i == j) return kernel.value(constant<T>(0));
  T squared = constant<T>(0);
  for (Eigen::Index axis = 0; axis < q.rows(); ++axis) squared += (q(axis, i) - q(axis, j)) * (q(axis, i) - q(axis, j));
  return kernel.value(T(sqrt(squared)));
}

/// u_i = Σ_j K(q_i − q_j) p_j, (2).
template <class T>
PointsOf<T> velocities(const DefinedKernel& kernel, const PointsOf<T>& q, const PointsOf<T>& p) {
  PointsOf<T> u = PointsOf<T>::Constant(q.rows(), q.cols(), constant<T>(0));
  for (Eigen::Index i = 0; i < q.cols(); ++i)
    for (Eigen::Index j = 0; j < q.cols(); ++j) u.col(i) += kernel_between(kernel, q, i, j) * p.col(j);
  return u;
}

/// H = ½ Σ_a p_a·u_a, (12).
template <class T>
T energy(const DefinedKernel& kernel, const PointsOf<T>& q, const PointsOf<T>& p) {
  const PointsOf<T> u = velocities(kernel, q, p);
  T twice = constant<T>(0);
  for (Eigen::Index i = 0; i < q.size(); ++i) twice += p(i) * u(i);
  return constant<T>(0.5) * twice;
}

/// d×N numbers between −1 and 1.
inline Points random_points(int dimension, int count, unsigned seed) {
  std::mt19937_64 bits(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  return Points::NullaryExpr(dimension, count, [&] { return uniform(bits); });
}

}  // namespace pulson
