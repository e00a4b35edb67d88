#include "starting_values.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/core.h>

#include "core/spec_text.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/random/brownian.hpp"
#include "registration_problem.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;

constexpr int kDraws = 16;          // the variance of dN sums to 1/√(8 dN): the search spans a factor 100 each way
constexpr std::uint64_t kSeed = 1;  // of these draws

// Of the text, with these values of its missing numbers.
std::string with_numbers(std::string_view text, const std::vector<MissingNumber>& missing,
                         const Eigen::VectorXd& values) {
  std::vector<Spec> terms = parse_spec_sum(text, "noise");
  std::vector<std::string> names;
  for (const Spec& term : terms) names.push_back(term.name);
  const std::vector<std::string> owners = term_owners(names);
  std::string filled;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    for (std::size_t j = 0; j < missing.size(); ++j) {
      const std::string& name = missing[j].name;
      const std::string key = name.substr(name.find_last_of('.') + 1);
      if (name == owners[i] + key) terms[i].values[key] = fmt::format("{:.3g}", values[static_cast<Index>(j)]);
    }
    filled.append(i > 0 ? "+" : "").append(text_of_spec(terms[i]));
  }
  return filled;
}

// What each coordinate moves beyond σ, mean square over the targets.
double observed_variance(const std::vector<RegistrationProblem>& problems) {
  double sum = 0, count = 0;
  for (const RegistrationProblem& problem : problems) {
    const Eigen::ArrayXXd squares = (problem.target.points - problem.source.points).array().square();
    sum += squares.isNaN().select(0, squares).sum();
    count += static_cast<double>(squares.isFinite().count());
  }
  const double noise = std::pow(problems.front().matching.sigma, 2);
  return std::max(sum / std::max(1.0, count), 2 * noise) - noise;
}

// The variance of a coordinate of q(T) by these channels alone, to first order about the source at rest.
double variance_by(const StochasticSystem& system, const RegistrationProblem& problem,
                   const std::vector<int>& channels) {
  const Points& q0 = problem.source.points;
  const Points zero = Points::Zero(q0.rows(), q0.cols());
  const TimeGrid& grid = problem.matching.grid;
  const int all = system.noise->channels(static_cast<int>(q0.rows()), static_cast<int>(q0.cols()));
  const auto integrator = make_integrator("heun");
  const Trajectory path = integrator->integrate(system, {q0, zero}, grid, Eigen::MatrixXd::Zero(all, grid.steps));
  double sum = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::MatrixXd drawn = brownian_increments(kSeed, static_cast<std::uint64_t>(draw), all, grid);
    PathChange change{{zero, zero}, Eigen::MatrixXd::Zero(all, grid.steps), {}};
    for (const int channel : channels) change.increments.row(channel) = drawn.row(channel);
    sum += integrator->tangent(system, path, change).q.squaredNorm();
  }
  return sum / (kDraws * static_cast<double>(q0.size()));
}

}  // namespace

std::string with_starting_values(const OpenSpec& noise, const Landmarks& source, const std::vector<Landmarks>& targets,
                                 RegistrationOptions options) {
  const std::vector<MissingNumber> missing = missing_numbers(noise.text, noise_table());
  if (missing.empty()) return noise.text;
  options.noise = "none";
  options.mode = std::nullopt;
  options.integrator = "auto";
  std::vector<RegistrationProblem> problems;
  for (const Landmarks& target : targets) problems.push_back(make_problem(source, target, options));
  const RegistrationProblem& first = problems.front();
  const KernelOperator& kernel = first.matching.system.kernel;
  Eigen::VectorXd values = Eigen::VectorXd::Constant(std::ssize(missing), std::pow(kernel.terms().front().alpha, 2));
  std::shared_ptr<const NoiseModel> model = make_noise(with_numbers(noise.text, missing, values), first.source);
  const std::vector<std::string> names = model->parameter_names();
  std::vector<std::pair<Index, NoiseAmplitude>> amplitudes;  // by the place of the missing number
  for (const NoiseAmplitude& amplitude : model->amplitudes(first.source.dimension(), first.source.count())) {
    const std::string& name = names[static_cast<std::size_t>(amplitude.parameter)];
    const auto place =
        std::find_if(missing.begin(), missing.end(), [&](const MissingNumber& number) { return number.name == name; });
    if (place != missing.end()) amplitudes.emplace_back(place - missing.begin(), amplitude);
  }
  const double share = observed_variance(problems) / static_cast<double>(amplitudes.size() + 1);
  for (const auto& [place, amplitude] : amplitudes) {
    const double variance = variance_by({kernel, model}, first, amplitude.channels);
    if (!(variance > 0))
      throw InputError(
          fmt::format("noise '{}' moves no landmark of a shape at rest; give {} a starting value, as in 1:fit",
                      model->spec(), missing[static_cast<std::size_t>(place)].name));
    values[place] *= std::pow(share / variance, 0.5 / amplitude.power);
  }
  return with_numbers(noise.text, missing, values);
}

}  // namespace pulson::matching
