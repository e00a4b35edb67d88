#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "integrators/variational.hpp"
#include "landmark_lanes.hpp"

namespace pulson {
namespace {

double power_of_two_near(double x) { return std::ldexp(1.0, std::ilogb(x)); }

void add_loads(const Points& gradient, std::size_t channel, std::vector<NoiseLoad>& loads) {
  for (Eigen::Index i = 0; i < gradient.size(); ++i)
    if (gradient.reshaped()[i] != 0) loads.push_back({channel, static_cast<std::size_t>(i), gradient.reshaped()[i]});
}

}  // namespace

LandmarkModel::LandmarkModel(StochasticSystem its_system, int its_dimension, int its_count, double its_dt,
                             std::uint64_t its_seed)
    : system(std::move(its_system)),
      dimension(static_cast<std::size_t>(its_dimension)),
      count(static_cast<std::size_t>(its_count)),
      dt(its_dt),
      seed(its_seed),
      terms(system.kernel.terms()) {
  const NoiseModel& noise = *system.noise;
  noise.check(its_dimension, its_count);
  if (!noise.traits().additive || !noise.traits().hamiltonian)
    throw InputError("noise '" + noise.spec() + "' is not additive");
  channels = static_cast<std::size_t>(noise.channels(its_dimension, its_count));
  const Points zero = Points::Zero(its_dimension, its_count);
  for (std::size_t i = 0; i < channels; ++i) {
    const auto all = static_cast<Eigen::Index>(channels);
    const PhaseState gradient = noise.gradient({zero, zero}, Eigen::VectorXd::Unit(all, static_cast<Eigen::Index>(i)));
    add_loads(gradient.p, i, position);
    add_loads(gradient.q, i, momentum);
  }

  double width = terms.front().alpha;
  for (const KernelTerm& term : terms) width = std::min(width, term.alpha);
  length_unit = power_of_two_near(width);
  momentum_unit = 1 / power_of_two_near(dt * system.kernel.at_zero() / length_unit);
  for (KernelTerm& term : terms) {
    term.alpha /= length_unit;
    term.weight *= dt * (momentum_unit / length_unit);
  }
  const KernelOperator in_units(terms);
  at_zero = in_units.at_zero();
  lipschitz = in_units.lipschitz();
}

LandmarkBatch landmark_batch(const LandmarkModel& model, std::uint64_t first_path, const PhaseState& start) {
  const std::size_t size = model.dimension * model.count * kPathBatch;
  LandmarkBatch batch{};
  batch.first_path = first_path;
  batch.q.resize(size);
  batch.p.resize(size);
  batch.moved.resize(size);
  batch.before.resize(model.channels * kPathBatch);
  for (std::size_t i = 0; i < size; ++i) {
    const auto coordinate = static_cast<Eigen::Index>(i / kPathBatch);
    batch.q[i] = start.q.reshaped()[coordinate];
    batch.p[i] = start.p.reshaped()[coordinate];
  }
  batch.largest_momentum.fill(start.p.colwise().norm().maxCoeff());
  double side = std::numeric_limits<double>::infinity();
  if (model.dimension == 1) {
    const auto q = [&](std::size_t a) { return start.q(static_cast<Eigen::Index>(a)); };
    batch.order.resize(model.count);
    std::iota(batch.order.begin(), batch.order.end(), 0U);
    std::stable_sort(batch.order.begin(), batch.order.end(), [&](std::size_t a, std::size_t b) { return q(a) < q(b); });
    for (std::size_t i = 1; i < model.count; ++i) side = std::min(side, q(batch.order[i]) - q(batch.order[i - 1]));
  }
  batch.smallest_side.fill(side);
  return batch;
}

bool solve_landmarks(const LandmarkModel& model, const LaneStep& lane) {
  const auto dimension = static_cast<Eigen::Index>(model.dimension);
  const auto count = static_cast<Eigen::Index>(model.count);
  PhaseState start{Points(dimension, count), Points(dimension, count)};
  for (Eigen::Index i = 0; i < start.q.size(); ++i) {
    const std::size_t at = static_cast<std::size_t>(i) * lane.stride;
    start.q.reshaped()[i] = lane.c[at] * model.length_unit;
    start.p.reshaped()[i] = lane.m[at] * model.momentum_unit;
  }
  if (!start.q.allFinite() || !start.p.allFinite()) return false;
  // The noise is in the state already: here its increments are zero.
  const Eigen::MatrixXd still = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(model.channels), 1);
  try {
    const Trajectory path = VariationalIntegrator(false).integrate(model.system, start, {model.dt, 1}, still);
    for (Eigen::Index i = 0; i < start.q.size(); ++i) {
      const std::size_t at = static_cast<std::size_t>(i) * lane.stride;
      lane.q[at] = path.final().q.reshaped()[i] / model.length_unit;
      lane.p[at] = path.final().p.reshaped()[i] / model.momentum_unit;
    }
    return true;
  } catch (const StepError&) {
    return false;
  }
}

}  // namespace pulson
