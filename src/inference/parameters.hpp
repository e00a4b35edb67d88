#pragma once

#include <memory>
#include <string>
#include <vector>

#include "posterior/specimen.hpp"
#include "pulson/inference/posterior.hpp"

namespace pulson::inference {

/// The numbers of a problem's models by name: `alpha` and `weight` of each term of the kernel, the parameters of the
/// noise, `data-sigma`, which is the deviation of the observations, and `lambda`. In a sum, names begin with the
/// term's: `gaussian.alpha`, and `gaussian#2.alpha` of the second one.
class ModelNumbers {
 public:
  explicit ModelNumbers(const matching::MatchingProblem& problem);

  const std::vector<std::string>& names() const { return names_; }
  const Eigen::VectorXd& values() const { return values_; }

  /// The places of `name`, which is one of names() or the end of some after the dot: then all of these, of which it is
  /// a common factor.
  /// @throws InputError that lists the valid names, or where one of them is not positive
  std::vector<Eigen::Index> places(const std::string& name) const;

  /// The models with these values; what does not change is shared.
  posterior::Numbers at(const Eigen::VectorXd& values) const;

 private:
  std::shared_ptr<const KernelOperator> kernel_;
  std::shared_ptr<const NoiseModel> noise_;
  std::vector<std::string> names_;
  Eigen::VectorXd values_;
};

/// A problem with other models. @param problem whose data are landmarks
matching::MatchingProblem problem_at(matching::MatchingProblem problem, const posterior::Numbers& numbers);

/// make_posterior_problem() but for the parameters, and with the integrator of a match where that is automatic.
struct Specimens {
  PosteriorProblem problem;
  Eigen::Index free_coordinates = 0;  ///< matching::free_coordinates(), of all
};
Specimens make_specimens(const Landmarks& source, const std::vector<Landmarks>& targets,
                         matching::RegistrationOptions options);

/// What `all` stands for: no weights, of which λ is one, and nothing that is not positive.
std::vector<std::string> every_parameter(const PosteriorProblem& problem);

/// Adds the priors of these parameters, NAME or NAME=LOG_DEVIATION. @throws InputError
void add_priors(PosteriorProblem& problem, const std::vector<std::string>& names);

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
  std::vector<ParameterPrior> priors_;
  ModelNumbers numbers_;
  std::vector<std::vector<Eigen::Index>> places_;  // of each parameter
  bool samples_kernel_ = false;
};

}  // namespace pulson::inference
