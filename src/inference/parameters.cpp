#include "parameters.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

#include "core/open_numbers.hpp"
#include "matching/model_parameters.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// The part of a name behind its term's: `beta` of `ch-sd#2.beta`.
std::string after_dot(const std::string& name) { return name.substr(name.find_last_of('.') + 1); }

AllParameters all_parameters(const matching::RegistrationProblem& problem,
                             const matching::RegistrationOptions& options) {
  const matching::ModelParameters parameters(problem, options);
  return {parameters.names(),
          {parameters.values().begin(), parameters.values().end()},
          std::ssize(problem.matching.system.kernel.terms())};
}

bool names_place(const std::string& asked, const std::string& full) {
  return full == asked || after_dot(full) == asked;
}

ParameterPrior make_prior(const std::string& asked, const AllParameters& all) {
  const std::size_t equals = asked.find('=');
  ParameterPrior prior{asked.substr(0, equals), 0, 0};
  prior.log_deviation = equals == std::string::npos
                            ? usual_log_deviation(after_dot(prior.name))
                            : parse_number(std::string_view(asked).substr(equals + 1), "the prior of " + prior.name);
  if (!(prior.log_deviation > 0 && prior.log_deviation <= 3))
    throw InputError(fmt::format("the prior of {} has the log deviation {}; it must be between 0 and 3", prior.name,
                                 prior.log_deviation));
  std::vector<std::string> valid;
  for (std::size_t i = 0; i < all.names.size(); ++i) {
    if (names_place(prior.name, all.names[i]) && prior.median == 0) prior.median = all.values[i];
    if (all.values[i] > 0) valid.push_back(after_dot(all.names[i]));
  }
  if (prior.median > 0) return prior;
  throw InputError(fmt::format("{} is not a positive parameter of these models{}", quoted_line(prior.name),
                               advice_on_name(prior.name, valid)));
}

}  // namespace

double usual_log_deviation(std::string_view name) { return name == "data-sigma" || name == "alpha" ? 0.25 : 0.5; }

std::vector<std::string> every_parameter(const AllParameters& all) {
  std::vector<std::string> names = {"alpha"};
  for (Index i = 2 * all.kernel_terms; i < std::ssize(all.names); ++i)
    if (all.values[static_cast<std::size_t>(i)] > 0) names.push_back(all.names[static_cast<std::size_t>(i)]);
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

PosteriorProblem make_specimens(const Landmarks& source, const std::vector<Landmarks>& targets,
                                matching::RegistrationOptions options, AllParameters& all) {
  if (targets.empty()) throw InputError("there is no target");
  if (options.data.kind != matching::DataKind::kLandmarks)
    throw InputError("the posterior needs landmarks as data: the cost of a curve is no normalised density");
  if (options.loss && targets.size() > 1)
    throw InputError(fmt::format("a loss fits sigma to one target, and there are {}; give one", targets.size()));
  options.uncertainty = true;  // so that the mode is that of probabilities
  if (options.integrator == "auto") options.integrator = "heun";
  PosteriorProblem problem;
  for (const Landmarks& target : targets) {
    matching::RegistrationProblem made = make_problem(source, target, options);
    if (problem.specimens.empty()) {
      all = all_parameters(made, options);
      options.kernel = made.matching.system.kernel;
      options.sigma = made.matching.sigma;
      options.lambda = made.matching.lambda;
      if (!options.noise.is_own()) options.noise = made.matching.system.noise->spec();
      problem.notes = made.notes;
      if (made.robust) problem.weights = made.robust->weights;
    }
    note_suspects(made, problem);
    if (!made.matching.realisations.empty()) throw InputError("a posterior has no frozen realisations of the noise");
    problem.specimens.push_back(std::move(made.matching));
    problem.sources.push_back(std::move(made.source));
    problem.targets.push_back(std::move(made.target));
  }
  return problem;
}

void add_priors(PosteriorProblem& problem, const AllParameters& all, const std::vector<std::string>& names) {
  std::vector<char> taken(all.names.size(), 0);
  for (const std::string& name : names) {
    problem.parameters.push_back(make_prior(name, all));
    for (std::size_t i = 0; i < all.names.size(); ++i)
      if (names_place(problem.parameters.back().name, all.names[i]) && std::exchange(taken[i], 1) != 0)
        throw InputError(fmt::format("{} is to be sampled twice", quoted_line(all.names[i])));
  }
  static_cast<void>(ParameterSpace(problem));
}

PosteriorProblem make_posterior_problem(const Landmarks& source, const std::vector<Landmarks>& targets,
                                        matching::RegistrationOptions options,
                                        const std::vector<std::string>& parameters) {
  AllParameters all;
  PosteriorProblem problem = make_specimens(source, targets, std::move(options), all);
  std::vector<std::string> names;
  for (const std::string& name : parameters) {
    const std::vector<std::string> of_all = name == "all" ? every_parameter(all) : std::vector<std::string>{name};
    names.insert(names.end(), of_all.begin(), of_all.end());
  }
  add_priors(problem, all, names);
  return problem;
}

ParameterSpace::ParameterSpace(const PosteriorProblem& problem)
    : priors_(problem.parameters),
      kernel_(std::make_shared<KernelOperator>(problem.specimens.front().system.kernel)),
      noise_(problem.specimens.front().system.noise),
      lambda_(problem.specimens.front().lambda) {
  const std::vector<std::string> of_noise = noise_->parameter_names();
  std::vector<std::string> terms;
  for (const Spec& term : parse_spec_sum(kernel_->spec(), "kernel")) terms.push_back(term.name);
  const std::vector<std::string> owners = term_owners(terms);
  for (const ParameterPrior& prior : priors_) {
    std::vector<Place>& places = places_.emplace_back();
    for (std::size_t i = 0; i < terms.size(); ++i) {
      const auto index = static_cast<Index>(i);
      if (names_place(prior.name, owners[i] + "alpha")) places.push_back({Kind::kAlpha, index});
      if (names_place(prior.name, owners[i] + "weight")) places.push_back({Kind::kWeight, index});
    }
    for (std::size_t i = 0; i < of_noise.size(); ++i)
      if (names_place(prior.name, of_noise[i])) places.push_back({Kind::kNoise, static_cast<Index>(i)});
    if (prior.name == "data-sigma") places.push_back({Kind::kSigma, 0});
    if (prior.name == "lambda") places.push_back({Kind::kLambda, 0});
    for (const Place& place : places)
      samples_kernel_ = samples_kernel_ || place.kind == Kind::kAlpha || place.kind == Kind::kWeight;
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
  posterior::Numbers numbers{kernel_, noise_, lambda_, 1};
  std::vector<KernelTerm> terms = kernel_->terms();
  VectorXd of_noise = noise_->parameters();
  bool noise_changes = false;
  for (std::size_t j = 0; j < priors_.size(); ++j) {
    const double factor = std::exp(priors_[j].log_deviation * phi[static_cast<Index>(j)]);
    for (const Place& place : places_[j]) switch (place.kind) {
        case Kind::kAlpha:
          terms[static_cast<std::size_t>(place.index)].alpha *= factor;
          break;
        case Kind::kWeight:
          terms[static_cast<std::size_t>(place.index)].weight *= factor;
          break;
        case Kind::kNoise:
          of_noise[place.index] *= factor;
          noise_changes = true;
          break;
        case Kind::kSigma:
          numbers.sigma *= factor;
          break;
        case Kind::kLambda:
          numbers.lambda *= factor;
          break;
      }
  }
  if (samples_kernel_) numbers.kernel = std::make_shared<KernelOperator>(std::move(terms));
  if (noise_changes) numbers.noise = noise_->with_parameters(of_noise);
  return numbers;
}

}  // namespace pulson::inference
