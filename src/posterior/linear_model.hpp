#pragma once

#include <memory>
#include <vector>

#include <Eigen/Cholesky>

#include "specimen.hpp"

namespace pulson::posterior {

/// The residual of one specimen linearised about a point, in physical variables, at the σ of the data:
///
///     r ≈ c + G_v K p0 + G_W (ρ ∘ zW),
///
/// r with r_B of the Specimen as its last numbers, ρ_i(θ) the strength of channel i relative to that of the models it
/// was made with: so it holds for other θ as well, exactly for amplitudes, λ and σ where the path is linear in what
/// moves it.
class LinearModel {
 public:
  /// @param at a path of `z`
  LinearModel(const Specimen& specimen, const Specimen::Model& model, const Specimen::Shot& at,
              const Eigen::VectorXd& z);
  /// @param slopes, residual of the path of `z`
  LinearModel(const Specimen& specimen, const Specimen::Model& model, Specimen::Slopes slopes,
              const Eigen::VectorXd& residual, const Eigen::VectorXd& z);
  /// About a path with other derivatives by its momenta: that of rest with another kernel.
  /// @param by_momenta ∂q(T)/∂p0, dN×dN, of the model
  LinearModel(LinearModel rest, const Specimen::Model& model, const Eigen::MatrixXd& by_momenta);

  /// The covariance of the data at another θ, at the σ of the data: U² + G_v(K + ε)G_vᵀ/λ + Σ_i ρ_i² G_i G_iᵀ, U the
  /// units of the Specimen.
  Eigen::MatrixXd covariance(const Specimen::Model& model) const;
  /// c; in units of the σ of the data.
  const Eigen::VectorXd& offset() const { return offset_; }
  const Specimen& specimen() const { return *specimen_; }

 private:
  friend class LinearAt;
  void take_velocities(const Eigen::MatrixXd& by_momenta);      ///< ∂(r, r_B)/∂p0, at the σ of the data, n×dN
  Eigen::VectorXd group_ratios(const NoiseModel& noise) const;  ///< of each group, ρ²
  Eigen::VectorXd strengths(const NoiseModel& noise) const;     ///< of each channel

  const Specimen* specimen_;
  Eigen::MatrixXd by_velocity_;                   ///< G_v, n×dN; of a tree n×0
  std::vector<Specimen::BranchSlopes> branches_;  ///< G_W
  Eigen::VectorXd offset_;                        ///< c
  PhaseState start_;                              ///< where strengths are measured
  std::vector<PhaseState> probes_;
  std::shared_ptr<const NoiseModel> noise_;
  Eigen::VectorXd strengths_;          ///< at the θ it was made with
  std::vector<int> group_;             ///< of each channel: those of one group are scaled by one number
  std::vector<Eigen::MatrixXd> gram_;  ///< of each group, G_W G_Wᵀ over its channels
  std::shared_ptr<const Eigen::MatrixXd> root_;
  Eigen::MatrixXd momentum_gram_;  ///< G_v (K + ε) G_vᵀ with that root
};

/// About rest: without momenta and increments.
/// @throws NumericalError where the noise leaves rest no path
std::shared_ptr<const LinearModel> linear_at_rest(const Specimen& specimen, const Specimen::Model& model);

/// It at one θ in whitened unknowns: r ≈ Jz + c, S = I + JJᵀ.
class LinearAt {
 public:
  /// @param wider all of r is divided by it, too: the density to the power wider⁻²
  LinearAt(const LinearModel& linear, const Specimen::Model& model, double wider = 1);
  /// The same of r divided by `factor`.
  LinearAt wider(double factor) const;

  Eigen::VectorXd apply(const Eigen::VectorXd& z) const;       ///< Jz
  Eigen::VectorXd transposed(const Eigen::VectorXd& v) const;  ///< Jᵀv
  /// The columns of J that are of momenta, n×dN.
  Eigen::MatrixXd by_momenta() const;
  /// J'Jᵀ, J' of the slopes at another point, of the same models.
  Eigen::MatrixXd product(const Specimen::Slopes& slopes, const Specimen::Model& model) const;
  /// Jᵀ as ShotBatch needs it: the changes of p0 that J' of another point acts on, dN×n, and those of the unknowns of
  /// the increments, CK×n.
  Eigen::MatrixXd momentum_changes(const Specimen::Model& model) const;
  Eigen::MatrixXd increment_changes() const;
  /// Of the end points' variance, linearised, what is due to momenta and to each channel: traces of JJᵀ.
  double momentum_share() const;
  double noise_share() const;
  const Eigen::VectorXd& offset() const { return offset_; }  ///< c
  Eigen::VectorXd residual(const Eigen::VectorXd& z) const { return apply(z) + offset_; }
  Eigen::VectorXd solve(const Eigen::VectorXd& v) const { return factors_.solve(v); }  ///< S⁻¹v

  /// The z of standard normal numbers (ζ, ε): a draw of the linear posterior.
  Eigen::VectorXd draw(const Eigen::VectorXd& normals) const;
  /// The transpose of its derivative.
  Eigen::VectorXd pull_back(const Eigen::VectorXd& z_bar) const;
  /// −JᵀS⁻¹c
  Eigen::VectorXd mean() const;

  double half_log_determinant() const;                   ///< ½ log det S
  double log_evidence() const { return log_evidence_; }  ///< log p(y | θ) of the linear model
  /// Laplace's: the same but for r_B at the mean.
  double laplace() const { return log_evidence_ + excess_; }
  const Eigen::MatrixXd& gram() const { return gram_; }  ///< JJᵀ

 private:
  void factorise();

  const LinearModel* linear_;
  Eigen::VectorXd scale_data_;  ///< 1/U
  double scale_velocity_ = 1;
  Eigen::VectorXd scale_channels_;  ///< C
  std::shared_ptr<const Eigen::MatrixXd> root_;
  Eigen::VectorXd offset_;
  Eigen::MatrixXd gram_;  ///< JJᵀ
  Eigen::LLT<Eigen::MatrixXd> factors_;
  double log_volume_ = 0;
  double log_evidence_ = 0;
  double excess_ = 0;  ///< of the size
};

}  // namespace pulson::posterior
