#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pulson/core/alignment.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/matching/objective.hpp"
#include "pulson/matching/robust_loss.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::matching {

/// What is given before the width and weight of the model are fitted.
struct DisplacementOptions {
  KernelProfile profile = KernelProfile::kMatern32;
  AlignmentKind alignment = AlignmentKind::kNone;  ///< that was taken out of the displacements, and has a flat prior
  double sigma = 0;                ///< standard deviation of an observed coordinate, length units; must be given
  std::optional<double> lambda{};  ///< none: fitted
  Eigen::VectorXd weights{};       ///< w of landmarks; empty: all 1; those of weight 0 are left out
  std::vector<Eigen::MatrixXd> covariances{};  ///< R of landmarks, instead of σ²I
};

/// A kernel and the weight of the energy, fitted to one pair of shapes.
struct DisplacementModel {
  KernelTerm kernel;
  double lambda = 1;            ///< 1/(length units)²: displacements have the standard deviation λ^{-½}
  double log_likelihood = 0;    ///< restricted, up to a constant
  double prediction_error = 0;  ///< root mean square distance of a left-out landmark from its prediction, length units,
                                ///< by the weights
  double alignment_error = 0;   ///< the same of its prediction by the alignment alone
  Eigen::Index landmarks = 0;   ///< that it was fitted to
};

/// Fits the linearised matching problem to the displacements y − q0 of the landmarks: to first order in the momenta
/// p0 ~ N(0, (λK)⁻¹), each axis of the displacement is a Gaussian process over q0,
///
///     y − q0 = Zb + f + e,   f ~ N(0, K_α(q0)/λ),   e_a ~ N(0, R_a/w_a),   R_a = σ²I unless it is given,
///
/// with the directions Z of the alignment (motion_directions()) and any b. α and λ maximise the restricted likelihood
/// (REML; H. Patterson and R. Thompson 1971), in which b is integrated out:
///
///     −½ [log det V + log det ZᵀV⁻¹Z + rᵀPr],   V = K/λ + R/w,   P = V⁻¹ − V⁻¹Z(ZᵀV⁻¹Z)⁻¹ZᵀV⁻¹
///
/// over widths of 0.1 to 0.4 diameters of q0 in steps of a fifth. Narrower kernels, which dense outlines would take,
/// move landmarks individually and leave the space between them in place. The prediction errors are those of universal
/// kriging, exact without refitting b and f: |(P_aa)⁻¹(Pr)_a| for landmark a.
///
/// Landmarks that have a missing coordinate in either shape, or weight 0, are left out; of more than 128 landmarks
/// every few are taken.
/// @param source d×N, after the alignment @param target d×N
/// @return none where there are fewer than four coordinates more than directions of the alignment
/// Cost O(n³) for n ≤ 128 landmarks, some 20 times; d³ times as much with covariances.
std::optional<DisplacementModel> fit_displacements(const Points& source, const Points& target,
                                                   const DisplacementOptions& options);

/// What is minimised over, and what becomes of the noise.
enum class MatchingMode {
  kDeterministic,  ///< p0; there is no noise
  kMetamorphosis,  ///< p0 and the increments, the energy being paid for along the path: EffectiveHamiltonian
  kMap,            ///< p0 and the increments, the energy being paid for at t = 0: the noise is a control
  kPathwise,       ///< p0, for one frozen realisation of the noise
  kExpected,       ///< p0, with the data term's mean over frozen realisations
};

/// @throws InputError that lists `deterministic`, `metamorphosis`, `map`, `pathwise`, `expected`
MatchingMode parse_mode(std::string_view name);
std::string mode_name(MatchingMode mode);

/// What the target says.
enum class DataKind {
  kLandmarks,  ///< where each landmark of the source should be: LandmarkTerm
  kVarifold,   ///< the curve along which the source's should lie: CurveTerm
  kCurrent,    ///< the same for curves with a direction
};

/// @throws InputError that lists `landmarks`, `varifold`, `current`
DataKind parse_data_kind(std::string_view name);
std::string data_kind_name(DataKind kind);

struct DataOptions {
  DataKind kind = DataKind::kLandmarks;
  std::optional<double> width{};               ///< of curves; default: automatic_data_width() of the target
  CurveEnds ends = CurveEnds::kAuto;           ///< of curves
  Eigen::VectorXd weights{};                   ///< of landmarks; empty: all 1
  std::vector<Eigen::MatrixXd> covariances{};  ///< of landmarks, instead of σ²I
  /// Whether to merge landmarks at the same position in the source that differ in the target; their target is the mean
  /// of theirs; else they are refused. Those at one place in both shapes always become one, and so do points of curves
  /// at one place in the source.
  bool merge_coincident = false;
  bool by_order = false;  ///< whether landmarks correspond by their order in the files, whatever their names
};

/// Everything that defines a registration. No default depends on the unit of length.
struct RegistrationOptions {
  /// `auto`: `matern32` with a width, and where none is given a weight λ, of greatest likelihood: fit_displacements();
  /// of one diameter for few landmarks, which cannot show one, and of a quarter for curves
  KernelChoice kernel = "auto";
  NoiseChoice noise = "none";
  /// Default: without noise `deterministic`; `metamorphosis` where its potentials are linear in p, unless
  /// `uncertainty` is asked for; else `map`.
  std::optional<MatchingMode> mode{};
  /// `auto`: `variational`, that of (20), with solver `shooting` and in modes pathwise and expected; else `rk4` in mode
  /// deterministic, whose geodesic it shoots; `midpoint` in mode metamorphosis and for curves; else `variational-2`
  std::string integrator = "auto";
  TimeGrid grid{};
  /// Whether paths are searched for, and shot, in twice, four or eight times as many steps where those of the grid
  /// change J by more than 0.3 %; under drawn noise up to 64 times, where its steps do not contract or change J by more
  /// than 1 %.
  bool more_steps = false;
  Length sigma = Length::percent(0.5);  ///< per cent of the diameter of the aligned source
  std::optional<double> lambda{};       ///< none: fitted with `kernel = auto`, else 1/diameter² of the aligned source
  /// none: `similarity` in the plane and in space, `none` on a line
  std::optional<AlignmentKind> align{};
  bool reflect = false;  ///< whether the alignment may be a reflection
  DataOptions data{};
  /// Of landmarks in place of least squares: σ, of at least `sigma`, and weights are fitted. None: least squares
  std::optional<RobustLoss> loss{};
  std::uint64_t seed = 1;    ///< of frozen realisations and of the disturbance of the start
  int samples = 16;          ///< frozen realisations of mode `expected`
  bool uncertainty = false;  ///< whether laplace() is to be recorded
  MinimiseOptions minimise{};
};

/// What an accurate integrator makes of the momenta: Runge–Kutta of order 4 in at least twice the steps. Of a path in
/// midpoint steps it solves the flow of EffectiveHamiltonian, whose controls λh(q, p) follow from p0; else the controls
/// are those of the record, constant in each of its steps.
struct DiscretisationError {
  double rms = 0;   ///< root mean square distance of its end points to those recorded, length units
  double cost = 0;  ///< J of its path less J
};

/// J for steps that tend to 0: Richardson's extrapolation from the recorded steps and half as many.
struct ExtrapolatedCost {
  MatchingCost cost;
  int coarse_steps = 0;  ///< the fewer of the two
  /// The lesser of its distances to J in the recorded steps, and to the extrapolation before: what may be left.
  double error = 0;
};

/// How far each landmark is believed, where there is a loss: DataOptions::weights has them times those given, over κ.
struct RobustWeights {
  std::string loss;         ///< specification
  Eigen::VectorXd weights;  ///< N, in [0, 1]
};

/// The record of a registration: all that is needed to replay it, and what it cost. Its JSON form is
/// `registration.json`.
struct Registration {
  std::string kernel;
  std::string noise;
  /// The model, where it is not one that make_noise() makes of `noise`: of the options' own; no part of the record.
  std::shared_ptr<const NoiseModel> own_noise{};
  MatchingMode mode = MatchingMode::kDeterministic;
  std::string integrator;
  TimeGrid grid;
  double sigma = 0;
  double lambda = 0;
  DataOptions data;  ///< its width is set where the data are curves
  std::uint64_t seed = 1;
  int samples = 1;      ///< realisations: path s has the increments realisation(…, seed, s)
  Alignment alignment;  ///< moved the original source to `source`
  std::optional<DisplacementModel> fitted_kernel;  ///< where the kernel was fitted to the landmarks
  std::optional<RobustWeights> robust;             ///< where a loss was asked for
  Landmarks source;                                ///< q0: the source after alignment, where the flow begins
  Landmarks original;  ///< the source as it was given, but for landmarks that have a missing coordinate
  Landmarks target;
  Points result;  ///< q(T), d×N; in mode `expected` its mean
  Points spread;  ///< d×N, standard deviation of q(T) over the realisations; empty for one
  /// p0, d×N. Where there are `states`, the momenta whose accurate shot ends where they do, if such can be had
  /// (step_error); else those of the first of them.
  Points momenta;
  Eigen::MatrixXd increments;  ///< ΔW, C×K; 0 in mode `expected`, which has many
  /// The K + 1 states of a path in midpoint steps that was searched for as such: the result. Else none, and the result
  /// is a shot of the momenta.
  std::vector<PhaseState> states;
  MatchingCost cost;
  Solver solver = Solver::kAuto;
  bool converged = false;
  std::string stop_reason;
  int iterations = 0;
  int evaluations = 0;
  Eigen::Index unknowns = 0;
  double relative_gradient = 0;
  /// Of searches over paths from several starts, see global_search.hpp: the recorded one first, with the recorded J,
  /// then by their cost. J of the others is as known in the steps that these searches take, in proportion. Empty for
  /// other searches.
  std::vector<Minimum> minima;
  /// None in mode `expected`, and where a shot leaves the path.
  std::optional<DiscretisationError> step_error;
  std::optional<ExtrapolatedCost> extrapolated;  ///< of a shot, in the modes without drawn noise
  /// Of drawn noise: root mean square distance over which it moves a landmark that is at rest, length units.
  std::optional<double> noise_displacement;
  /// By how much shooting the momenta amplifies errors: the largest singular value of ∂q(T)/∂q0, where p0 and the
  /// increments are kept (an estimate); without noise, of the landmarks that have momenta. None in mode `expected`.
  std::optional<double> amplification;
  std::vector<std::string> notes;  ///< what a user should know, a line each
  std::optional<LaplaceApproximation> uncertainty;
  double seconds = 0;

  /// |q_a(T) − y_a| of each landmark over the coordinates observed, NaN where there are none; for curves the distance
  /// to the nearest point of the target's.
  Eigen::VectorXd distances() const;
  /// Root mean square of the distances that there are, with a loss by its weights, length units; in mode `expected`
  /// over the realisations too.
  double rms() const;
  /// The same before the flow: of the aligned source to the target.
  double initial_rms() const;
  /// The same before the alignment.
  double original_rms() const;
  double max_residual() const;
  /// √(r_aᵀR_a⁻¹r_a) of each landmark's r = q(T) − y, with R = σ² where neither weights nor covariances say otherwise;
  /// NaN where nothing is observed. For curves the distance over σ.
  Eigen::VectorXd residuals_over_sigma() const;
  /// Landmarks that are too far from their targets for one of so many: by more than largest_of_chi() in units of σ, or
  /// of a sixtieth of the distance before, if that is more: of both, rms may be three. None of curves.
  std::vector<int> unmatched_landmarks() const;
  /// Whether the shapes were brought together: rms is at most 3σ, or a twentieth of what it was, and there are no
  /// unmatched_landmarks(). A minimum that leaves them further apart is reported as no match.
  bool matched() const;
};

/// Fits momenta, and the noise where the mode says so, so that `source` flows to `target`. With a loss the weights of
/// landmarks begin at those of the linear model (src/matching/robust_fit.hpp), and then follow from the residuals until
/// they settle, by a fit each. Landmarks of the source that have a missing coordinate (NaN) are left out; coordinates
/// that the target misses drop out of the data.
/// @throws InputError where the shapes do not fit together or an option is wrong
Registration register_shapes(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options = {});

/// The system and path of a registration, whose states are kept or shot again: the same bits as when it was fitted, on
/// the same build. In mode `expected` the path is the mean of those of the realisations. Of a shot in mode
/// metamorphosis the system is that of H_tot, which has no channels.
StochasticSystem registration_system(const Registration& registration);
Trajectory replay(const Registration& registration);

/// The noise model of a registration.
std::shared_ptr<const NoiseModel> registration_noise(const Registration& registration);

/// Pairs of landmarks on a line whose order differs between the two sets. @param before, after 1×N
int order_inversions(const Points& before, const Points& after);

/// Of these pairs those whose order is that of `after` in `end`, too: which of the exchanges that a target asks for a
/// path makes. @param end 1×N
int exchanged_as_asked(const Points& before, const Points& after, const Points& end);

/// The contribution of flow and noise to each landmark's displacement, and its share of the cost.
struct LandmarkShares {
  /// d×N: displacement by the flow of the same momenta without noise; empty where its steps have no root.
  Points flow;
  /// d×N: displacement by the noise, q(T) − q0 − flow; empty where `flow` is.
  Points noise;
  Eigen::VectorXd energy;  ///< N, (λ/2) p_a·v_a: the energy is their sum
  /// N, ½ Σ_k |ΔW_k|²/Δt over the channels that move this landmark; empty where a channel moves several, or there is no
  /// action.
  Eigen::VectorXd action;
  Eigen::VectorXd data;  ///< N, the landmark's share of D; empty for curves
};

LandmarkShares landmark_shares(const Registration& registration);

/// The fraction of the displacement due to the noise: Σ_a noise_a·(q_a(T) − q_a(0)) / Σ_a |q_a(T) − q_a(0)|²; none if
/// nothing moves.
std::optional<double> noise_fraction(const Registration& registration, const LandmarkShares& shares);

/// The match of a pair with noise of one amplitude.
struct HomotopyStep {
  double beta = 0;  ///< of the noise; of a sum that of its first term: all are scaled alike
  MatchingCost cost;
  double rms = 0;  ///< length units
  bool matched = false;
  bool converged = false;
  int iterations = 0;            ///< of all searches at this β
  std::vector<int> unmatched{};  ///< Registration::unmatched_landmarks()

  /// The fraction by which J would grow if β were halved, to first order: dJ/d ln β = −2·action.
  double growth() const;
};

/// How far from diffeomorphic a pair is: J(β) in mode metamorphosis while β is halved ten times; of a sum, every number
/// that NoiseModel::amplitudes() lists. At each β the least of what register_shapes() finds there and of the minima
/// next to the paths of the β above and below. J never falls as β does: where a diffeomorphism matches, it grows to
/// that of LDDMM; else without bound, or until the match is lost. (design: mathematics §4.1)
/// @param registration what register_shapes() made of the other arguments
/// @throws InputError where the mode is not metamorphosis, or the noise lists no amplitude
std::vector<HomotopyStep> follow_homotopy(const Landmarks& source, const Landmarks& target,
                                          const RegistrationOptions& options, const Registration& registration);

/// @throws InputError where follow_homotopy() would
void require_homotopy(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options);

/// The last step before the first that is not matched; the end where the first is not.
std::vector<HomotopyStep>::const_iterator least_needed(const std::vector<HomotopyStep>& steps);

/// Landmarks that no flow takes to their targets exactly, though it may come near: on a line those whose order with
/// another one differs, in any dimension those at one place with another one in one of the shapes only. O(N²).
/// @param source, target d×N, NaN where not observed
std::vector<int> impossible_landmarks(const Points& source, const Points& target);

/// Whether all of them match, and J hardly grows any more at the end.
bool reaches_diffeomorphism(const std::vector<HomotopyStep>& steps);

}  // namespace pulson::matching
