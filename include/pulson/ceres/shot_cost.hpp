#pragma once

// Component pulson::ceres: flows in problems of Ceres Solver (http://ceres-solver.org). The one public header that
// names a library besides Eigen and that of C++; pulson/pulson.hpp does not include it. Names are in pulson: a
// namespace pulson::ceres would hide Ceres' own.

#include <memory>

#include <ceres/cost_function.h>

#include "pulson/integrators/integrator.hpp"

namespace pulson {

/// A path but for its momenta: what is shot, and how.
struct Shot {
  StochasticSystem system;
  std::shared_ptr<const Integrator> integrator;
  TimeGrid grid;
  Points q0;                     ///< d×N
  Eigen::MatrixXd increments{};  ///< ΔW, C×K; empty: 0
};

/// Which of what a path depends on are parameters besides p0, else those of the Shot are taken: each a block of its own
/// in this order.
struct ShotParameters {
  bool q0 = false;
  bool increments = false;
};

/// The end of a shot as a residual of Ceres,
///
///     r = (q(T) − y)/σ,   q(T) by the steps of an integrator from (q0, p0) with increments ΔW,
///
/// with the exact Jacobian of these steps (Integrator::endpoint_jacobian, adjoint_rows). Parameters are the blocks p0
/// (dN numbers), q0 (dN) and ΔW (CK), of which the last two may be left out; points are stored landmark by landmark
/// (index a·d + axis), as Points::data() has them, ΔW step by step, channel fastest. Residuals: dN, in the same order.
///
/// With the defaults r = q(T): wrapped by ceres::DynamicCostFunctionToFunctor the landmarks after the flow are an
/// expression in a cost function of your own, see apps/examples/07_photographs.cpp. A match is a problem of this cost
/// and of energy_prior(): ½|r|² is the data term of LandmarkTerm, and the sum J of MatchingProblem.
///
/// Evaluate() returns false where there is no path (StepError), so that Ceres tries a shorter step. Thread-safe.
/// Cost of a Jacobian: dN adjoint sweeps; with q0 as a block twice as many.
class ShotCost final : public ::ceres::CostFunction {
 public:
  /// @param target y, d×N; empty: 0 @param sigma length units, of y
  /// @throws InputError where sizes do not fit together, or sigma is not positive
  explicit ShotCost(Shot shot, Points target = {}, double sigma = 1, ShotParameters parameters = {});

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

  /// How many numbers the block of p0, and that of q0, has.
  int coordinates() const { return num_residuals(); }

 private:
  Trajectory path_of(double const* const* parameters) const;

  Shot shot_;
  Points target_;
  double sigma_;
  ShotParameters parameters_;
};

/// The energy of a geodesic as a residual of Ceres with the one block p0: r = √λ Rp0 with RᵀR = K(q0) on each axis, so
/// that ½|r|² = (λ/2) p0ᵀK(q0)p0. (The action ½|ΔW|²/Δt of increments is a ceres::NormalPrior of 1/√Δt.)
/// @param q0 d×N @param lambda 0 or greater
std::unique_ptr<::ceres::CostFunction> energy_prior(const KernelOperator& kernel, const Points& q0, double lambda);

}  // namespace pulson
