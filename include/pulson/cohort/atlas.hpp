#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pulson/core/alignment.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/matching/objective.hpp"
#include "pulson/matching/robust_loss.hpp"

namespace pulson::cohort {

/// No default depends on the unit of length.
struct AtlasOptions {
  std::optional<KernelChoice> kernel{};  ///< none: matern32 of the width with the greatest likelihood
  std::optional<double> lambda{};        ///< weight of the energy; none: fitted
  /// Standard deviation of an observed coordinate, or per cent of the mean's diameter; none: fitted. 0: geodesics reach
  /// their targets.
  std::optional<Length> sigma{};
  /// β of noise `ch-sd` on every landmark, whose action is minimised with the energy (metamorphosis): 0 for none.
  Length beta = 0;
  /// Of each specimen onto the mean; none: similarity, on a line none. Any but `affine`.
  std::optional<AlignmentKind> align{};
  /// Of each landmark's distance from its prediction by the others of its shape; none: least squares. σ must not be 0.
  std::optional<matching::RobustLoss> loss{};
  int steps = 10;            ///< Runge–Kutta's of each geodesic
  double tolerance = 1e-8;   ///< converged where the template moves by no more, root mean square in diameters
  int max_iterations = 100;  ///< of the template
  std::function<void(int iteration, double movement)> on_iteration{};
  /// Makes the matches of one round where several processes share them: for each i from 0 to count − 1 what `match`
  /// makes has to come to `store`, on every process and with the same bits; the vectors of a round are of one length.
  /// Both may be called by several threads at once. None: all are made here, on all threads.
  std::function<void(int count, const std::function<Eigen::VectorXd(int i)>& match,
                     const std::function<void(int i, const Eigen::VectorXd& made)>& store)>
      share{};
};

/// One shape of an atlas and its match.
struct AtlasSpecimen {
  Landmarks shape;           ///< in its pose; missing coordinates are NaN
  double centroid_size = 0;  ///< of the shape as it was given
  /// w_a by the loss, in [0, 1], and v_a with which σ²/v_a is the variance of the noise: w_a/κ
  /// (matching::LossWeight), 0 where the landmark counts as missing. N of each; empty: no loss
  Eigen::VectorXd weights{}, precisions{};
  Points momenta;  ///< p0, d×N, at the template
  Points result;   ///< q(1), d×N
  matching::MatchingCost cost;
  double defect = 0;  ///< |q(1) + λσ²p(1)/v − y|, the largest, length units: the residual of the equation of the match
  bool converged = false;

  /// |q_a(1) − y_a|, NaN where the landmark is missing.
  Eigen::VectorXd distances() const;
  double rms() const;  ///< root mean square of these that there are, by their weights
  /// Landmarks of a weight below matching::kSuspectWeight, from 0.
  std::vector<int> suspects() const;
  Points without_suspects() const;  ///< the shape's points, NaN where a landmark is a suspect
};

/// A template q0 and the momenta of every specimen, which minimise together
///
///     Σ_i J_i,   J_i = λ∫H dt + ½∫|u|² dt + ½ Σ_a v_ia|q_ia(1) − y_ia|²/σ²,
///
/// over q0 and geodesics from there, v = 1 without a loss. Each specimen is in the pose in which its momenta contain
/// none, Zᵀp = 0 with the motion_directions() Z of q0 (for motions without scale the pose of least J_i, and the
/// geodesic is horizontal), and the template in that of the mean, with its size. By the envelope theorem ∂J_i/∂q0 =
/// −λp_i(0): at the minimum the momenta have the sum zero, and the template is the Fréchet mean of the specimens (X.
/// Pennec, "Intrinsic statistics on Riemannian manifolds", 2006).
struct Atlas {
  Landmarks mean;            ///< generalised Procrustes mean, from which the search starts
  Landmarks template_shape;  ///< q0
  AlignmentKind alignment = AlignmentKind::kNone;
  KernelOperator kernel{{KernelTerm{}}};
  double lambda = 1, sigma = 0, beta = 0;
  bool fitted_kernel = false, fitted_lambda = false, fitted_sigma = false;
  std::string loss{};  ///< with its constant; empty: none
  int steps = 0;
  std::vector<AtlasSpecimen> specimens;
  bool converged = false;
  int iterations = 0;   ///< of the template
  long shots = 0;       ///< geodesics shot in all
  double movement = 0;  ///< of template or a specimen in the last iteration, root mean square in diameters
  double step_error =
      0;  ///< root mean square change of the ends in twice the steps, largest over specimens, in diameters
  std::vector<std::string> notes;
  double seconds = 0;

  double nugget() const { return lambda * beta * beta; }
  /// A(q0) = K(q0) + λβ², N×N on each axis: the metric of momenta at the template; K(q0) without noise.
  Eigen::MatrixXd metric() const;

  /// The geodesic from the template with momenta p0 over [0, 1]. @throws StepError
  Trajectory geodesic(const Points& p0) const;

  /// Largest distance between targets and shot targets, over the template's diameter.
  double exp_log_error() const;
};

/// Estimates template and momenta together. From the generalised Procrustes mean, all specimens are matched in parallel
/// (Geodesics::match), each is moved by the pose in its momenta, and the template moves by (A + λσ²)p̄, p̄ the mean of
/// the momenta: Newton's step where displacements are small, with Anderson's acceleration. Cost O(n·N²·steps) for each
/// of some ten iterations.
/// @param shapes two or more, alike; landmarks that miss a coordinate are missing
/// @throws InputError where shapes do not fit together or an option is wrong
Atlas make_atlas(const std::vector<Landmarks>& shapes, const AtlasOptions& options = {});

}  // namespace pulson::cohort
