#pragma once

#include <optional>
#include <vector>

#include "pulson/matching/registration.hpp"
#include "pulson/matching/robust_loss.hpp"

namespace pulson::matching {

/// The largest change of a weight at which rounds of weights and fits end.
inline constexpr double kSettledWeights = 0.01;

/// Numbers of the linear model of displacements, in diameters: V = K/λ + σ²/w.
struct DisplacementScales {
  KernelOperator kernel;
  double variance = 1;  ///< 1/λ
  double noise = 0;     ///< σ²
  double log_likelihood = 0;
};

/// What is given of a robust fit.
struct RobustOptions {
  RobustLoss loss{};
  AlignmentKind alignment = AlignmentKind::kNone;  ///< that was taken out of the displacements, and has a flat prior
  std::optional<KernelOperator> kernel{};          ///< none: matern32 with a width that is fitted
  std::optional<double> lambda{};                  ///< none: fitted
  double least_sigma = 0;                          ///< of the σ that is fitted, length units
  Eigen::VectorXd weights{};                       ///< of landmarks, besides those found; empty: all 1
};

/// A robust fit of the linearised matching problem (DisplacementModel): the noise of landmark a has the variance
/// σ²κ/(w_a m_a), with the given weights m, and width, λ, σ and w are fitted together.
///
/// The residuals of a fit do not show a wrong landmark: where σ is small a flow reaches any target, and w = 1 is a
/// fixed point of the weights. So they begin with the prediction of each landmark from the others (D. Hawkins and N.
/// Cressie, "Robust kriging", 1984): at the width and λσ² of greatest likelihood where the median of
///
///     t_a² = u_aᵀC_a⁻¹u_a,   u_a = (P_aa)⁻¹(Pr)_a,   C_a = (P_aa)⁻¹ − σ²/w_a + σ²
///
/// makes the scale, then with Tukey's weights of t_a and the likelihood in turn. From there
/// expectation–maximisation, in which a wrong landmark keeps its small weight and another gains its own:
/// w_a = w(E|e_a|²/σ²), the mean of the squared noise given the data (M. Tipping and N. Lawrence 2003).
class RobustFit {
 public:
  /// @param source d×N, after the alignment @param target d×N, with NaN for what is missing
  /// @throws InputError where the landmarks are too few to show a wrong one
  RobustFit(const Points& source, const Points& target, const RobustOptions& options);

  /// The weights of prediction, N; 1 for a landmark that is not observed in full.
  Eigen::VectorXd predicted_weights() const;

  /// Weights and numbers by expectation–maximisation from these weights; returns the weights.
  Eigen::VectorXd settle(Eigen::VectorXd weights);

  /// One step of the weights, where a fit of the flow has left these residuals q(T) − y, d×N, at settled numbers.
  Eigen::VectorXd updated(const Eigen::VectorXd& weights, const Points& residuals) const;

  /// σ of settle(), length units.
  double sigma() const;

  /// w m/κ, N: what the data term is weighted by.
  Eigen::VectorXd data_weights(const Eigen::VectorXd& weights) const;

 private:
  struct LeftOut {
    Eigen::MatrixXd residuals;           // u, d×n
    std::vector<Eigen::MatrixXd> flows;  // covariance of f_a given the others
  };

  std::vector<Eigen::Index> used(const Eigen::VectorXd& precision) const;
  bool determines(const Eigen::VectorXd& precision) const;
  KernelOperator kernel_at(double width) const;
  int widths() const;
  double width(int i) const;
  double variance_at(double best, double tau) const;
  DisplacementScales scales_at(const Eigen::VectorXd& precision) const;
  LeftOut left_out(const DisplacementScales& scales, const Eigen::VectorXd& precision) const;
  Eigen::VectorXd prediction_squares(const DisplacementScales& scales, const Eigen::VectorXd& precision) const;
  DisplacementScales robust_start() const;
  Eigen::VectorXd noise_squares(const DisplacementScales& scales, const Eigen::VectorXd& precision,
                                const Points* residuals) const;
  Eigen::VectorXd spread_out(const Eigen::VectorXd& weights) const;

  RobustOptions options_;
  LossWeight weight_;
  Eigen::Index count_;                  // N
  std::vector<Eigen::Index> observed_;  // in full, n of them
  double size_;
  Points shape_, moved_;        // d×n, in diameters
  Eigen::MatrixXd directions_;  // dn×r
  Eigen::VectorXd given_;       // m, n
  DisplacementScales scales_;
};

}  // namespace pulson::matching
