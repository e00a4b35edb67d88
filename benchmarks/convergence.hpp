#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "pulson/dynamics/stochastic_system.hpp"
#include "pulson/integrators/integrator.hpp"

namespace pulson::convergence {

/// A stochastic system and where it starts.
struct Case {
  std::string noise;  ///< specification
  PhaseState start;
  StochasticSystem system;
  bool commutes = true;  ///< the fields of different channels do: no iterated integral of two Brownian motions matters
};

/// Every row of noise_table() that has channels, in one dimension for two landmarks, and p-sd in the plane as well.
std::vector<Case> cases();

/// The equation that an integrator is compared with: the Stratonovich equation (11) of H, or of H − ¼Σ h_i,q·h_i,p.
enum class Limit { kStratonovich, kPaper };

/// Whether the integrator leaves half of the last increment to a next step, as (20) does.
bool lags(const std::string& integrator);

/// What is averaged over paths, with z = (q, p) the adapted end of a path and z* that of the limit on the same path.
enum Quantity : int {
  kPosition,   ///< |q − q*|
  kState,      ///< |z − z*|
  kCompleted,  ///< |z' − z*|, where z' has the half of the last increment that is left to a next step
  kMeanQ,      ///< q₂ − q₂*, first axis
  kSquareQ,    ///< q₂² − q₂*²
  kMeanP,      ///< p₁ − p₁*
  kSquareP,    ///< p₁² − p₁*²
  kQuantities
};

inline bool is_weak(Quantity quantity) { return quantity >= kMeanQ; }

struct Plan {
  std::vector<int> steps = {16, 32, 64, 128, 256};  ///< of the grids over [0, time], coarsest first
  int reference_steps = 4096;                       ///< a multiple of each
  int paths = 1000;
  std::uint64_t seed = 1;
  double time = 1;
  std::vector<std::string> integrators = {};  ///< empty: all of integrator_table() that take noise
};

/// A mean and its standard error, by the jackknife over blocks of paths.
struct Estimate {
  double value = 0;
  double error = 0;
};

/// The slope of log |mean| on log Δt, over the first `points` step sizes.
struct Order {
  Estimate slope;
  int points = 0;  ///< 0: Monte Carlo error hides it
};

/// One integrator against one limit.
struct Row {
  std::string integrator;
  Limit limit;
  std::array<std::vector<Estimate>, kQuantities> means;  ///< for each step size
  std::array<Order, kQuantities> orders;
  std::vector<int> failed;  ///< paths with a StepError, for each step size
  int paths = 0;            ///< that had none at any step size: those averaged over
};

struct Measurement {
  std::vector<Row> rows;
  /// The quantities of the end of kPaper beside that of kStratonovich; 0 where they are the same equation.
  std::array<Estimate, kQuantities> limits_apart;
  /// E|z − z*| of the reference and the midpoint rule at twice its step: what the reference itself may be wrong by.
  Estimate references_apart;
  int reference_failed = 0;  ///< paths without a reference
};

/// Integrates every path of the plan with every integrator on every grid, increments of coarser grids summed from the
/// finest, and compares with Heun's scheme for the limits on the finest. The result does not depend on the number of
/// threads. @throws InputError if the reference's steps are no multiple of two and of each grid's
Measurement measure(const Case& setting, const Plan& plan);

/// What the documentation of an integrator says of an order. Strong orders are multiples of ½, weak ones whole numbers.
struct Claim {
  enum class Kind { kIs, kIsAtLeast, kStalls };
  Kind kind = Kind::kIsAtLeast;
  double order = 0;
};

/// For an integrator that nothing is known of: at least strong ½ and weak 1.
Claim claim_of(const Case& setting, const Row& row, Quantity quantity);

/// Whether a slope is nearer to the order claimed than to another that it could be, by four standard errors.
enum class Verdict { kAgrees, kDiffers, kUndecided };
Verdict compare(const Order& measured, const Claim& claim, Quantity quantity);

/// Whether an integrator that stalls does so: the two limits are apart by more than four standard errors, and to its
/// own it converges, or is already nearer than they are to each other.
Verdict stalls(const Case& setting, const Measurement& measurement, Quantity quantity);

}  // namespace pulson::convergence
