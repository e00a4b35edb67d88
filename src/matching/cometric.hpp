#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Sparse>

#include "dynamics/effective_hamiltonian.hpp"
#include "kernels/line_covariance.hpp"

namespace pulson::matching {

/// Σ_i h_i,p h_i,pᵀ of a noise model at one configuration, dN×dN (index a·d + axis), or N×N where it is the same for
/// each axis and couples none to another.
struct NoiseCometric {
  Eigen::SparseMatrix<double> matrix;
  bool isotropic = true;
};

NoiseCometric noise_cometric(const NoiseModel& noise, const Points& q);

/// The landmark that each channel moves alone, where the noise declares that of all its channels; else empty.
/// @param q d×N
std::vector<Eigen::Index> landmarks_of_channels(const NoiseModel& noise, const Points& q);

/// ε K(0): a trace of noise on every landmark, which makes the problem without noise regular where K is singular in
/// working precision: momenta p move their landmarks by εK(0)p T besides.
double regularisation(const KernelOperator& kernel);

/// Whether K + λ·noise is solved by sweeps along a line: K a peakon or a Matérn 3/2, noise of each landmark alone,
/// many landmarks.
bool sweeps_along_line(const KernelOperator& kernel, const NoiseCometric& noise, const Points& q);

/// Whether noise moves each landmark on a line, by itself.
bool moves_each_along_line(const NoiseCometric& noise, const Points& q);

/// The cometric A(q) = K(q) + λ Σ_i h_i,p h_i,pᵀ + εK(0) of H_tot = ½ p·A(q)p, and its Cholesky factors, or its
/// sweeps along a line.
class Cometric {
 public:
  /// @param noise λ times it is added
  Cometric(const KernelOperator& kernel, const NoiseCometric& noise, double lambda, const Points& q);

  /// Whether the matrix is positive definite to working accuracy.
  bool is_regular() const { return regular_; }

  /// Whether there are sweeps in place of a matrix: these, and what they add to K, by landmark.
  bool is_on_line() const { return line_.has_value(); }
  const LineCovariance& line() const { return *line_; }
  const Eigen::VectorXd& own() const { return own_; }

  Points apply(const Points& p) const;  ///< Ap
  Points solve(const Points& v) const;  ///< A⁻¹v

  /// Adds Δt ΨAΨᵀ, Ψ block-diagonal, of landmark b and those before it.
  /// @param psi N×d², each row a block in column-major order
  /// @param sum (b+1)×d², row a: the block (a, b) in column-major order
  void add_transformed(const Eigen::MatrixXd& psi, double dt, Eigen::Index b, Eigen::MatrixXd& sum) const;

 private:
  Eigen::Index dimension_;
  bool isotropic_;
  bool regular_;
  /// Of column b of A, the part of axis l in the columns of axis m: the rows of landmarks up to b.
  Eigen::VectorXd column(Eigen::Index l, Eigen::Index m, Eigen::Index b) const;

  KernelOperator kernel_;
  Points q_;
  Eigen::VectorXd own_;
  std::optional<LineCovariance> line_;
  Eigen::MatrixXd matrix_;    ///< its lower triangle L with LLᵀ = A, above the diagonal A
  Eigen::VectorXd diagonal_;  ///< of A
};

}  // namespace pulson::matching
