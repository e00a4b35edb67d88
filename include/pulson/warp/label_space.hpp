#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

/// The basis that interpolates the displacements of landmarks between their labels, see LabelSpace.
enum class LabelKernel {
  kMetric,     ///< the kernel of the flow: far from all landmarks nothing moves
  kThinPlate,  ///< |r|³, r² log r, −r in 1, 2, 3 dimensions and affine functions, which it reproduces
};

/// @throws InputError that lists `metric`, `thin-plate`
LabelKernel parse_label_kernel(std::string_view name);
std::string label_kernel_name(LabelKernel kernel);

/// Interpolation between labels: Σ_a c_a(x) δ_a with the cardinal functions c_a, c_a(x_b) = δ_ab, in the span of B
/// basis functions, the translates of a kernel to the labels and for the thin plate affine functions. Where the kernel
/// matrix is close to singular (condition above 1e12) a ridge of 1e-12 of its largest eigenvalue, reported by `ridge`,
/// is added to its diagonal: c_a(x_b) is then not quite δ_ab.
class LabelSpace {
 public:
  /// @param labels of the landmarks, d×N
  /// @throws InputError for the thin plate where all landmarks lie on a line or plane of less than d dimensions
  static std::unique_ptr<const LabelSpace> make(LabelKernel kernel, const KernelOperator& metric, const Points& labels);

  virtual ~LabelSpace() = default;

  double ridge() const { return ridge_; }

  /// Of the interpolant in the basis, d×B. @param displacements δ, d×N
  virtual Points coefficients(const Points& displacements) const = 0;

  /// The basis at positions x, B×M: the interpolant is coefficients times this. @param x d×M
  virtual Eigen::MatrixXd basis(const Points& x) const = 0;

  /// The gradient of the interpolant with given coefficients: column m is d×d, column-major.
  virtual Eigen::MatrixXd gradients(const Points& x, const Points& coefficients) const = 0;

 protected:
  double ridge_ = 0;
};

}  // namespace pulson
