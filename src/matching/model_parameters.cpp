#include "model_parameters.hpp"

#include <algorithm>

#include <fmt/core.h>
#include <fmt/ranges.h>

#include "core/open_numbers.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr Index kOfKernelTerm = 2;  // alpha, weight

std::string after_dot(const std::string& name) { return name.substr(name.find_last_of('.') + 1); }

std::vector<std::string> owners(const KernelOperator& kernel) {
  std::vector<std::string> names;
  for (const Spec& spec : parse_spec_sum(kernel.spec(), "kernel")) names.push_back(spec.name);
  return term_owners(names);
}

}  // namespace

ModelParameters::ModelParameters(const RegistrationProblem& problem, RegistrationOptions options)
    : terms_(problem.matching.system.kernel.terms()),
      noise_(problem.matching.system.noise),
      options_(std::move(options)) {
  std::vector<double> values;
  const std::vector<std::string> owner = owners(problem.matching.system.kernel);
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    names_.insert(names_.end(), {owner[i] + "alpha", owner[i] + "weight"});
    values.insert(values.end(), {terms_[i].alpha, terms_[i].weight});
  }
  const Points& shape = problem.matching.source;
  for (const NoiseAmplitude& a : noise_->amplitudes(static_cast<int>(shape.rows()), static_cast<int>(shape.cols())))
    amplitudes_.push_back(std::ssize(names_) + a.parameter);
  for (const std::string& name : noise_->parameter_names()) names_.push_back(name);
  for (const double value : noise_->parameters()) values.push_back(value);
  names_.insert(names_.end(), {"data-sigma", "lambda"});
  values.insert(values.end(), {problem.matching.sigma, problem.matching.lambda});
  values_ = VectorXd::Map(values.data(), std::ssize(values));
  options_.mode = problem.mode;
}

std::vector<Index> ModelParameters::places(const std::string& name) const {
  std::vector<Index> places;
  std::vector<std::string> valid;
  for (Index i = 0; i < values_.size(); ++i) {
    const std::string& full = names_[static_cast<std::size_t>(i)];
    if (full == name || after_dot(full) == name) places.push_back(i);
    for (const std::string& spelling : {after_dot(full), full})
      if (std::find(valid.begin(), valid.end(), spelling) == valid.end()) valid.push_back(spelling);
  }
  if (!places.empty()) return places;
  throw InputError(fmt::format("'{}' is not a parameter of these models{}", name, advice_on_name(name, valid)));
}

RegistrationOptions ModelParameters::options(const VectorXd& values) const {
  RegistrationOptions options = options_;
  std::vector<KernelTerm> terms = terms_;
  Index next = 0;
  for (KernelTerm& term : terms) {
    term.alpha = values[next];
    term.weight = values[next + 1];
    next += kOfKernelTerm;
  }
  const Index of_noise = noise_->parameters().size();
  options.kernel = KernelOperator(std::move(terms));
  options.noise = options_.noise.of(noise_->with_parameters(values.segment(next, of_noise)));
  options.sigma = values[next + of_noise];
  options.lambda = values[next + of_noise + 1];
  return options;
}

}  // namespace pulson::matching
