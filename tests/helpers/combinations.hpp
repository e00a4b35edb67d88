#pragma once

#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "pulson/integrators/integrator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "random_numbers.hpp"

namespace pulson {

/// One integrator, noise and kernel of the tables, as specifications.
struct Combination {
  std::string integrator;
  std::string noise;
  std::string kernel;
};

inline std::string text_of(const Combination& c) { return c.integrator + "__" + c.noise + "__" + c.kernel; }
inline std::ostream& operator<<(std::ostream& out, const Combination& c) { return out << text_of(c); }

/// What GoogleTest may call a test of this combination.
inline std::string test_name(const Combination& c) {
  std::string name = text_of(c);
  std::replace_if(
      name.begin(), name.end(), [](unsigned char x) { return std::isalnum(x) == 0; }, '_');
  return name;
}

/// Each row of kernel_table(), and the sum of all.
inline std::vector<std::string> kernel_specs() {
  std::vector<std::string> specs;
  std::string sum;
  for (const auto& row : kernel_table().rows()) {
    specs.push_back(row.name + ":alpha=0.9");
    sum += (sum.empty() ? "" : "+") + row.name + ":alpha=0.6,weight=0.5";
  }
  specs.push_back(sum);
  return specs;
}

/// Each row of noise_table() with 0.3 (a range: 0.8) for what has no default, once more for each of its variants, and
/// two sums.
inline std::vector<std::string> noise_specs() {
  const std::vector<std::string> variants = {"on=1/3", "common=1", "fields=cos,wavenumber=1.3",
                                             "fields=grid,count=2,width=0.8",
                                             "fields=bump,center=0.3/0.2/0.1/1/0.3/0.6,width=0.7"};
  std::vector<std::string> specs;
  for (const auto& row : noise_table().rows()) {
    std::string spec = row.name;
    for (const ParameterInfo& parameter : row.parameters)
      if (parameter.default_text.empty())
        spec += (spec == row.name ? ":" : ",") + parameter.name + (parameter.name == "gamma" ? "=0.8" : "=0.3");
    specs.push_back(spec);
    for (const std::string& variant : variants)
      for (const ParameterInfo& parameter : row.parameters)
        if (variant.starts_with(parameter.name + "=")) specs.push_back(spec + (spec == row.name ? ":" : ",") + variant);
  }
  specs.emplace_back("ch-sd:beta=0.3,on=2+potential:beta=0.2,gamma=0.5");
  specs.emplace_back("p-sd:beta=0.2,fields=cos+langevin:sigma=0.1,friction=0.4");
  return specs;
}

/// No noise, and of noise_specs() those whose potentials are linear in p, with a sum of all: what an
/// EffectiveHamiltonian takes.
inline std::vector<std::string> linear_noise_specs() {
  std::vector<std::string> specs{"none"};
  std::string sum;
  Landmarks shape;
  shape.points = Points{{0, 1, 2}, {0, 1, 0}};
  for (const std::string& spec : noise_specs()) {
    if (spec == "none" || !make_noise(spec, shape)->traits().linear) continue;
    specs.push_back(spec);
    sum += (sum.empty() ? "" : "+") + spec;
  }
  specs.push_back(sum);
  return specs;
}

/// Every integrator with every noise that it takes, and without noise and with constant noise with every kernel: a new
/// row of a table is tested by being there.
inline std::vector<Combination> all_combinations() {
  const std::string plain = kernel_specs().front();
  std::vector<Combination> all;
  for (const auto& integrator : integrator_table().rows())
    for (const std::string& noise : noise_specs())
      for (const std::string& kernel : kernel_specs())
        if ((kernel == plain || noise == "none" || noise == "ch-sd:beta=0.3") &&
            (noise == "none" || integrator.make()->traits().noise))
          all.push_back({integrator.name, noise, kernel});
  return all;
}

/// The slope of the line through (log x, log y): the order of y in x.
inline double fitted_order(const std::vector<double>& x, const std::vector<double>& y) {
  const auto n = static_cast<Eigen::Index>(x.size());
  const Eigen::ArrayXd u = Eigen::Map<const Eigen::ArrayXd>(x.data(), n).log();
  const Eigen::ArrayXd v = Eigen::Map<const Eigen::ArrayXd>(y.data(), n).log();
  return ((u - u.mean()) * (v - v.mean())).sum() / (u - u.mean()).square().sum();
}

/// A system of N landmarks in R^d with a start, a grid and increments.
struct Problem {
  Problem(const Combination& c, int d, int n, TimeGrid time_grid = {0.4, 4}, double speed = 0.6)
      : integrator(make_integrator(c.integrator)), grid(time_grid), numbers(static_cast<unsigned>(100 * d + n)) {
    start = {numbers.landmarks(d, n), speed * numbers(d, n)};
    shape.points = start.q;
    system = {make_kernel(c.kernel, start.q), make_noise(c.noise, shape)};
    increments = std::sqrt(3 * grid.dt()) * numbers(system.noise->channels(d, n), grid.steps);
  }
  Trajectory path() const { return integrator->integrate(system, start, grid, increments); }
  PhaseState random_state() {
    return {numbers(start.q.rows(), start.q.cols()), numbers(start.q.rows(), start.q.cols())};
  }
  PathChange random_change() {
    return {random_state(), numbers(increments.rows(), increments.cols()),
            0.1 * numbers(system.noise->parameters().size(), 1)};
  }

  std::unique_ptr<const Integrator> integrator;
  TimeGrid grid;
  Numbers numbers;
  PhaseState start;
  Landmarks shape;  // at the start
  StochasticSystem system{KernelOperator({KernelTerm{}}), nullptr};
  Eigen::MatrixXd increments;
};

inline double dot(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return a.cwiseProduct(b).sum(); }
inline double dot(const PhaseState& a, const PhaseState& b) { return dot(a.q, b.q) + dot(a.p, b.p); }
inline double dot(const PathGradient& gradient, const PathChange& change) {
  return dot({gradient.q0_bar, gradient.p0_bar}, change.initial) + dot(gradient.increments_bar, change.increments) +
         gradient.parameters_bar.dot(change.parameters);
}
inline double norm(const PhaseState& a) { return std::sqrt(dot(a, a)); }
inline double largest(const Eigen::MatrixXd& a) { return a.size() == 0 ? 0 : a.cwiseAbs().maxCoeff(); }

/// The largest relative error in the equations of the variational integrators over all steps: of
/// q⁺ − q − Σ h_i,p w − Δt (H + G)_p(q⁺,p), p + Σ h_i,q w − p̂ and p̂⁺ − p + Δt (H + G)_q(q⁺,p) + λΔt H_p(q⁺,p), beside
/// what is added up in them: q and Δt Σ|p|, p and Δt Σ|p|² Lip(K).
inline double variational_defect(const Problem& problem, const Trajectory& path) {
  const KernelOperator& kernel = problem.system.kernel;
  const NoiseModel& noise = *problem.system.noise;
  const bool compensates = path.integrator == "variational" && noise.traits().compensated;
  const Eigen::MatrixXd w = acting_increments(problem.increments);
  const double dt = path.grid.dt();
  double worst = 0;
  for (int k = 0; k < path.grid.steps; ++k) {
    const PhaseState& now = path.states[static_cast<std::size_t>(k)];
    const PhaseState& next = path.states[static_cast<std::size_t>(k) + 1];
    const Points& p = path.step_momenta(k);
    const PhaseState h = noise.gradient({now.q, p}, w.col(k));
    const Points zero = Points::Zero(p.rows(), p.cols());
    const PhaseState g = compensates ? noise.compensation_gradient({next.q, p}) : PhaseState{zero, zero};
    const Points velocity = hamiltonian_p(kernel, next.q, p);
    const Points q_error = next.q - now.q - h.p - dt * (velocity + g.p);
    const Points inner_error = p + h.q - now.p;
    const Points p_error = next.p - p + dt * (hamiltonian_q(kernel, next.q, p) + g.q + noise.friction() * velocity);
    const double total = p.cwiseAbs().sum();
    worst = std::max(worst, largest(q_error) / (largest(now.q) + largest(h.p) + dt * kernel.at_zero() * total));
    worst = std::max(worst, largest(inner_error) / (largest(now.p) + largest(h.q)));
    worst = std::max(worst, largest(p_error) / (largest(p) + dt * kernel.lipschitz() * total * total));
  }
  return worst;
}

}  // namespace pulson
