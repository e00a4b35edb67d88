#pragma once

#include <optional>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "lane_shots.hpp"
#include "posterior.hpp"

namespace pulson::compare {

/// Draws of one shape's unknowns and their weights, see importance_sample() and sample_beyond(). A draw is a function
/// of its standard normal numbers: ε, those of the momenta, those of the noise.
class ShapeDraws {
 public:
  static constexpr Eigen::Index kMostOfOneSet = 4;

  ShapeDraws(const matching::MatchingObjective& objective, const Observation& observation, const Linearised& match);

  Eigen::Index normals() const { return observation_.count() + objective_.problem().source.size() + controls(); }

  /// How many draws are made at once.
  Eigen::Index at_once() const { return shots_ ? LaneShots::lanes() : 1; }

  /// Draws that differ in signs alone, a column each.
  Eigen::MatrixXd with_all_signs(const Eigen::VectorXd& normals) const;

  /// Without noise those that differ in its sign are alike, and are left out: the evidence of noise that vanishes is
  /// that of none.
  Eigen::Index of_one_set() const { return controls() > 0 ? kMostOfOneSet : 2; }

  /// Logs of the weights of several draws, a column each; −∞ where there is no path.
  /// @param v where the iteration of each begins and ends, if it has a size
  Eigen::VectorXd log_weights(const Eigen::MatrixXd& normals, const std::vector<Eigen::VectorXd*>& v) const;

  /// Before draws from elsewhere.
  void find_axes() { axes_.emplace(Eigen::MatrixXd(match_.jacobian * match_.jacobian.transpose())); }

  /// Log of the weight of a draw from elsewhere, half of which are from the prior and half from Laplace's
  /// approximation, twice as wide; where draws of the first kind come to it too, it counts there: none.
  std::optional<double> log_weight_beyond(const Eigen::VectorXd& normals, bool from_prior) const;

 private:
  struct Place {
    matching::MatchingObjective::Evaluation at;
    Eigen::VectorXd residual;
  };

  std::optional<double> log_weight(const Eigen::VectorXd& normals, Eigen::VectorXd& v) const;
  Eigen::VectorXd white(const Eigen::VectorXd& normals) const;
  void shoot_all(const Eigen::MatrixXd& normals, Eigen::VectorXd* const* begin,
                 Eigen::Ref<Eigen::VectorXd> weights) const;
  void find_by_newton(const Eigen::MatrixXd& epsilon, const Eigen::MatrixXd& zeta, const Eigen::MatrixXd& nearest,
                      Eigen::MatrixXd& v, Eigen::MatrixXd& z, Eigen::MatrixXd& residual,
                      std::vector<char>& found) const;
  std::optional<Place> fitted(const Eigen::VectorXd& epsilon, const Eigen::VectorXd& zeta, Eigen::VectorXd& v,
                              double accuracy) const;
  std::optional<Eigen::VectorXd> residual_at(const Eigen::VectorXd& z, bool& contracts) const;
  bool is_reached(const Eigen::VectorXd& z, const Eigen::VectorXd& residual) const;
  Eigen::VectorXd posterior_root(const Eigen::VectorXd& white) const;
  double log_joint(const Eigen::VectorXd& z, const Eigen::VectorXd& residual) const;
  Eigen::Index controls() const { return match_.jacobian.cols() - momentum_unknowns_; }
  std::optional<double> log_density(const Place& place) const;
  std::optional<double> log_density(const Eigen::VectorXd& z, const Eigen::VectorXd& residual,
                                    Eigen::MatrixXd slope) const;

  const matching::MatchingObjective& objective_;
  const Observation& observation_;
  const Linearised& match_;
  Eigen::Index momentum_unknowns_;
  Eigen::LLT<Eigen::MatrixXd> factors_;  ///< of I + JJᵀ
  double half_log_determinant_ = 0;
  std::optional<Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>> axes_;  ///< of JJᵀ
  std::optional<LaneShots> shots_;
};

}  // namespace pulson::compare
