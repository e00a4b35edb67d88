#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/core/alignment.hpp"
#include "pulson/core/estimate.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/inference/diagnostics.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/posterior/branch.hpp"
#include "pulson/posterior/momentum_prior.hpp"

namespace pulson::inference {

/// A parameter θ_j of the models that is sampled, with the prior log θ_j ~ N(log median, log_deviation²).
struct ParameterPrior {
  std::string name;  ///< as in fit_parameters(): `alpha`, `beta`, `lambda`, `data-sigma`, …
  double median = 0;
  double log_deviation = 0.5;
};

using posterior::Branch;
using posterior::MomentumPrior;

/// The posterior of one or more targets, each an independent path from the source,
///
///     y = q(T) + N(0, R),   p0 ~ N(0, (λ(K(q0) + εI))⁻¹),   ΔW ~ N(0, Δt),   log θ_j ~ N(log m_j, s_j²),
///
/// with one θ for all, or momenta of another MomentumPrior, with K + εI for its K; or of a tree of paths, where the
/// shapes at its leaves are observed and p0 = 0. ε = 1e-3 λσ²/T², at the medians: momenta in directions whose
/// eigenvalue of K is below ε would move no landmark by more than 0.03 σ; ε keeps them finite where K is singular to
/// rounding, and changes the velocities K p0 of the others by a fraction ε over their eigenvalue.
struct PosteriorProblem {
  std::vector<matching::MatchingProblem> specimens;  ///< at the medians; the data are least squares
  std::vector<Landmarks> sources, targets;           ///< aligned, of the same landmarks
  /// How far each landmark of the target is believed, N, where there is a loss: found once by the robust fit of the
  /// linear model and held; σ²κ/w is the variance of its error (matching::LossWeight). Empty: no loss.
  Eigen::VectorXd weights{};
  /// The motions of each shape that an alignment took out of its landmarks, of a flat prior.
  AlignmentKind pose = AlignmentKind::kNone;
  /// Of the one specimen, whose source is at the root, without momenta there: parents before their children, those of
  /// one branch one after the other. Empty: each specimen is one path from source to target.
  std::vector<Branch> tree;
  MomentumPrior momenta = MomentumPrior::kKernel;
  std::vector<ParameterPrior> parameters;  ///< θ, may be empty
  std::vector<std::string> notes;          ///< what a user should know, a line each
};

/// Prior deviations of log θ where none is given: `data-sigma` and `alpha` 0.25, others 0.5.
double usual_log_deviation(std::string_view name);

/// @param options kernel, noise, σ, λ, grid, alignment and integrator, of which automatic choices are made for the
/// first target; `integrator = auto` is heun
/// @param parameters names, `NAME` or `NAME=LOG_DEVIATION`; `all`: the width of the kernel, all positive parameters of
/// the noise, `data-sigma` and `lambda`
/// @throws InputError where shapes do not fit together, an option is wrong, or the data are no landmarks
PosteriorProblem make_posterior_problem(const Landmarks& source, const std::vector<Landmarks>& targets,
                                        matching::RegistrationOptions options,
                                        const std::vector<std::string>& parameters);

/// The shape at the root of a tree, of greatest likelihood where each coordinate is a Brownian motion along the
/// branches: 1ᵀC⁻¹y / 1ᵀC⁻¹1, C_ij the length that the paths from the root to the nodes i and j share (generalised
/// least squares; E. Martins and T. Hansen, Am. Nat. 149, 1997). To this the estimate tends where noise moves landmarks
/// little.
/// @param shapes of leaves, and of inner nodes where they are known, by name, in one frame; landmarks in the same order
/// @throws InputError as make_tree_problem(), and where a coordinate is missing in all shapes
Landmarks brownian_root(const std::vector<TreeNode>& tree, const std::vector<Landmarks>& shapes);

/// The posterior of a tree of paths along which noise moves the source, which is the shape at its root.
/// @param tree as parse_newick() gives it @param shapes of leaves, and of inner nodes where they are known, by name
/// @param options as for make_posterior_problem(); the grid's time is that of the farthest leaf and its steps as many
/// as lead there; no alignment is automatic
/// @param parameters as for make_posterior_problem(), without `lambda`
/// @throws InputError also where a leaf has no shape, a shape no node, or a branch no length
PosteriorProblem make_tree_problem(const Landmarks& source, const std::vector<TreeNode>& tree,
                                   const std::vector<Landmarks>& shapes, matching::RegistrationOptions options,
                                   const std::vector<std::string>& parameters);

/// By how much log p(y) may be from the limit of fine steps where the steps are chosen, nats.
inline constexpr double kStepError = 0.02;

/// The same problem with so many steps that log p(y) is within kStepError of the limit of fine steps: those that it has
/// are doubled until weighted draws find it so (see PosteriorDraws::of_finer_steps), or the linear models where draws
/// do not determine it, up to 128.
PosteriorProblem with_sufficient_steps(PosteriorProblem problem, std::uint64_t seed = 1);

/// How a chain moves in the whitened coordinates of the Gauss–Newton Gaussian.
struct MoveKind {
  bool uses_gradient = false;    ///< trajectories of a quarter turn with kicks; else one rotation without
  double target_acceptance = 0;  ///< to which the angle of a step is adapted
  bool until_it_turns = false;   ///< trajectories of NUTS, which end where they turn back
  bool fits_data = false;        ///< each draw fits its perturbed data exactly, and not by the linear model
};

/// hmc, nuts, pcn, rto.
const NameTable<MoveKind>& sampler_table();

struct SamplerOptions {
  std::string method = "hmc";  ///< a name of sampler_table()
  int chains = 4;
  int warmup = 500;
  int draws = 1000;      ///< of each chain, after the warm-up
  int paths_kept = 400;  ///< of all chains, evenly spaced
  int temperatures = 1;  ///< powers τ of the likelihood whose chains exchange their points; 1: the posterior alone
  /// For modes: from the minima that registration finds, and one less from draws of the prior; 0: 16 where data are at
  /// most 12, else 1.
  int searches = 0;
  /// Whether the evidence is computed, from 100 to 2000 draws of the reference, and confirmed.
  bool evidence = true;
  std::uint64_t seed = 1;
  /// Called with the fraction done, for progress; from several threads.
  std::function<void(double fraction)> on_progress{};
  /// Called every second or so, while no chain is at work, with what gives all that sampling needs to go on from there.
  /// @return whether to go on at once; if not, the draws are those so far, and `partial`
  std::function<bool(const std::function<std::string()>& state)> on_state{};
  /// Of a call with the same problem and options, from which this one goes on, to the bits of one call. Not for another
  /// version of the program or another kind of machine.
  std::string state{};
};

/// What an estimate that shares nothing with the chains but the model says of them.
struct Confirmation {
  enum class By { kNothing, kImportance, kTempering };
  By by = By::kNothing;        ///< kNothing: neither weighted draws nor tempered chains of the same cost determine it
  Estimate log_evidence{};     ///< log p(y) of it
  double difference = 0;       ///< log p(y) of the chains, less that
  Eigen::VectorXd parameters;  ///< of the mean of log θ, the same difference; empty with kNothing, as these:
  std::vector<Eigen::VectorXd> momenta, ends, middles;  ///< [path] of the means of p0, q(T) and q(T/2)
  double furthest = 0;          ///< the greatest difference of evidence, θ and paths, in standard errors
  double furthest_allowed = 0;  ///< exceeded by chance once in 500
  std::string furthest_of;
  bool agrees = false;
};

/// Draws of all chains; index draw·chains + chain throughout. Each path is that of a specimen, or a branch of the tree.
struct PosteriorDraws {
  int chains = 0, draws = 0;
  std::vector<std::string> names;        ///< of θ
  Eigen::MatrixXd parameters;            ///< θ, k × draws
  std::vector<Eigen::MatrixXd> momenta;  ///< [path] p0, dN × draws, none for a tree
  std::vector<Eigen::MatrixXd> ends;     ///< [path] q(T), dN × draws
  std::vector<Eigen::MatrixXd> middles;  ///< [path] q(T/2), dN × draws
  Eigen::VectorXd log_likelihood;        ///< log p(y | p0, ΔW, θ)
  Eigen::VectorXd log_weight;            ///< log of the density relative to the reference, normalised by p(y)
  Eigen::VectorXi mode;                  ///< of the first specimen, from 0
  std::vector<int> kept;                 ///< draws whose paths are kept
  std::vector<std::vector<std::vector<Points>>> paths;  ///< [path][kept][time] q, d×N
  int modes = 1;                                        ///< found by the searches, of the specimen that has most
  double acceptance = 0;                                ///< mean probability of the moves of paths
  double parameter_acceptance = 0;                      ///< of the moves of θ; 0 without parameters
  double step_angle = 0;                                ///< mean over chains, radians
  double warmup_seconds = 0, seconds = 0;               ///< all, warm-up included
  /// log p(y) by bridge sampling; NaN: undetermined. Its error has in it how far that of the confirmation is from it.
  Estimate log_evidence;
  double pareto_k = 0;        ///< of the weights of the reference's draws; NaN: they are too few, or evidence is off
  double chain_pareto_k = 0;  ///< of the chains' weights, as those of draws of the reference would have it
  Confirmation confirmation;
  /// log p(y) with twice as many steps less that with these, at one θ; NaN: undetermined, or evidence is off.
  Estimate of_finer_steps{};
  double laplace_log_evidence = 0;  ///< of the reference
  std::int64_t path_evaluations = 0;
  std::vector<double> powers;               ///< τ, increasing from 0 to 1; empty without tempering
  std::vector<double> exchanged;            ///< mean probability, of each pair of neighbours
  Eigen::MatrixXd tempered_log_likelihood;  ///< powers × draws: of the draws of each power
  double lost_fraction = 0;                 ///< of the prior's draws, which have no path
  bool partial = false;                     ///< sampling was ended by SamplerOptions::on_state: most is not there

  /// Draws of one row by chain, draws×chains.
  Eigen::MatrixXd by_chain(const Eigen::Ref<const Eigen::RowVectorXd>& row) const;
};

/// Samples the posterior by Markov chains in coordinates in which Laplace's approximation is a standard normal law.
///
/// In z, where momenta and increments are N(0, I) a priori, let r(z) ≈ Jz + c be the residual linearised at a minimum,
/// S = I + JJᵀ. By Matheron's rule
///
///     z = ζ − JᵀS⁻¹(Jζ + c + ε),   ζ, ε ~ N(0, I),
///
/// has the posterior law g(z | θ) of the linear model. A chain holds (ζ, ε, θ) with the density
///
///     N(ζ, ε; 0, I) p(y, z, θ) / g(z | θ),
///
/// whose marginal of (z, θ) is the posterior, however far from linear. J and c scale with θ, so θ moves at fixed (ζ, ε)
/// are those of a sampler of the marginal p(θ | y) where the model is linear. The moves of (ζ, ε) rotate them towards
/// new normal numbers, which leaves the normal law invariant, with kicks by the gradient of the log weight (A. Beskos,
/// F. Pinski, J. Sanz-Serna, A. Stuart 2011); the acceptance does not depend on the number of steps. Of several minima
/// the reference is the mixture of their Gaussians, and chains jump between them by independent proposals.
///
/// With MoveKind::fits_data z is instead the root of z = ζ − Jᵀ(ε + r(z)) (J. Bardsley et al. 2014), and g its density;
/// kicks leave out the determinant in it, and θ moves by rotations within a Gaussian law of the warm-up.
///
/// With several temperatures each chain is a group of chains of the densities p(z, θ) p(y | z, θ)^τ, 0 = τ_1 < … < τ_L
/// = 1, which exchange their points (parallel tempering; powers and order of exchanges as S. Syed, A. Bouchard-Côté, G.
/// Deligiannidis and A. Doucet 2022). Each moves in the coordinates of its own linear model, of σ/√τ. Those of τ_1 are
/// independent draws of the prior, with which the posterior's chain begins anew each time one of them reaches it: so it
/// finds minima that no search has found, and leaves tails.
///
/// The evidence is that of bridge sampling (X.-L. Meng and W. Wong 1996) between the posterior and the reference; with
/// several temperatures from the prior through all of these, which is right however far from linear the path is.
/// Chains run in parallel; the draws have the same bits for any number of threads.
PosteriorDraws sample_posterior(const PosteriorProblem& problem, const SamplerOptions& options);

/// Simulation-based calibration (S. Talts et al. 2018) of the posterior of one shape.
struct CalibrationOptions {
  SamplerOptions sampler{};  ///< of each simulation; one chain
  int simulations = 100;
  int ranks = 63;            ///< L: ranks are 0 … L, of a true value among L thinned draws
  std::string fault_name{};  ///< a parameter that the data are drawn with `fault_factor` times; empty: none
  double fault_factor = 1;
};

struct CalibratedQuantity {
  std::string name;
  std::vector<int> ranks;  ///< one for each simulation
  double deviation = 0;    ///< p-value of the ECDF's largest pointwise significance, see rank_band()
  bool inside_band = true;
};

struct Calibration {
  std::vector<CalibratedQuantity> quantities;  ///< θ, then p0 of the first landmark, q(T/2) of the last, log likelihood
  int simulations = 0, ranks = 63, failed = 0;  ///< failed: simulations whose path or minimum was not found
  double pointwise = 0;                         ///< γ of the simultaneous band of 95 %
  std::vector<int> lower, upper;                ///< of the number of ranks ≤ i, i = 0 … ranks, within the band
  double seconds = 0;
};

/// Draws θ, p0, ΔW and y from the prior, samples the posterior of each, and ranks the true values.
/// @param problem whose first specimen gives source and models; its target only which coordinates are observed
Calibration calibrate(const PosteriorProblem& problem, const CalibrationOptions& options);

/// The simulations of calibrate() one by one, to be shared out among processes: each depends on the seed and its number
/// alone.
class CalibrationStudy {
 public:
  /// @throws InputError where an option is out of its range
  CalibrationStudy(const PosteriorProblem& problem, const CalibrationOptions& options);
  ~CalibrationStudy();

  /// The ranks of the true values in simulation 0 … simulations − 1, one for each quantity; empty where its path or
  /// minimum was not found. Thread-safe.
  std::vector<int> ranks(int simulation) const;
  /// What calibrate() makes of the ranks of all simulations, but for its seconds.
  Calibration summarise(const std::vector<std::vector<int>>& ranks) const;

 private:
  class Simulations;
  CalibrationOptions options_;
  std::vector<std::string> names_;
  std::unique_ptr<const Simulations> simulations_;
};

/// The simultaneous band of 95 % of the empirical distribution function of `simulations` uniform ranks 0 … L: the
/// central intervals of level 1 − γ of the binomial counts at each i, with γ such that all hold with 95 %; exact by the
/// recursion of T. Säilynoja, P.-C. Bürkner and A. Vehtari (Statistics and Computing 32, 2022, §2.3).
struct RankBand {
  double pointwise = 0;           ///< γ
  std::vector<int> lower, upper;  ///< L + 1 counts
};
RankBand rank_band(int simulations, int ranks, double level = 0.95);

/// The probability that the counts stay within [lower, upper] at every i, for uniform ranks.
double band_probability(const std::vector<int>& lower, const std::vector<int>& upper, int simulations);

}  // namespace pulson::inference
