#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson {

/// The shape of a radial kernel k(r) with k(0) = 1; α is the width in landmark length units. Matérn's of order ν = 3/2
/// and 5/2 belong to the Sobolev spaces of order ν + d/2.
enum class KernelProfile {
  kGaussian,  ///< exp(−r²/α²), C^∞
  kPeakon,    ///< exp(−r/α), with K'(0) := 0
  kMatern32,  ///< (1 + x) exp(−x), x = √3 r/α; K is C²
  kMatern52,  ///< (1 + x + x²/3) exp(−x), x = √5 r/α; K is C⁴
};

/// One term w·k(r/α) of a kernel.
struct KernelTerm {
  KernelProfile profile = KernelProfile::kGaussian;
  double alpha = 1;
  double weight = 1;
};

/// A radial kernel and its derivatives at one difference z: K = value, ∇K = first·z, ∇²K = first·I + second·z zᵀ.
struct RadialJet {
  double value = 0;
  double first = 0;
  double second = 0;
};

/// The order of the dN coordinates of N landmarks in a dense matrix.
enum class CoordinateOrder {
  kByLandmark,  ///< index a·d + axis
  kByAxis,      ///< index axis·N + a
};

/// ΔtK, N×N, and ΔtA and ΔtH_qq, dN×dN, for direct solves; see KernelOperator.
struct StepMatrices {
  Eigen::MatrixXd gram;
  Eigen::MatrixXd tangent;
  Eigen::MatrixXd hessian;
};

/// Velocities and forces of landmarks, d×N each: H_p and H_q, or their derivatives.
struct Flow {
  Points velocity;
  Points force;
};

/// The kernel sums on which everything else is built, for K(z) = Σ_terms w k(|z|/α) in d = 1, 2, 3 dimensions.
///
/// Points, momenta and displacements are d×N. Sums over pairs are vectorised over targets with run-time dispatch (SSE4,
/// AVX2, AVX-512), each target's sum taken over the sources in their order: the result does not depend on the number of
/// lanes beyond rounding, as products are fused where the target can, nor on the number of threads at all. Sources
/// whose momentum is zero cost nothing. Cost O(NM), and O((N + M) log N) where many points are on a line and no term is
/// gaussian; O(N) memory unless stated. All methods are thread-safe.
class KernelOperator {
 public:
  /// @throws InputError if there is no term, a width is not within 1e-70 to 1e70 or a weight not finite and positive.
  explicit KernelOperator(std::vector<KernelTerm> terms);

  const std::vector<KernelTerm>& terms() const { return terms_; }

  /// The specification that makes this kernel: `gaussian:alpha=0.25`. With the 17 digits of the default it makes the
  /// same kernel to the last bit; fewer are for people.
  std::string spec(int digits = 17) const;

  /// K(0), the sum of the weights.
  double at_zero() const;

  /// sup |K'|, the Lipschitz constant of K (a bound for sums): √(2/e)/α gaussian, 1/α peakon, √3/(eα) matern32,
  /// √5 φ³ exp(−φ)/(3α) matern52, φ the golden ratio.
  double lipschitz() const;

  RadialJet jet(double squared_distance) const;

  /// The velocity field u(x_i) = Σ_j K(x_i − y_j) p_j, (2). @param x d×M @param y, p d×N @return d×M
  Points apply(const Points& x, const Points& y, const Points& p) const;

  /// u(x_i) and its gradient: jacobian column i is ∂u/∂x at x_i, d×d in column-major order. @return u, d×M
  Points apply_with_jacobian(const Points& x, const Points& y, const Points& p, Eigen::MatrixXd& jacobian) const;

  /// A δ, the derivative of q ↦ K(q)p along δ: (Aδ)_i = Σ_j p_j ∇K(q_i − q_j)·(δ_i − δ_j). With H = ½ p·K(q)p, A =
  /// H_pq.
  Points apply_tangent(const Points& q, const Points& p, const Points& delta) const;

  /// ∂/∂q of Σ_ij a_i·p_j K(q_i − q_j): column i is Σ_j (a_i·p_j + p_i·a_j) ∇K(q_i − q_j). This is Aᵀa = H_qp a, and
  /// H_q = ½ gradient(q, p, p).
  Points gradient(const Points& q, const Points& a, const Points& p) const;

  /// H_qq δ: column i is Σ_j (p_i·p_j) ∇²K(q_i − q_j)(δ_i − δ_j).
  Points hessian(const Points& q, const Points& p, const Points& delta) const;

  /// H_p = K(q)p and H_q, from one pass over the pairs. @param q, p d×N
  Flow flow(const Points& q, const Points& p) const;

  /// Their derivatives along (δq, δp), Aδq + K δp and H_qq δq + Aᵀδp, from one pass over the pairs.
  Flow flow_tangent(const Points& q, const Points& p, const Points& dq, const Points& dp) const;

  /// K(x_i − y_j), M×N.
  Eigen::MatrixXd gram(const Points& x, const Points& y) const;

  /// The matrices of a time step, from one pass over the pairs. O((dN)²) memory.
  StepMatrices step_matrices(const Points& q, const Points& p, double dt,
                             CoordinateOrder order = CoordinateOrder::kByLandmark) const;

 private:
  std::vector<KernelTerm> terms_;
};

using MakeKernelTerm = std::function<KernelTerm(const Parameters&, double automatic_alpha)>;

/// Kernels by name; see `pulson info kernels`.
const NameTable<MakeKernelTerm>& kernel_table();

/// The width chosen by `alpha=auto`: half the median distance between two landmarks of the source, but at most
/// twice the median distance to a nearest neighbour. So momenta move regions of the shape rather than single points or
/// the whole, and the kernel matrix of a densely sampled outline stays regular (the gaussian's condition grows like
/// exp((πα/2s)²), s the spacing; a Matérn kernel's like (α/s)^(2ν + 1)).
double automatic_alpha(const Points& source);

/// The kernel of a specification such as `gaussian:alpha=0.4+peakon:alpha=0.1,weight=0.5`; `source` serves alpha=auto.
/// @throws InputError
KernelOperator make_kernel(std::string_view spec, const Points& source = {});

/// A kernel as options take it: a specification or the kernel itself.
class KernelChoice {
 public:
  // NOLINTBEGIN(google-explicit-constructor): either is a kernel
  KernelChoice(const char* spec) : spec_(spec) {}
  KernelChoice(std::string spec) : spec_(std::move(spec)) {}
  KernelChoice(KernelOperator kernel) : spec_(kernel.spec()), kernel_(std::move(kernel)) {}
  // NOLINTEND(google-explicit-constructor)

  /// As it was given; of a kernel its own.
  const std::string& spec() const { return spec_; }
  /// @param source serves alpha=auto @throws InputError as make_kernel()
  KernelOperator make(const Points& source) const { return kernel_ ? *kernel_ : make_kernel(spec_, source); }

 private:
  std::string spec_;
  std::optional<KernelOperator> kernel_;
};

/// Name of the vector instruction set that the kernel sums use on this machine: "AVX3", "AVX2", "SSE4", …
std::string vector_target();

}  // namespace pulson
