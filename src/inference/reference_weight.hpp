#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "reference.hpp"

namespace pulson::inference {

/// What the moves of all chains share.
struct ChainSetting {
  const std::vector<Specimen>& specimens;
  const ParameterSpace& space;
  const Reference& reference;
  MoveKind move;
  double inflation = 1;  ///< factor on σ in the reference
  std::uint64_t seed = 1;
};

/// The models of one θ for all specimens, and the linear ones of all modes.
struct ThetaPoint {
  Eigen::VectorXd phi;
  std::vector<Specimen::Model> models;
  std::vector<std::vector<LinearAt>> linear;  ///< [specimen][mode], of σ/√τ; none where τ is 0
};

/// Standard normal numbers of one kind, of the kinds of an iteration of a chain.
Eigen::VectorXd drawn(std::uint64_t seed, std::uint64_t chain, std::uint64_t iteration, std::size_t kind,
                      Eigen::Index count);

/// A mode by its weight, of a number uniform in (0, 1).
std::size_t drawn_mode(const Eigen::VectorXd& log_weights, double uniform);

/// z of the reference about a mode, of standard normal numbers; none without a path.
/// @param passing within a trajectory, where its weight is not asked for: less accurate where draws fit their data
std::optional<Eigen::VectorXd> draw_of(const ChainSetting& setting, std::size_t specimen, const ThetaPoint& theta,
                                       std::size_t mode, const Eigen::VectorXd& normals, bool passing = false);

ThetaPoint make_theta(const ChainSetting& setting, const Eigen::VectorXd& phi, double power);

/// log p(z | θ) p(y | z, θ)^τ/Σ_m a_m g_m(z | θ), and what its gradient takes of it.
struct LogWeight {
  double value = 0;
  double kicked = 0;  ///< the part whose gradient kicks follow: all, but where draws fit their data the determinant
  Eigen::VectorXd responsibilities;        ///< of the modes; none where draws fit their data
  std::vector<Eigen::VectorXd> residuals;  ///< of the linear models
};
LogWeight log_weight_of(const ChainSetting& setting, std::size_t specimen, const ThetaPoint& theta, double power,
                        const Eigen::VectorXd& z, const Specimen::Shot& shot);

/// The log weight of an independent draw of the reference; −∞ without a path.
double reference_log_weight(const ChainSetting& setting, std::uint64_t number);

}  // namespace pulson::inference
