#include "parameters.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/core.h>

#include "core/open_numbers.hpp"
#include "matching/registration_problem.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr Index kOfKernelTerm = 2;  // alpha, weight

// The part of a name behind its term's: `beta` of `ch-sd#2.beta`.
std::string after_dot(const std::string& name) { return name.substr(name.find_last_of('.') + 1); }

ParameterPrior make_prior(const std::string& asked, const ModelNumbers& all) {
  const std::size_t equals = asked.find('=');
  ParameterPrior prior{asked.substr(0, equals), 0, 0};
  prior.log_deviation = equals == std::string::npos
                            ? usual_log_deviation(after_dot(prior.name))
                            : parse_number(std::string_view(asked).substr(equals + 1), "the prior of " + prior.name);
  if (!(prior.log_deviation > 0 && prior.log_deviation <= 3))
    throw InputError(fmt::format("the prior of {} has the log deviation {}; it must be between 0 and 3", prior.name,
                                 prior.log_deviation));
  prior.median = all.values()[all.places(prior.name).front()];
  return prior;
}

}  // namespace

ModelNumbers::ModelNumbers(const matching::MatchingProblem& problem)
    : kernel_(std::make_shared<KernelOperator>(problem.system.kernel)), noise_(problem.system.noise) {
  std::vector<double> values;
  std::vector<std::string> terms;
  for (const Spec& term : parse_spec_sum(kernel_->spec(), "kernel")) terms.push_back(term.name);
  const std::vector<std::string> owners = term_owners(terms);
  for (std::size_t i = 0; i < owners.size(); ++i) {
    names_.insert(names_.end(), {owners[i] + "alpha", owners[i] + "weight"});
    values.insert(values.end(), {kernel_->terms()[i].alpha, kernel_->terms()[i].weight});
  }
  for (const std::string& name : noise_->parameter_names()) names_.push_back(name);
  for (const double value : noise_->parameters()) values.push_back(value);
  names_.insert(names_.end(), {"data-sigma", "lambda"});
  values.insert(values.end(), {problem.sigma, problem.lambda});
  values_ = VectorXd::Map(values.data(), std::ssize(values));
}

std::vector<Index> ModelNumbers::places(const std::string& name) const {
  std::vector<Index> places;
  std::vector<std::string> valid;
  for (Index i = 0; i < values_.size(); ++i) {
    const std::string& full = names_[static_cast<std::size_t>(i)];
    if (full == name || after_dot(full) == name) places.push_back(i);
    for (const std::string& spelling : {after_dot(full), full})
      if (std::find(valid.begin(), valid.end(), spelling) == valid.end()) valid.push_back(spelling);
  }
  if (places.empty())
    throw InputError(
        fmt::format("{} is not a parameter of these models{}", quoted_line(name), advice_on_name(name, valid)));
  for (const Index place : places)
    if (!(values_[place] > 0))
      throw InputError(fmt::format("{} is {}; what is fitted, by its logarithm, must be greater than 0 at the start",
                                   quoted_line(names_[static_cast<std::size_t>(place)]), values_[place]));
  return places;
}

posterior::Numbers ModelNumbers::at(const VectorXd& values) const {
  std::vector<KernelTerm> terms = kernel_->terms();
  const Index of_kernel = kOfKernelTerm * std::ssize(terms), of_noise = noise_->parameters().size();
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const Index first = kOfKernelTerm * static_cast<Index>(i);
    terms[i].alpha = values[first];
    terms[i].weight = values[first + 1];
  }
  const auto same = [&](Index first, Index count) {
    return values.segment(first, count) == values_.segment(first, count);
  };
  return {same(0, of_kernel) ? kernel_ : std::make_shared<const KernelOperator>(std::move(terms)),
          same(of_kernel, of_noise) ? noise_ : noise_->with_parameters(values.segment(of_kernel, of_noise)),
          values[of_kernel + of_noise + 1], values[of_kernel + of_noise] / values_[of_kernel + of_noise]};
}

matching::MatchingProblem problem_at(matching::MatchingProblem problem, const posterior::Numbers& numbers) {
  problem.system = {*numbers.kernel, numbers.noise};
  problem.lambda = numbers.lambda;
  problem.sigma *= numbers.sigma;
  std::vector<Index> all(static_cast<std::size_t>(problem.source.cols()));
  std::iota(all.begin(), all.end(), Index{0});
  const double weight = 1 / (numbers.sigma * numbers.sigma);
  problem.data = std::make_shared<matching::LandmarkTerm>(problem.data->landmarks()->part(all, weight));
  return problem;
}

double usual_log_deviation(std::string_view name) { return name == "data-sigma" || name == "alpha" ? 0.25 : 0.5; }

std::vector<std::string> every_parameter(const PosteriorProblem& problem) {
  const ModelNumbers all(problem.specimens.front());
  std::vector<std::string> names = {"alpha"};
  for (Index i = kOfKernelTerm * std::ssize(problem.specimens.front().system.kernel.terms()); i < all.values().size();
       ++i)
    if (all.values()[i] > 0) names.push_back(all.names()[static_cast<std::size_t>(i)]);
  return names;
}

namespace {

void note_suspects(const matching::RegistrationProblem& made, PosteriorProblem& problem) {
  std::vector<int> suspects;
  for (Eigen::Index a = 0; a < problem.weights.size(); ++a)
    if (problem.weights[a] < matching::kSuspectWeight) suspects.push_back(static_cast<int>(a));
  if (suspects.empty()) return;
  problem.notes.push_back(matching::note_of_suspects(made.target, suspects));
}

}  // namespace

Specimens make_specimens(const Landmarks& source, const std::vector<Landmarks>& targets,
                         matching::RegistrationOptions options) {
  if (targets.empty()) throw InputError("there is no target");
  if (options.data.kind != matching::DataKind::kLandmarks)
    throw InputError(
        "probabilities need landmarks as data: the cost of a curve is not the logarithm of a normalised density");
  if (options.loss && targets.size() > 1)
    throw InputError(fmt::format("a loss fits sigma to one target, and there are {}; give one", targets.size()));
  options.uncertainty = true;  // so that the mode is that of probabilities
  Specimens made_of;
  PosteriorProblem& problem = made_of.problem;
  for (const Landmarks& target : targets) {
    matching::RegistrationProblem made = make_problem(source, target, options);
    if (problem.specimens.empty()) {
      options.kernel = made.matching.system.kernel;
      options.sigma = made.matching.sigma;
      options.lambda = made.matching.lambda;
      if (!options.noise.is_own()) options.noise = made.matching.system.noise->spec();
      problem.notes = made.notes;
      if (made.robust) problem.weights = made.robust->weights;
    }
    note_suspects(made, problem);
    if (!made.matching.realisations.empty())
      throw InputError(
          fmt::format("probabilities are of all that the noise may do, and mode {} holds what it does; "
                      "take mode map",
                      matching::mode_name(made.mode)));
    made_of.free_coordinates += free_coordinates(made);
    problem.specimens.push_back(std::move(made.matching));
    problem.sources.push_back(std::move(made.source));
    problem.targets.push_back(std::move(made.target));
  }
  return made_of;
}

void add_priors(PosteriorProblem& problem, const std::vector<std::string>& names) {
  const ModelNumbers all(problem.specimens.front());
  std::vector<char> taken(all.names().size(), 0);
  for (const std::string& name : names) {
    problem.parameters.push_back(make_prior(name, all));
    for (const Index place : all.places(problem.parameters.back().name))
      if (std::exchange(taken[static_cast<std::size_t>(place)], 1) != 0)
        throw InputError(
            fmt::format("{} is to be fitted twice", quoted_line(all.names()[static_cast<std::size_t>(place)])));
  }
}

PosteriorProblem make_posterior_problem(const Landmarks& source, const std::vector<Landmarks>& targets,
                                        matching::RegistrationOptions options,
                                        const std::vector<std::string>& parameters) {
  if (options.integrator == "auto") options.integrator = "heun";
  PosteriorProblem problem = make_specimens(source, targets, std::move(options)).problem;
  std::vector<std::string> names;
  for (const std::string& name : parameters) {
    const std::vector<std::string> of_all = name == "all" ? every_parameter(problem) : std::vector<std::string>{name};
    names.insert(names.end(), of_all.begin(), of_all.end());
  }
  add_priors(problem, names);
  return problem;
}

ParameterSpace::ParameterSpace(const PosteriorProblem& problem)
    : priors_(problem.parameters), numbers_(problem.specimens.front()) {
  const Index of_kernel = kOfKernelTerm * std::ssize(problem.specimens.front().system.kernel.terms());
  for (const ParameterPrior& prior : priors_) {
    places_.push_back(numbers_.places(prior.name));
    samples_kernel_ = samples_kernel_ || places_.back().front() < of_kernel;
  }
}

VectorXd ParameterSpace::values(const VectorXd& phi) const {
  VectorXd values(count());
  for (Index j = 0; j < count(); ++j) {
    const ParameterPrior& prior = priors_[static_cast<std::size_t>(j)];
    values[j] = prior.median * std::exp(prior.log_deviation * phi[j]);
  }
  return values;
}

posterior::Numbers ParameterSpace::at(const VectorXd& phi) const {
  VectorXd values = numbers_.values();
  for (std::size_t j = 0; j < priors_.size(); ++j)
    values(places_[j]) *= std::exp(priors_[j].log_deviation * phi[static_cast<Index>(j)]);
  return numbers_.at(values);
}

}  // namespace pulson::inference
