#pragma once

#include <memory>
#include <string>
#include <vector>

#include "registration_problem.hpp"

namespace pulson::matching {

/// The numbers of a registration's models by name: `alpha` and `weight` of each term of the kernel, the parameters of
/// the noise, `data-sigma`, which is the deviation of the observations, and `lambda`. In a sum, names begin with the
/// term's: `gaussian.alpha`, and `gaussian#2.alpha` of the second one.
class ModelParameters {
 public:
  /// Of the models of a problem: automatic choices are numbers there. @param options those that it was made of
  ModelParameters(const RegistrationProblem& problem, RegistrationOptions options);

  const std::vector<std::string>& names() const { return names_; }
  const Eigen::VectorXd& values() const { return values_; }

  /// The places of `name`, which is one of names() or the end of some after the dot: then all of these.
  /// @throws InputError that lists the valid names
  std::vector<Eigen::Index> places(const std::string& name) const;

  /// The places of the noise's amplitudes, see NoiseModel::amplitudes.
  const std::vector<Eigen::Index>& amplitudes() const { return amplitudes_; }

  /// The options with these values, nothing left automatic.
  RegistrationOptions options(const Eigen::VectorXd& values) const;

 private:
  std::vector<KernelTerm> terms_;
  std::shared_ptr<const NoiseModel> noise_;
  RegistrationOptions options_;
  std::vector<std::string> names_;
  Eigen::VectorXd values_;
  std::vector<Eigen::Index> amplitudes_;
};

}  // namespace pulson::matching
