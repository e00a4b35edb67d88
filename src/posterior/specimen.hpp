#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "pose.hpp"
#include "pulson/matching/objective.hpp"
#include "pulson/posterior/branch.hpp"
#include "pulson/posterior/momentum_prior.hpp"

namespace pulson::posterior {

/// The numbers θ of the models of all specimens.
struct Numbers {
  std::shared_ptr<const KernelOperator> kernel;  ///< shared where it is that of the problem
  std::shared_ptr<const NoiseModel> noise;
  double lambda = 1;
  double sigma = 1;  ///< relative to that of the data
};

/// One shape's unknowns z ~ N(0, I) and its data. Momenta are p0 = (λM)^{-½} z0 by Cholesky factorisation, which is
/// smooth in the width of the kernel, M = K(q0) + εI or, with it in place of K, that of MomentumPrior::kSmooth;
/// increments ΔW = √Δt zW; of a tree the increments of its branches, one after the other, and no momenta. With F the
/// derivative of the residual of a data term by positions, n×dN, X the directions and g the motion of the Pose that an
/// alignment takes out of the data, and A an orthonormal basis of what is orthogonal to FX,
///
///     r(z) = Aᵀ r_data(g q(T)),   −log p(y | z, θ) = ½|r|² + volume(θ),
///
/// where the pose has a flat prior, of unit density along X at the data.
///
/// The size B that a pose has is determined by nothing else, and what makes a shape larger changes all of r: about rest
/// ½ log det(1 + ∂r/∂z ∂r/∂zᵀ) falls by e as log B grows by 1. So most of the posterior is away from the minimum of
/// ½|z|² + ½|r|², where B is less. It is about that of a sum of squares with a last part, of which p(y | z, θ) knows
/// nothing:
///
///     r_B = √k (B − c·1),   ½|r_B|² = −e log B + constant + O(|B − 1|³) by k = e and c = 2,
///
/// of an affine map e/d in place of e and log det B of log B; where that is less than 1, k is 1 and c is 1 + e, up to
/// O(|B − 1|²). Thread-safe.
class Specimen {
 public:
  /// @param tree one path with the data of the problem where it is empty
  explicit Specimen(matching::MatchingProblem problem, std::vector<Branch> tree = {},
                    MomentumPrior prior = MomentumPrior::kKernel);

  /// One path. @param pose of data that are landmarks
  /// @throws InputError where the alignment accounts for all observed coordinates
  Specimen(matching::MatchingProblem problem, AlignmentKind pose, MomentumPrior prior = MomentumPrior::kKernel);

  /// The models at one θ.
  struct Model {
    StochasticSystem system;
    double lambda = 1;
    double sigma = 1;                             ///< relative to that of the data
    std::shared_ptr<const Eigen::MatrixXd> root;  ///< L, LLᵀ = M
    double size_exponent = 0;                     ///< e: any that both r_B and what is made of it have
  };

  struct Shot {
    std::vector<Trajectory> paths;  ///< of each branch
    Eigen::VectorXd residual;       ///< r, and r_B
    double log_likelihood = 0;      ///< log p(y | z, θ)
  };

  /// Which unknowns and data a branch has.
  struct Place {
    Eigen::Index first_unknown, unknowns;
    Eigen::Index first_datum, data;  ///< all that depend on it: its own first
  };

  const matching::MatchingProblem& problem() const { return problem_; }
  const std::vector<Branch>& branches() const { return branches_; }
  const std::vector<Place>& places() const { return places_; }
  Eigen::Index unknowns() const { return momenta_ + channels_ * steps_; }
  Eigen::Index momentum_unknowns() const { return momenta_; }
  Eigen::Index channels() const { return channels_; }
  Eigen::Index data() const { return count_; }                  ///< of r and r_B
  Eigen::Index coordinates() const { return count_ - sizes_; }  ///< of r: the first

  Model model(const Numbers& numbers) const;
  Points momenta(const Model& model, const Eigen::VectorXd& z) const;              ///< p0
  Eigen::MatrixXd increments(std::size_t branch, const Eigen::VectorXd& z) const;  ///< ΔW
  /// The z of p0 and ΔW, of one path.
  Eigen::VectorXd white(const Model& model, const Points& momenta, const Eigen::MatrixXd& increments) const;

  /// None where a step has no root or numbers overflow.
  std::optional<std::vector<Trajectory>> paths(const Model& model, const Eigen::VectorXd& z) const;
  std::optional<Shot> shoot(const Model& model, const Eigen::VectorXd& z) const;
  /// r and r_B. @param ends q(T) of each branch, one after the other
  Eigen::VectorXd residual(const Model& model, const Eigen::VectorXd& ends) const;
  /// log p(y | z, θ). @param residual r and r_B
  double log_likelihood(const Model& model, const Eigen::VectorXd& residual) const;
  /// What r and r_B are divided by, in units of the σ of the data: θ's σ, and 1/√k.
  Eigen::VectorXd units(const Model& model) const;
  /// The same source with all data there and the same pose.
  Specimen at_source() const;
  /// ½|r_B|² less that where B is 1. @param residual r and r_B
  double size_excess(const Model& model, const Eigen::VectorXd& residual) const;

  /// J(z)ᵀv, by the adjoint.
  Eigen::VectorXd transposed(const Model& model, const Shot& shot, const Eigen::VectorXd& v) const;

  /// The derivatives of the data that depend on a branch by its unknowns: through its end, by_end·end.
  struct BranchSlopes {
    Eigen::MatrixXd by_end;  ///< of the data, at the σ of the data, by the coordinates of the end
    Eigen::MatrixXd end;     ///< of these coordinates by the unknowns
  };
  struct Slopes {
    Eigen::MatrixXd momenta;  ///< of the end by p0, dN×dN; of no size for a tree
    std::vector<BranchSlopes> branches;
  };
  Slopes slopes(const Model& model, const Shot& shot) const;
  /// ∂(r, r_B)/∂q(T) of one path, at the σ of the data, n×dN.
  Eigen::MatrixXd projection(const Eigen::VectorXd& end) const;
  /// That of r at the source of data that are at the source.
  Eigen::MatrixXd source_projection() const;

  /// −log p(y | z, θ) − ½|r|² − ½|r_B|², where B is 1.
  double log_volume(const Model& model) const;

 private:
  Eigen::MatrixXd root_of(const KernelOperator& kernel) const;
  void add_branches();
  /// Of a branch's own data, at the σ of the data.
  Eigen::VectorXd own_residual(std::size_t branch, const Points& end) const;
  struct OfSize {
    double precision, centre;  ///< k and c
  };
  OfSize of_size(const Model& model) const;
  Eigen::VectorXd centre_of_size(const Model& model) const;  ///< c·1
  double half_square_at_one(const Model& model) const;       ///< ½|r_B|² where B is 1
  friend class SizeExponent;
  /// Its derivative by the positions at the end.
  Eigen::MatrixXd by_end(std::size_t branch) const;
  /// A derivative by the momenta as one by z.
  Eigen::VectorXd whitened(const Model& model, const Eigen::VectorXd& by_momenta) const;

  matching::MatchingProblem problem_;
  std::vector<Branch> branches_;
  std::vector<Place> places_;
  Eigen::Index momenta_;  ///< of the unknowns
  Eigen::Index steps_ = 0;
  Eigen::Index channels_;
  Eigen::Index count_ = 0;
  Eigen::Index sizes_ = 0;  ///< of count_, numbers of B
  double nugget_;
  Eigen::MatrixXd hidden_;  ///< λS of the prior kSmooth; else empty
  double log_determinant_ = 0;
  Eigen::MatrixXd complement_;  ///< A; empty for all
  Eigen::MatrixXd projection_;  ///< AᵀF
  AlignmentKind pose_kind_ = AlignmentKind::kNone;
  std::optional<Pose> pose_;
  std::shared_ptr<const Eigen::MatrixXd> reference_root_;
};

/// The same Brownian path with twice as many steps: each increment in two halves, whose difference is `normals`.
/// @param z of the specimen with few steps or with many @param normals as many; those of the momenta are not read
Eigen::VectorXd refined(const Specimen& specimen, const Eigen::VectorXd& z, const Eigen::VectorXd& normals);

}  // namespace pulson::posterior
