#include "discrete_path.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "pulson/core/parallel.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Block = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3, 3>;

constexpr int kMostIterations = 12;
// The last change of a root, in parts of the largest coordinate: Newton's method squares it.
constexpr double kRootAccuracy = 1e-9;
// A step turns space over where det(I − ½Δt ∂v/∂x) is 0, beyond which the midpoint rule has no single root, or where
// det(I + ½Δt ∂v/∂x) is, beyond which its flow lets landmarks change places.
constexpr double kLeastDeterminant = 0.05;

Points noise_velocity(const NoiseModel& noise, const Points& x, const VectorXd& controls) {
  return noise.gradient({x, Points::Zero(x.rows(), x.cols())}, controls).p;
}

void add_noise_gradients(const NoiseModel& noise, const Points& x, const VectorXd& controls, MatrixXd& blocks) {
  const NoiseTraits traits = noise.traits();
  if (traits.additive || !traits.local || !traits.moves_positions()) return;
  const Index d = x.rows();
  const Points none = Points::Zero(d, x.cols());
  for (Index axis = 0; axis < d; ++axis) {
    PhaseState change{none, none};
    change.q.row(axis).setOnes();
    blocks.middleRows(axis * d, d) += noise.hessian({x, none}, controls, change).p;
  }
}

// ∂v/∂x of the fields of a step at each of its landmarks, d²×N, each column a block in column-major order. Noise whose
// field at a landmark depends on others has no such blocks and is left out.
MatrixXd field_gradients(const EffectiveHamiltonian& system, const PhaseState& at) {
  MatrixXd blocks;
  system.system().kernel.apply_with_jacobian(at.q, at.q, at.p, blocks);
  add_noise_gradients(*system.system().noise, at.q, system.controls(at), blocks);
  return blocks;
}

double least_determinant(const MatrixXd& gradients, double dt, Index d) {
  double least = 1;
  for (Index a = 0; a < gradients.cols(); ++a) {
    const Block half = 0.5 * dt * gradients.col(a).reshaped(d, d), one = Block::Identity(d, d);
    least = std::min({least, (one - half).determinant(), (one + half).determinant()});
  }
  return least;
}

}  // namespace

bool searched_by_sweeps(const KernelOperator& kernel, const NoiseCometric& noise, const Points& q) {
  return sweeps_along_line(kernel, noise, q) && moves_each_along_line(noise, q);
}

std::optional<DiscretePath> along(const EffectiveHamiltonian& system, const TimeGrid& grid, std::vector<Points> nodes,
                                  const NoiseCometric* known, bool keeps_velocities) {
  const NoiseModel& noise = *system.system().noise;
  const NoiseCometric constant = known != nullptr ? *known : noise_cometric(noise, nodes.front());
  const bool varies = !noise.traits().additive;
  const auto steps = static_cast<std::size_t>(grid.steps);
  std::vector<std::optional<Cometric>> cometrics(steps);
  std::vector<char> regular(steps);
  DiscretePath path{grid, std::move(nodes), std::vector<PhaseState>(steps), {}, std::vector<MatrixXd>(steps), 0};
  path.keeps_velocities = keeps_velocities || searched_by_sweeps(system.system().kernel, constant, path.nodes.front());
  parallel_for(grid.steps, [&](int step) {
    const auto k = static_cast<std::size_t>(step);
    const Points middle = 0.5 * (path.nodes[k] + path.nodes[k + 1]);
    cometrics[k].emplace(system.system().kernel, varies ? noise_cometric(noise, middle) : constant, system.lambda(),
                         middle);
    path.middles[k] = {middle, cometrics[k]->solve((path.nodes[k + 1] - path.nodes[k]) / grid.dt())};
    if (path.keeps_velocities) {
      path.gradients[k] = MatrixXd::Zero(1, middle.cols());
      regular[k] = cometrics[k]->is_regular();
      return;
    }
    path.gradients[k] = field_gradients(system, path.middles[k]);
    regular[k] = cometrics[k]->is_regular() &&
                 least_determinant(path.gradients[k], grid.dt(), middle.rows()) > kLeastDeterminant;
  });
  for (std::size_t k = 0; k < steps; ++k) {
    if (!regular[k]) return std::nullopt;
    path.energy += 0.5 * path.middles[k].p.cwiseProduct(path.nodes[k + 1] - path.nodes[k]).sum();
    path.cometrics.push_back(std::move(*cometrics[k]));
  }
  return path;
}

// By the polynomial through the four nodes nearest, or as many as there are.
std::vector<Points> resampled(const std::vector<Points>& nodes, int steps) {
  const int last = static_cast<int>(nodes.size()) - 1;
  const int degree = std::min(3, last);
  std::vector<Points> samples;
  for (int k = 0; k <= steps; ++k) {
    const double time = static_cast<double>(k) * last / steps;
    const int first = std::clamp(static_cast<int>(time) - 1, 0, last - degree);
    Points sample = Points::Zero(nodes.front().rows(), nodes.front().cols());
    for (int i = 0; i <= degree; ++i) {
      double part = 1;
      for (int j = 0; j <= degree; ++j)
        if (j != i) part *= (time - first - j) / (i - j);
      if (part != 0) sample += part * nodes[static_cast<std::size_t>(first + i)];
    }
    samples.push_back(std::move(sample));
  }
  return samples;
}

Points own_velocities(const EffectiveHamiltonian& system, const PhaseState& at) {
  const StochasticSystem& parts = system.system();
  Points v = regularisation(parts.kernel) * at.p;
  if (!parts.noise->traits().local) v += noise_velocity(*parts.noise, at.q, system.controls(at));
  return v;
}

StepFields fields_of(const EffectiveHamiltonian& system, const DiscretePath& path) {
  StepFields fields;
  for (const PhaseState& middle : path.middles) {
    fields.centres.push_back(middle.q);
    fields.momenta.push_back(middle.p);
    fields.controls.push_back(system.controls(middle));
    fields.own.push_back(own_velocities(system, middle));
  }
  return fields;
}

// By Newton's method, landmark by landmark: the fields are fixed in space.
std::optional<Points> carried_by_step(const StochasticSystem& system, const TimeGrid& grid, const StepFields& fields,
                                      std::size_t k, const Points& start, const Points& guess) {
  const Index d = start.rows();
  const double dt = grid.dt();
  Points next = start + guess;
  const bool noisy = fields.controls[k].size() > 0 && system.noise->traits().local;
  const double accuracy = kRootAccuracy * std::max(start.cwiseAbs().maxCoeff(), next.cwiseAbs().maxCoeff());
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    const Points middle = 0.5 * (start + next);
    MatrixXd gradients;
    Points v = system.kernel.apply_with_jacobian(middle, fields.centres[k], fields.momenta[k], gradients);
    if (!fields.own.empty()) v += fields.own[k];
    if (noisy) {
      v += noise_velocity(*system.noise, middle, fields.controls[k]);
      add_noise_gradients(*system.noise, middle, fields.controls[k], gradients);
    }
    double furthest = 0;
    for (Index a = 0; a < start.cols(); ++a) {
      const Block slope = Block::Identity(d, d) - 0.5 * dt * gradients.col(a).reshaped(d, d);
      const VectorXd change = slope.inverse() * (start.col(a) + dt * v.col(a) - next.col(a));
      if (!change.allFinite()) return std::nullopt;
      next.col(a) += change;
      furthest = std::max(furthest, change.cwiseAbs().maxCoeff());
    }
    if (furthest <= accuracy) return next;
  }
  return std::nullopt;
}

std::optional<std::vector<Points>> carried(const StochasticSystem& system, const TimeGrid& grid, const Points& source,
                                           const StepFields& fields, const std::vector<Points>& guess) {
  std::vector<Points> nodes{source};
  for (std::size_t k = 0; k < static_cast<std::size_t>(grid.steps); ++k) {
    std::optional<Points> next = carried_by_step(system, grid, fields, k, nodes.back(), guess[k + 1] - guess[k]);
    if (!next) return std::nullopt;
    nodes.push_back(std::move(*next));
  }
  return nodes;
}

}  // namespace pulson::matching
