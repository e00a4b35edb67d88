#pragma once

#include <optional>
#include <string>

#include "pulson/matching/alignment.hpp"
#include "pulson/matching/minimise.hpp"

namespace pulson {

/// What is minimised over: p0 alone without noise, or p0 and the noise as a control.
enum class MatchingMode { kDeterministic, kMap };

/// @throws InputError that lists `deterministic`, `map`
MatchingMode parse_mode(std::string_view name);
std::string mode_name(MatchingMode mode);

/// Everything that defines a registration, as specifications.
struct RegistrationOptions {
  std::string kernel = "gaussian:alpha=auto";
  std::string noise = "none";
  std::optional<MatchingMode> mode{};  ///< default: `map` where there is noise, else `deterministic`
  std::string integrator = "variational";
  TimeGrid grid{};
  double sigma = 0.01;
  std::optional<double> lambda = 1;  ///< none: 1/diameter² of the source, so that costs do not depend on the unit
  AlignmentKind align = AlignmentKind::kNone;
  MinimiseOptions minimise{};
};

/// The record of a registration: all that is needed to replay it, and what it cost. Its JSON form is
/// `registration.json`.
struct Registration {
  std::string kernel;
  std::string noise;
  MatchingMode mode = MatchingMode::kDeterministic;
  std::string integrator;
  TimeGrid grid;
  double sigma = 0;
  double lambda = 0;
  Alignment alignment;  ///< moved the original source to `source`
  Landmarks source;     ///< q0: the source after alignment, where the flow begins
  Landmarks original;   ///< the source as it was given
  Landmarks target;
  Points result;               ///< q(T), d×N
  Points momenta;              ///< p0, d×N
  Eigen::MatrixXd increments;  ///< ΔW, C×K
  MatchingCost cost;
  Solver solver = Solver::kAuto;
  bool converged = false;
  std::string stop_reason;
  int iterations = 0;
  int evaluations = 0;
  double relative_gradient = 0;
  double seconds = 0;

  /// |q_a(T) − y_a| of each landmark.
  Eigen::VectorXd distances() const;
  /// Root mean square of the distances, length units.
  double rms() const;
  /// The same before the flow: of the aligned source to the target.
  double initial_rms() const;
  double max_residual() const;
  /// Whether the shapes were brought together: rms is at most 3σ, or a twentieth of what it was. A minimum that leaves
  /// them further apart is reported as no match.
  bool matched() const;
};

/// Fits momenta, and the noise where there is some, so that `source` flows to `target`.
/// @throws InputError where the shapes do not fit together or an option is wrong
Registration register_shapes(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options);

/// The system and path of a registration: the same bits as when it was fitted, on the same build.
StochasticSystem registration_system(const Registration& registration);
Trajectory replay(const Registration& registration);

/// Pairs of landmarks on a line whose order differs between the two sets. @param before, after 1×N
int order_inversions(const Points& before, const Points& after);

}  // namespace pulson
