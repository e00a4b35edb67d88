#pragma once

#include <memory>
#include <string>
#include <vector>

#include "posterior/specimen.hpp"
#include "pulson/inference/posterior.hpp"

namespace pulson::inference {

/// Names of the parameters of the models in the order of ModelParameters: alpha and weight of each term of the kernel,
/// those of the noise, data-sigma, lambda.
struct AllParameters {
  std::vector<std::string> names;
  std::vector<double> values;
  Eigen::Index kernel_terms = 0;
};

/// make_posterior_problem() but for the parameters. @param all all that there are
PosteriorProblem make_specimens(const Landmarks& source, const std::vector<Landmarks>& targets,
                                matching::RegistrationOptions options, AllParameters& all);

/// What `all` stands for: no weights, of which λ is one, and nothing that is not positive.
std::vector<std::string> every_parameter(const AllParameters& all);

/// Adds the priors of these parameters, NAME or NAME=LOG_DEVIATION. @throws InputError
void add_priors(PosteriorProblem& problem, const AllParameters& all, const std::vector<std::string>& names);

/// θ as standard normal numbers φ: θ_j = m_j exp(s_j φ_j).
class ParameterSpace {
 public:
  explicit ParameterSpace(const PosteriorProblem& problem);

  Eigen::Index count() const { return std::ssize(priors_); }
  const std::vector<ParameterPrior>& priors() const { return priors_; }
  Eigen::VectorXd values(const Eigen::VectorXd& phi) const;  ///< θ
  posterior::Numbers at(const Eigen::VectorXd& phi) const;
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
