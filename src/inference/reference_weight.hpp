#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "posterior/shot_batch.hpp"
#include "reference.hpp"

namespace pulson::inference {

/// What the moves of all chains share.
struct ChainSetting {
  const std::vector<Specimen>& specimens;
  const ParameterSpace& space;
  const Reference& reference;
  MoveKind move;
  std::uint64_t seed = 1;

  /// Whether the draws of a component are fitted to their perturbed data, and not by the linear model.
  bool is_fitted(std::size_t component) const { return move.fits_data && component == 0; }
};

/// The models of one θ for all specimens, and the linear ones of all components.
struct ThetaPoint {
  Eigen::VectorXd phi;
  std::vector<Specimen::Model> models;
  std::vector<std::vector<LinearAt>> linear;  ///< [specimen][component], of σ/√τ; none where τ is 0
};

/// Standard normal numbers of one kind, of the kinds of an iteration of a chain.
Eigen::VectorXd drawn(std::uint64_t seed, std::uint64_t chain, std::uint64_t iteration, std::size_t kind,
                      Eigen::Index count);

/// A component by its weight, of a number uniform in (0, 1).
std::size_t drawn_component(const Eigen::VectorXd& log_weights, double uniform);

/// z of a component of the reference, of standard normal numbers; none without a path.
/// @param passing within a trajectory, where its weight is not asked for: less accurate where draws fit their data
std::optional<Eigen::VectorXd> draw_of(const ChainSetting& setting, std::size_t specimen, const ThetaPoint& theta,
                                       std::size_t component, const Eigen::VectorXd& normals, bool passing = false);

ThetaPoint make_theta(const ChainSetting& setting, const Eigen::VectorXd& phi, double power);

/// log p(z | θ) p(y | z, θ)^τ/Σ_c a_c g_c(z | θ), and what its gradient takes of it.
struct LogWeight {
  double value = 0;
  double kicked = 0;  ///< the part whose gradient kicks follow: all, but where draws fit their data the determinant
  Eigen::VectorXd responsibilities;        ///< of the components
  std::vector<Eigen::VectorXd> residuals;  ///< of the linear models of the modes, Jz + c
};
/// @param component of which z was drawn: where draws fit their data the law of the first is not that of all z
LogWeight log_weight_of(const ChainSetting& setting, std::size_t specimen, const ThetaPoint& theta, double power,
                        std::size_t component, const Eigen::VectorXd& z, const Specimen::Shot& shot);

/// log Σ_c a_c g_c(z | θ), of linear models, relative to N(z; 0, I), and what LogWeight has of them. @param first the
/// component from which the sum begins
struct LogMixture {
  double value = 0;
  Eigen::VectorXd log_parts;  ///< log a_c g_c; −∞ of those before the first
  std::vector<Eigen::VectorXd> residuals;

  /// Takes in the first component, of which the sum has nothing yet.
  void join(double log_part);
};
LogMixture log_mixture_of(const ChainSetting& setting, std::size_t specimen, const ThetaPoint& theta, double power,
                          const Eigen::VectorXd& z, std::size_t first = 0);

/// Draws that are made together where θ is held: some groups of vector lanes.
inline constexpr int kBlockOfDraws = 64;

/// Independent draws of a specimen from the components of its reference, weighed.
struct SpecimenDraws {
  std::vector<std::size_t> components;
  Eigen::MatrixXd z;
  posterior::ShotBatch::Ends ends;
  Eigen::VectorXd log_weights;  ///< −∞ without a path
};

/// So many of them as there are columns, shot in vector lanes where there are any.
/// @param often the logarithms of the components' probabilities @param uniforms in (0, 1), by which these are chosen
/// @param normals standard normal numbers, a column each
SpecimenDraws specimen_draws(const ChainSetting& setting, std::size_t specimen, const ThetaPoint& theta, double power,
                             const Eigen::VectorXd& often, const Eigen::VectorXd& uniforms,
                             const Eigen::MatrixXd& normals);

/// Independent draws of the reference. Of one specimen the wide components are drawn more often than they weigh, as
/// what they find is rare and costs one path.
struct ReferenceDraws {
  Eigen::VectorXd log_weights;  ///< −∞ without a path
  Eigen::VectorXd log_parts;    ///< of the weight of its component over how often it is drawn
};

/// So many of them, by their numbers, all at once. Where θ is held they are shot in vector lanes where there are any.
ReferenceDraws reference_draws(const ChainSetting& setting, std::uint64_t first, Eigen::Index count);

/// How often components are drawn where the wide ones are half of all: log b_c.
Eigen::VectorXd tilted(const Eigen::VectorXd& log_weights, const std::vector<Component>& components);

}  // namespace pulson::inference
