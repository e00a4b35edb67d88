#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/integrators/integrator.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson::warp {

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

/// Whether a map folds at a point: where its exact Jacobian is negative. Alignments and frames that mirror all of space
/// do not count.
inline bool is_fold(double jacobian) { return jacobian < 0; }

/// Images of points under the map, and the gradient of the map there.
struct MovedPoints {
  Points places;              ///< d×M
  Eigen::MatrixXd gradients;  ///< column m: ∂X(T)/∂x at x_m, d×d in column-major order

  /// det ∂X(T)/∂x, M numbers.
  Eigen::VectorXd jacobians() const;
  /// Of the points, those where the map folds; 0 of none.
  double folded_fraction() const;
};

/// The motion of every point of space under a landmark path. A step moves the point with label x (its position at t =
/// 0) by the same stages as the landmarks, see SpaceStep; of the variational integrators
///
///     X⁺ = X + Δt (Σ_b K(X⁺ − q_b⁺) p_b + η(X⁺)) + Σ_i ξ_i(X) w_i + Σ_a c_a(x) δ_a,   X(0) = x
///
/// where ξ_i are the fields of a noise whose displacement is one over space (P-SD, Kunita's about the landmarks of the
/// stage) and η what compensates them; δ_a is what a displacement of landmarks did to landmark a in this step, and c_a
/// the cardinal functions of interpolation in label space: each object moves with its interior, so two of them pass
/// through each other cleanly. The map is a diffeomorphism where all δ = 0, otherwise it may fold. Methods run on all
/// threads.
class MaterialFlow {
 public:
  /// @throws StepError where a step is too long for the space between the landmarks; std::logic_error where the noise
  /// declares a field over space that is not what moves landmarks
  MaterialFlow(StochasticSystem system, Trajectory path, LabelKernel labels = LabelKernel::kMetric);

  /// Places of the labelled points at every time of the path. @param labels d×M @return K+1 matrices d×M @throws
  /// StepError where a step is too long for a point
  std::vector<Points> paths(const Points& labels) const;

  /// Places at the end of the path, d×M.
  Points end(const Points& labels) const;

  /// The same with the gradient, by the tangent of every step.
  MovedPoints end_with_gradients(const Points& labels) const;

  int dimension() const { return static_cast<int>(path_.initial().q.rows()); }
  const Trajectory& path() const { return path_; }
  const StochasticSystem& system() const { return system_; }

  /// Whether nothing is interpolated in label space.
  bool is_diffeomorphic() const { return labels_ == nullptr; }

  /// The labels of the points that end at given positions: every step solved backwards, to round-off. @throws
  /// InputError where the map is not a diffeomorphism; StepError where a step has no inverse
  MovedPoints inverse(const Points& places) const;

  /// The largest distance of a landmark, moved as a point of space, from its own end: round-off but for the ridge.
  double landmark_error() const;

  /// Of the interpolation in label space; 0 where there is none.
  double ridge() const { return labels_ ? labels_->ridge() : 0; }

 private:
  MovedPoints moved(const Points& labels, bool with_gradients) const;
  std::vector<std::vector<Points>> landmark_displacements() const;
  void check_fields() const;
  void check_landmarks(const std::vector<std::vector<Points>>& displacements) const;

  StochasticSystem system_;
  Trajectory path_;
  std::vector<SpaceStep> steps_;
  std::unique_ptr<const LabelSpace> labels_;  ///< none where no landmark is moved by noise of its own
  /// By step and row of its table: displacements of the landmarks only, as coefficients in label space, d×B; empty
  /// where none.
  std::vector<std::vector<Points>> label_coefficients_;
};

}  // namespace pulson::warp
