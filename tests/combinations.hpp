#pragma once

#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include "pulson/integrators/integrator.hpp"
#include "pulson/noise/noise_table.hpp"

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

/// Each row of noise_table() with 0.3 for what has no default, and once more on some of the landmarks where it can be.
inline std::vector<std::string> noise_specs() {
  std::vector<std::string> specs;
  for (const auto& row : noise_table().rows()) {
    std::string spec = row.name;
    bool on = false;
    for (const ParameterInfo& parameter : row.parameters) {
      if (parameter.default_text.empty()) spec += (spec == row.name ? ":" : ",") + parameter.name + "=0.3";
      on = on || parameter.name == "on";
    }
    specs.push_back(spec);
    if (on) specs.push_back(spec + (spec == row.name ? ":" : ",") + "on=1/3");
  }
  return specs;
}

/// Every integrator with every noise and every kernel: a new row of a table is tested by being there.
inline std::vector<Combination> all_combinations() {
  std::vector<Combination> all;
  for (const auto& integrator : integrator_table().rows())
    for (const std::string& noise : noise_specs())
      for (const std::string& kernel : kernel_specs()) all.push_back({integrator.name, noise, kernel});
  return all;
}

/// Numbers from −1 to 1, always the same.
class Numbers {
 public:
  explicit Numbers(unsigned seed) : engine_(seed) {}
  double operator()() { return std::uniform_real_distribution<double>(-1, 1)(engine_); }
  Eigen::MatrixXd operator()(Eigen::Index rows, Eigen::Index cols) {
    return Eigen::MatrixXd::NullaryExpr(rows, cols, [this](Eigen::Index, Eigen::Index) { return (*this)(); });
  }
  /// Landmarks that are at least 0.4 apart along the first axis.
  Points landmarks(int d, int n) {
    Points q = (*this)(d, n);
    for (int a = 0; a < n; ++a) q(0, a) = 0.6 * a + 0.1 * q(0, a);
    return q;
  }

 private:
  std::mt19937 engine_;
};

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
    system = {make_kernel(c.kernel, start.q), make_noise(c.noise)};
    increments = std::sqrt(3 * grid.dt()) * numbers(system.noise->channels(d, n), grid.steps);
  }
  Trajectory path() const { return integrator->integrate(system, start, grid, increments); }
  PhaseState random_state() {
    return {numbers(start.q.rows(), start.q.cols()), numbers(start.q.rows(), start.q.cols())};
  }
  Eigen::MatrixXd random_increments() { return numbers(increments.rows(), increments.cols()); }

  std::unique_ptr<const Integrator> integrator;
  TimeGrid grid;
  Numbers numbers;
  PhaseState start;
  StochasticSystem system{KernelOperator({KernelTerm{}}), nullptr};
  Eigen::MatrixXd increments;
};

inline double dot(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return a.cwiseProduct(b).sum(); }
inline double dot(const PhaseState& a, const PhaseState& b) { return dot(a.q, b.q) + dot(a.p, b.p); }
inline double norm(const PhaseState& a) { return std::sqrt(dot(a, a)); }
inline double largest(const Eigen::MatrixXd& a) { return a.size() == 0 ? 0 : a.cwiseAbs().maxCoeff(); }

/// The largest entry of q⁺ − q − Δt K(q⁺)p − Σ h_i,p w and of p⁺ − p + Δt H_q(q⁺,p) over all steps, beside what is
/// added up in them: q and Δt Σ|p|, p and Δt Σ|p|² Lip(K).
inline double defect(const Problem& problem, const Trajectory& path) {
  const KernelOperator& kernel = problem.system.kernel;
  const Eigen::MatrixXd w = acting_increments(problem.increments);
  const double dt = path.grid.dt();
  double worst = 0;
  for (int k = 0; k < path.grid.steps; ++k) {
    const PhaseState& now = path.states[static_cast<std::size_t>(k)];
    const PhaseState& next = path.states[static_cast<std::size_t>(k) + 1];
    const Points c = now.q + problem.system.noise->position_noise(now, w.col(k));
    const Points q_error = next.q - c - dt * hamiltonian_p(kernel, next.q, now.p);
    const Points p_error = next.p - now.p + dt * hamiltonian_q(kernel, next.q, now.p);
    const double total = now.p.cwiseAbs().sum();
    worst = std::max(worst, largest(q_error) / (largest(c) + dt * kernel.at_zero() * total));
    worst = std::max(worst, largest(p_error) / (largest(now.p) + dt * kernel.lipschitz() * total * total));
  }
  return worst;
}

}  // namespace pulson
