#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pulson/inference/posterior.hpp"

namespace pulson::inference {

/// The models of all specimens at one θ.
struct ModelNumbers {
  std::shared_ptr<const KernelOperator> kernel;  ///< shared where its numbers are those of the medians
  std::shared_ptr<const NoiseModel> noise;
  double lambda = 1;
  double sigma = 1;  ///< relative to that of the data
};

/// θ as standard normal numbers φ: θ_j = m_j exp(s_j φ_j).
class ParameterSpace {
 public:
  explicit ParameterSpace(const PosteriorProblem& problem);

  Eigen::Index count() const { return std::ssize(priors_); }
  const std::vector<ParameterPrior>& priors() const { return priors_; }
  Eigen::VectorXd values(const Eigen::VectorXd& phi) const;  ///< θ
  ModelNumbers at(const Eigen::VectorXd& phi) const;
  bool samples_kernel() const { return samples_kernel_; }

 private:
  enum class Kind { kAlpha, kWeight, kNoise, kSigma, kLambda };
  struct Place {
    Kind kind;
    Eigen::Index index;
  };
  std::vector<ParameterPrior> priors_;
  std::vector<std::vector<Place>> places_;
  std::shared_ptr<const KernelOperator> kernel_;
  std::shared_ptr<const NoiseModel> noise_;
  double lambda_;
  bool samples_kernel_ = false;
};

}  // namespace pulson::inference
