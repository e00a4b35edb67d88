#include "convergence.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include <fmt/core.h>

#include "pulson/core/parallel.hpp"
#include "pulson/random/brownian.hpp"

namespace pulson::convergence {
namespace {

using Eigen::ArrayXd;
using Eigen::ArrayXXd;
using Eigen::MatrixXd;

constexpr int kMostBlocks = 64;
constexpr int kChecked = 32;      // blocks whose first path checks the reference
constexpr double kVisible = 3;    // standard errors that a weak error must differ from 0 by
constexpr int kFewestPoints = 3;  // of a slope

void check(const Plan& plan) {
  for (const int steps : plan.steps)
    if (steps < 1 || plan.reference_steps % steps != 0 || plan.reference_steps % 2 != 0)
      throw InputError(
          fmt::format("the reference has {} steps; it needs a multiple of 2 and of {}", plan.reference_steps, steps));
}

// What a step of the limit adds up, with factor·G beside H.
PhaseState rate(const StochasticSystem& system, const PhaseState& z, double dt, const Eigen::VectorXd& w,
                double factor) {
  const Points velocity = hamiltonian_p(system.kernel, z.q, z.p);
  const PhaseState h = system.noise->gradient(z, w);
  PhaseState f{dt * velocity + h.p, -dt * hamiltonian_q(system.kernel, z.q, z.p) - h.q};
  f.p -= dt * system.noise->friction() * velocity;
  if (factor != 0) {
    const PhaseState g = system.noise->compensation_gradient(z);
    f.q += dt * factor * g.p;
    f.p -= dt * factor * g.q;
  }
  return f;
}

// Heun's scheme, written apart from the integrators that it is to judge.
PhaseState heun_end(const StochasticSystem& system, PhaseState z, const TimeGrid& grid, const MatrixXd& increments,
                    Limit limit) {
  const double factor = limit == Limit::kPaper ? -1 : 0;
  for (int k = 0; k < grid.steps; ++k) {
    const PhaseState first = rate(system, z, grid.dt(), increments.col(k), factor);
    const PhaseState second = rate(system, {z.q + first.q, z.p + first.p}, grid.dt(), increments.col(k), factor);
    z.q += 0.5 * (first.q + second.q);
    z.p += 0.5 * (first.p + second.p);
  }
  return z;
}

// z with the half of the last increment that (20) leaves to a next step.
PhaseState completed(const StochasticSystem& system, const PhaseState& z, const Eigen::VectorXd& last_increment) {
  const PhaseState h = system.noise->gradient(z, 0.5 * last_increment);
  return {z.q + h.p, z.p - h.q};
}

double distance(const PhaseState& a, const PhaseState& b) { return std::hypot((a.q - b.q).norm(), (a.p - b.p).norm()); }

bool is_finite(const PhaseState& z) { return z.q.allFinite() && z.p.allFinite(); }

using Weak = Eigen::Array<double, kQuantities - kMeanQ, 1>;

// q₂, q₂², p₁, p₁².
Weak functionals(const PhaseState& z) {
  const double q = z.q(0, 1);
  const double p = z.p(0, 0);
  return {q, q * q, p, p * p};
}

// The end of a path by an integrator.
struct End {
  PhaseState state;
  PhaseState completed;
  Weak control = Weak::Zero();  // of mean 0, close to what the lag of (20) adds to the functionals
};

// The last increment is independent of the state before it.
Weak lag_control(const StochasticSystem& system, const PhaseState& before, const Eigen::VectorXd& last_increment) {
  const PhaseState h = system.noise->gradient(before, 0.5 * last_increment);
  const double q = -h.p(0, 1);
  const double p = h.q(0, 0);
  return {q, 2 * before.q(0, 1) * q, p, 2 * before.p(0, 0) * p};
}

Eigen::Array<double, kQuantities, 1> quantities(const End& end, const PhaseState& limit) {
  Eigen::Array<double, kQuantities, 1> all;
  all << (end.state.q - limit.q).norm(), distance(end.state, limit), distance(end.completed, limit),
      functionals(end.state) - functionals(limit) - end.control;
  return all;
}

// Sums over paths: quantities × step sizes.
struct Sums {
  ArrayXXd total;
  double paths = 0;

  Sums& operator+=(const Sums& other) {
    total += other.total;
    paths += other.paths;
    return *this;
  }
  Sums operator-(const Sums& other) const { return {total - other.total, paths - other.paths}; }
  double mean(Eigen::Index quantity, Eigen::Index size) const { return total(quantity, size) / paths; }
};

// What the paths of one block gave.
struct Block {
  std::vector<Sums> rows;
  std::vector<std::vector<int>> failed;  // by integrator and step size
  Sums limits_apart{ArrayXXd::Zero(kQuantities, 1)};
  Sums references_apart{ArrayXXd::Zero(1, 1)};
  int reference_failed = 0;
};

struct RowKey {
  std::size_t integrator;
  Limit limit;
};

class Experiment {
 public:
  Experiment(const Case& setting, const Plan& plan) : setting_(setting), plan_(plan) {
    for (const auto& row : integrator_table().rows()) {
      const bool asked = plan.integrators.empty() || std::ranges::count(plan.integrators, row.name) > 0;
      std::unique_ptr<const Integrator> made = row.make();
      if (asked && made->traits().noise) integrators_.push_back(std::move(made));
    }
    for (std::size_t i = 0; i < integrators_.size(); ++i) {
      keys_.push_back({i, Limit::kStratonovich});
      if (two_limits() && integrators_[i]->name() == "variational-paper") keys_.push_back({i, Limit::kPaper});
    }
  }

  const std::vector<RowKey>& keys() const { return keys_; }
  std::string integrator(const RowKey& key) const { return integrators_[key.integrator]->name(); }
  std::size_t sizes() const { return plan_.steps.size(); }

  Block run(int first_path, int last_path, bool check_reference) const {
    Block block;
    block.rows.assign(keys_.size(), Sums{ArrayXXd::Zero(kQuantities, static_cast<Eigen::Index>(sizes()))});
    block.failed.assign(integrators_.size(), std::vector<int>(sizes()));
    for (int path = first_path; path < last_path; ++path) add_path(path, check_reference && path == first_path, block);
    return block;
  }

 private:
  bool two_limits() const { return setting_.system.noise->traits().compensated; }

  void add_path(int path, bool check_reference, Block& block) const {
    const auto d = static_cast<int>(setting_.start.q.rows());
    const auto n = static_cast<int>(setting_.start.q.cols());
    const TimeGrid finest{plan_.time, plan_.reference_steps};
    const MatrixXd dw = brownian_increments(plan_.seed, static_cast<std::uint64_t>(path),
                                            setting_.system.noise->channels(d, n), finest);
    const PhaseState exact = heun_end(setting_.system, setting_.start, finest, dw, Limit::kStratonovich);
    const PhaseState paper =
        two_limits() ? heun_end(setting_.system, setting_.start, finest, dw, Limit::kPaper) : exact;
    if (!is_finite(exact) || !is_finite(paper)) {
      ++block.reference_failed;
      return;
    }
    block.limits_apart += {quantities({paper, paper}, exact), 1};
    if (check_reference) add_reference_check(dw, exact, block);

    for (std::size_t i = 0; i < integrators_.size(); ++i) {
      const std::vector<End> ends = integrate(i, dw, block.failed[i]);
      if (ends.size() < sizes()) continue;
      for (std::size_t r = 0; r < keys_.size(); ++r)
        if (keys_[r].integrator == i) add(ends, keys_[r].limit == Limit::kPaper ? paper : exact, block.rows[r]);
    }
  }

  std::optional<End> integrate_on(const Integrator& integrator, const MatrixXd& dw, int steps) const {
    const MatrixXd increments = coarsened(dw, plan_.reference_steps / steps);
    const StochasticSystem& system = setting_.system;
    try {
      const Trajectory path = integrator.integrate(system, setting_.start, TimeGrid{plan_.time, steps}, increments);
      End end{path.final(), path.final()};
      if (lags(integrator.name())) {
        end.completed = completed(system, path.final(), increments.col(steps - 1));
        end.control = lag_control(system, path.states[static_cast<std::size_t>(steps) - 1], increments.col(steps - 1));
      }
      return end;
    } catch (const StepError&) {
      return std::nullopt;
    }
  }

  // The ends for all step sizes that could be had.
  std::vector<End> integrate(std::size_t integrator, const MatrixXd& dw, std::vector<int>& failed) const {
    std::vector<End> ends;
    for (std::size_t s = 0; s < sizes(); ++s) {
      std::optional<End> end = integrate_on(*integrators_[integrator], dw, plan_.steps[s]);
      if (end)
        ends.push_back(*std::move(end));
      else
        ++failed[s];
    }
    return ends;
  }

  static void add(const std::vector<End>& ends, const PhaseState& limit, Sums& sums) {
    for (std::size_t s = 0; s < ends.size(); ++s)
      sums.total.col(static_cast<Eigen::Index>(s)) += quantities(ends[s], limit);
    ++sums.paths;
  }

  void add_reference_check(const MatrixXd& dw, const PhaseState& exact, Block& block) const {
    const std::optional<End> other = integrate_on(*make_integrator("midpoint"), dw, plan_.reference_steps / 2);
    if (other) block.references_apart += {ArrayXXd::Constant(1, 1, distance(exact, other->state)), 1};
  }

  const Case& setting_;
  const Plan& plan_;
  std::vector<std::unique_ptr<const Integrator>> integrators_;
  std::vector<RowKey> keys_;
};

// A statistic of sums over all blocks, with its standard error from leaving out one block after the other.
template <class Statistic>
Estimate jackknife(const std::vector<Sums>& blocks, const Statistic& statistic) {
  Sums all = blocks.front();
  for (std::size_t b = 1; b < blocks.size(); ++b) all += blocks[b];
  ArrayXd without(static_cast<Eigen::Index>(blocks.size()));
  for (Eigen::Index b = 0; b < without.size(); ++b) without[b] = statistic(all - blocks[static_cast<std::size_t>(b)]);
  const auto count = static_cast<double>(blocks.size());
  return {statistic(all), std::sqrt((count - 1) / count * (without - without.mean()).square().sum())};
}

Estimate mean_of(const std::vector<Sums>& blocks, Eigen::Index quantity, Eigen::Index size) {
  return jackknife(blocks, [&](const Sums& sums) { return sums.mean(quantity, size); });
}

// The line through (log Δt, log |mean|): all points alike for strong errors, whose relative standard errors are alike;
// for weak ones as many as stand out of their standard errors, weighted by these.
Order order_of(const std::vector<Sums>& blocks, Quantity quantity, const std::vector<Estimate>& means,
               const Plan& plan) {
  Eigen::Index points = 0;
  while (points < static_cast<Eigen::Index>(means.size())) {
    const Estimate& mean = means[static_cast<std::size_t>(points)];
    if (is_weak(quantity) && !(std::abs(mean.value) > kVisible * mean.error)) break;
    ++points;
  }
  if (points < kFewestPoints) return {};
  ArrayXd x(points);
  ArrayXd weight(points);
  for (Eigen::Index i = 0; i < points; ++i) {
    const auto s = static_cast<std::size_t>(i);
    x[i] = std::log(plan.time / plan.steps[s]);
    weight[i] = is_weak(quantity) ? std::pow(means[s].value / means[s].error, 2) : 1;
  }
  x -= (weight * x).sum() / weight.sum();
  const ArrayXd row = weight * x / (weight * x.square()).sum();
  const auto slope = [&](const Sums& sums) {
    return (row * (sums.total.row(quantity).head(points).transpose() / sums.paths).abs().log()).sum();
  };
  return {jackknife(blocks, slope), static_cast<int>(points)};
}

// The blocks that have paths in `part`, which takes a block's sums out of it.
template <class Part>
std::vector<Sums> gathered(const std::vector<Block>& blocks, const Part& part) {
  std::vector<Sums> sums;
  for (const Block& block : blocks)
    if (part(block).paths > 0) sums.push_back(part(block));
  return sums;
}

Row make_row(const Experiment& experiment, std::size_t r, const std::vector<Block>& blocks, const Plan& plan) {
  const RowKey& key = experiment.keys()[r];
  Row row{.integrator = experiment.integrator(key),
          .limit = key.limit,
          .means = {},
          .orders = {},
          .failed = std::vector<int>(experiment.sizes())};
  for (const Block& block : blocks) {
    row.paths += static_cast<int>(block.rows[r].paths);
    for (std::size_t s = 0; s < row.failed.size(); ++s) row.failed[s] += block.failed[key.integrator][s];
  }
  const std::vector<Sums> sums = gathered(blocks, [&](const Block& block) -> const Sums& { return block.rows[r]; });
  if (sums.size() < 2) return row;
  for (int i = 0; i < kQuantities; ++i) {
    const auto quantity = static_cast<Quantity>(i);
    std::vector<Estimate>& means = row.means[static_cast<std::size_t>(i)];
    for (std::size_t s = 0; s < experiment.sizes(); ++s)
      means.push_back(mean_of(sums, i, static_cast<Eigen::Index>(s)));
    row.orders[static_cast<std::size_t>(i)] = order_of(sums, quantity, means, plan);
  }
  return row;
}

}  // namespace

Measurement measure(const Case& setting, const Plan& plan) {
  check(plan);
  const Experiment experiment(setting, plan);
  std::vector<Block> blocks(static_cast<std::size_t>(std::min(plan.paths, kMostBlocks)));
  const auto count = static_cast<long>(blocks.size());
  const auto first_path = [&](long block) { return static_cast<int>(block * plan.paths / count); };
  parallel_for(static_cast<int>(count), [&](int b) {
    blocks[static_cast<std::size_t>(b)] = experiment.run(first_path(b), first_path(b + 1), b < kChecked);
  });

  Measurement result;
  for (std::size_t r = 0; r < experiment.keys().size(); ++r)
    result.rows.push_back(make_row(experiment, r, blocks, plan));
  for (const Block& block : blocks) result.reference_failed += block.reference_failed;
  const std::vector<Sums> limits =
      gathered(blocks, [](const Block& block) -> const Sums& { return block.limits_apart; });
  const std::vector<Sums> references =
      gathered(blocks, [](const Block& block) -> const Sums& { return block.references_apart; });
  for (std::size_t i = 0; i < kQuantities && !limits.empty(); ++i)
    result.limits_apart[i] = mean_of(limits, static_cast<Eigen::Index>(i), 0);
  if (!references.empty()) result.references_apart = mean_of(references, 0, 0);
  return result;
}

}  // namespace pulson::convergence
