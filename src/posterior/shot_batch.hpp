#pragma once

#include <memory>
#include <vector>

#include "linear_model.hpp"

namespace pulson::posterior {

class LaneShots;

/// Shots of a specimen's unknowns z at one θ, a column each: in vector lanes where there is vector code for the
/// integrator, the noise and so many landmarks (see LaneShots), else one after the other, to the same numbers but for
/// round-off. It refers to what it is made of. Thread-safe.
class ShotBatch {
 public:
  /// @param chord whose J products() have; null: none
  ShotBatch(const Specimen& specimen, const Specimen::Model& model, const LinearAt* chord = nullptr);
  ~ShotBatch();

  /// How many are shot at no more cost than one.
  Eigen::Index at_once() const;

  const Specimen& specimen() const { return specimen_; }
  const Specimen::Model& model() const { return model_; }

  struct Ends {
    Eigen::MatrixXd positions;  ///< q(T), of a tree those of each branch, one after the other
    Eigen::MatrixXd middles;    ///< q(T/2), the same
    std::vector<char> found;    ///< whether each has a path; without one its column says nothing
  };
  Ends ends(const Eigen::MatrixXd& z) const;
  /// log p(y | z, θ) of each; −∞ without a path.
  Eigen::VectorXd log_likelihoods(const Ends& ends) const;

  /// The derivatives of each; of no size without a path.
  std::vector<Specimen::Slopes> slopes(const Eigen::MatrixXd& z) const;

  /// J(z)Jᵀ of each, n×n, J that of the chord; of no size without a path.
  std::vector<Eigen::MatrixXd> products(const Eigen::MatrixXd& z) const;

 private:
  const Specimen& specimen_;
  const Specimen::Model& model_;
  const LinearAt* chord_;
  std::unique_ptr<const LaneShots> lanes_;
};

}  // namespace pulson::posterior
