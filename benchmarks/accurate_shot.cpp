#include "accurate_shot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "pulson/noise/noise_table.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr int kFewestSteps = 400, kMostSteps = 3200;
constexpr Index kManyLandmarks = 500;
constexpr double kStepTolerance = 1e-6;  // diameters

// K and K'/r at the distance r.
struct Radial {
  double value = 0;
  double slope = 0;
};

Radial radial(const KernelTerm& term, double squared) {
  const double a = term.alpha, r = std::sqrt(squared), w = term.weight;
  switch (term.profile) {
    case KernelProfile::kGaussian: {
      const double value = w * std::exp(-squared / (a * a));
      return {value, -2 / (a * a) * value};
    }
    case KernelProfile::kPeakon: {
      const double value = w * std::exp(-r / a);
      return {value, r > 0 ? -value / (a * r) : 0};
    }
    case KernelProfile::kMatern32: {
      const double x = std::sqrt(3.0) * r / a, e = w * std::exp(-x);
      return {(1 + x) * e, -3 / (a * a) * e};
    }
    case KernelProfile::kMatern52: {
      const double x = std::sqrt(5.0) * r / a, e = w * std::exp(-x);
      return {(1 + x + x * x / 3) * e, -5 / (3 * a * a) * (1 + x) * e};
    }
  }
  return {};
}

struct Rate {
  Points q, p;
  double energy = 0;  // H
  double action = 0;  // ½|u|²
};

template <int d>
Rate hamiltonian_rate(const std::vector<KernelTerm>& terms, const PhaseState& state) {
  using Columns = Eigen::Matrix<double, d, Eigen::Dynamic>;
  const Index n = state.q.cols();
  const Eigen::Map<const Columns> q(state.q.data(), d, n), p(state.p.data(), d, n);
  Columns velocity = Columns::Zero(d, n), force = Columns::Zero(d, n);
  for (Index b = 0; b < n; ++b) {
    for (const KernelTerm& term : terms) velocity.col(b) += term.weight * p.col(b);
    for (Index a = 0; a < b; ++a) {
      const Eigen::Matrix<double, d, 1> z = q.col(a) - q.col(b);
      const double squared = z.squaredNorm();
      Radial k;
      for (const KernelTerm& term : terms) {
        const Radial one = radial(term, squared);
        k.value += one.value;
        k.slope += one.slope;
      }
      velocity.col(a) += k.value * p.col(b);
      velocity.col(b) += k.value * p.col(a);
      const double pull = p.col(a).dot(p.col(b)) * k.slope;
      force.col(a) -= pull * z;
      force.col(b) += pull * z;
    }
  }
  const double energy = 0.5 * p.cwiseProduct(velocity).sum();
  return {velocity, force, energy, 0};
}

// The right-hand side.
class ControlledFlow {
 public:
  explicit ControlledFlow(const matching::Registration& registration)
      : lambda_(registration.lambda),
        terms_(make_kernel(registration.kernel, registration.source.points).terms()),
        noise_(make_noise(registration.noise, registration.source)),
        is_plain_(registration.noise.starts_with("ch-sd:") && registration.noise.find("on=") == std::string::npos &&
                  registration.noise.find('+') == std::string::npos) {}

  Rate operator()(const PhaseState& state, const VectorXd& controls) const {
    const Index d = state.q.rows();
    Rate rate = d == 1   ? hamiltonian_rate<1>(terms_, state)
                : d == 2 ? hamiltonian_rate<2>(terms_, state)
                         : hamiltonian_rate<3>(terms_, state);
    if (controls.size() == 0) return rate;
    if (is_plain_) {
      rate.q += noise_->parameters()[0] * Eigen::Map<const Points>(controls.data(), d, state.q.cols());
    } else {
      const PhaseState gradient = noise_->gradient(state, controls);
      rate.q += gradient.p;
      rate.p -= gradient.q;
    }
    return rate;
  }

  // Those of metamorphosis: u_i = λh_i.
  VectorXd best_controls(const PhaseState& state) const {
    if (!is_plain_) return lambda_ * noise_->potentials(state);
    return lambda_ * noise_->parameters()[0] * state.p.reshaped();
  }

 private:
  double lambda_;
  std::vector<KernelTerm> terms_;
  std::shared_ptr<const NoiseModel> noise_;
  bool is_plain_;  // ch-sd on all landmarks
};

struct Shot {
  Points end;
  double initial_energy = 0;  // H at t = 0
  double energy = 0;          // ∫H dt
  double action = 0;          // ½∫|u|² dt
};

PhaseState moved(const PhaseState& state, const Rate& rate, double dt) {
  return {state.q + dt * rate.q, state.p + dt * rate.p};
}

// Of mode metamorphosis, whose controls follow from the state.
Shot shoot_metamorphosis(const ControlledFlow& flow, const matching::Registration& registration, int steps) {
  const double h = registration.grid.time / steps;
  PhaseState state{registration.source.points, registration.momenta};
  Shot shot;
  const auto rate = [&](const PhaseState& at) {
    const VectorXd u = flow.best_controls(at);
    Rate r = flow(at, u);
    r.action = 0.5 * u.squaredNorm();
    return r;
  };
  for (int k = 0; k < steps; ++k) {
    const Rate a = rate(state), b = rate(moved(state, a, h / 2)), c = rate(moved(state, b, h / 2)),
               e = rate(moved(state, c, h));
    state.q += h / 6 * (a.q + 2 * b.q + 2 * c.q + e.q);
    state.p += h / 6 * (a.p + 2 * b.p + 2 * c.p + e.p);
    shot.energy += h / 6 * (a.energy + 2 * b.energy + 2 * c.energy + e.energy);
    shot.action += h / 6 * (a.action + 2 * b.action + 2 * c.action + e.action);
  }
  shot.end = state.q;
  return shot;
}

// The controls are those of the record, constant in each of its steps.
Shot shoot(const ControlledFlow& flow, const matching::Registration& registration, int steps) {
  if (registration.mode == matching::MatchingMode::kMetamorphosis)
    return shoot_metamorphosis(flow, registration, steps);
  const int substeps = (steps + registration.grid.steps - 1) / registration.grid.steps;
  const double h = registration.grid.dt() / substeps;
  PhaseState state{registration.source.points, registration.momenta};
  Shot shot;
  shot.action = 0.5 * registration.increments.squaredNorm() / registration.grid.dt();
  for (int k = 0; k < registration.grid.steps; ++k) {
    VectorXd controls;
    if (registration.increments.rows() > 0) controls = registration.increments.col(k) / registration.grid.dt();
    for (int i = 0; i < substeps; ++i) {
      const Rate a = flow(state, controls), b = flow(moved(state, a, h / 2), controls),
                 c = flow(moved(state, b, h / 2), controls), e = flow(moved(state, c, h), controls);
      if (k == 0 && i == 0) shot.initial_energy = a.energy;
      state.q += h / 6 * (a.q + 2 * b.q + 2 * c.q + e.q);
      state.p += h / 6 * (a.p + 2 * b.p + 2 * c.p + e.p);
      shot.energy += h / 6 * (a.energy + 2 * b.energy + 2 * c.energy + e.energy);
    }
  }
  shot.end = state.q;
  return shot;
}

double root_mean_square(const Points& differences) {
  return std::sqrt(differences.squaredNorm() / static_cast<double>(differences.cols()));
}

double cost(const Shot& shot, const matching::Registration& registration) {
  const bool along_path = mode_name(registration.mode) == "metamorphosis";
  const double energy = registration.lambda * (along_path ? shot.energy : shot.initial_energy);
  const Eigen::ArrayXXd misses = (shot.end - registration.target.points).array();
  const auto missing = registration.target.points.array().isNaN();
  return energy + shot.action +
         0.5 * missing.select(0, misses).square().sum() / (registration.sigma * registration.sigma);
}

}  // namespace

AccurateShot shoot_accurately(const matching::Registration& registration) {
  const Points& source = registration.source.points;
  const double size = diameter(source);
  const ControlledFlow flow(registration);
  Shot best = shoot(flow, registration, kFewestSteps);
  AccurateShot result;
  result.step_error = std::numeric_limits<double>::quiet_NaN();
  for (int steps = 2 * kFewestSteps; steps <= kMostSteps && source.cols() <= kManyLandmarks; steps *= 2) {
    Shot finer = shoot(flow, registration, steps);
    result.step_error = root_mean_square(finer.end - best.end) / size;
    best = std::move(finer);
    if (result.step_error < kStepTolerance) break;
  }
  result.end_error = root_mean_square(best.end - registration.result) / size;
  result.cost = cost(best, registration);
  return result;
}

double swap_closed_form(double lambda, double beta) {
  // Simpson's rule: the integrand has a bound of 1/β and changes over r ~ β√λ.
  const int intervals = 20000;
  const auto integrand = [&](double r) { return 1 / std::sqrt(-std::expm1(-r * r) / lambda + beta * beta); };
  double sum = integrand(0) + integrand(1);
  for (int i = 1; i < intervals; ++i) sum += (i % 2 == 1 ? 4 : 2) * integrand(static_cast<double>(i) / intervals);
  return std::pow(sum / (3 * intervals), 2);
}

}  // namespace pulson
