#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "integrators/schemes.hpp"
#include "kernels/line_sums.hpp"
#include "landmark_lanes.hpp"
#include "own_kernels.hpp"
#include "path_sampler.hpp"
#include "step_lanes.hpp"

namespace pulson::ensemble {

namespace {

double power_of_two_near(double x) { return std::ldexp(1.0, std::ilogb(x)); }

}  // namespace

void add_loads(const Points& gradient, std::size_t channel, std::vector<NoiseLoad>& loads) {
  for (Eigen::Index i = 0; i < gradient.size(); ++i)
    if (gradient.reshaped()[i] != 0) loads.push_back({channel, static_cast<std::size_t>(i), gradient.reshaped()[i]});
}

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

LandmarkBatch landmark_batch(std::size_t channels, std::uint64_t first_path, const PhaseState& start) {
  const std::size_t size = static_cast<std::size_t>(start.q.size()) * kPathBatch;
  const auto count = static_cast<std::size_t>(start.q.cols());
  LandmarkBatch batch{};
  batch.first_path = first_path;
  batch.q.resize(size);
  batch.p.resize(size);
  batch.moved.resize(size);
  batch.before.resize(channels * kPathBatch);
  for (std::size_t i = 0; i < size; ++i) {
    const auto coordinate = static_cast<Eigen::Index>(i / kPathBatch);
    batch.q[i] = start.q.reshaped()[coordinate];
    batch.p[i] = start.p.reshaped()[coordinate];
  }
  batch.largest_momentum.fill(start.p.colwise().norm().maxCoeff());
  double side = std::numeric_limits<double>::infinity();
  if (start.q.rows() == 1) {
    const auto q = [&](std::size_t a) { return start.q(static_cast<Eigen::Index>(a)); };
    batch.order.resize(count);
    std::iota(batch.order.begin(), batch.order.end(), 0U);
    std::stable_sort(batch.order.begin(), batch.order.end(), [&](std::size_t a, std::size_t b) { return q(a) < q(b); });
    for (std::size_t i = 1; i < count; ++i) side = std::min(side, q(batch.order[i]) - q(batch.order[i - 1]));
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

namespace {

// Beyond it the lanes' memory for each pair, 64 bytes and more, outgrows the caches, and shapes are their own vectors.
constexpr Eigen::Index kMostLandmarks = 1000;

// From so many on, sweeps along a line cost one path less than sums over pairs cost a lane: with additive noise peakon
// and matern32 by heun and variational cross between 200 and 400 landmarks (docs/benchmarks.md).
constexpr Eigen::Index kFewestInSweeps = 300;

// Whether all that a step needs is O(N) for one path at a time.
bool are_swept(const StochasticSystem& system, const PhaseState& start) {
  return start.q.rows() == 1 && start.q.cols() >= kFewestInSweeps && system.noise->traits().additive &&
         has_line_sums(system.kernel.terms());
}

void advance(const LandmarkModel& model, LandmarkBatch& batch, std::uint32_t first, std::uint32_t last) {
  advance_landmarks(model, batch, first, last);
}
void advance(const StepModel& model, LandmarkBatch& batch, std::uint32_t first, std::uint32_t last) {
  advance_steps(model, batch, first, last);
}

// @tparam Model LandmarkModel or StepModel
template <class Model>
class LandmarkSampler final : public PathSampler {
 public:
  LandmarkSampler(Model model, PhaseState start, PathPlan plan)
      : model_(std::move(model)), start_(std::move(start)), plan_(std::move(plan)) {
    model_.antithetic = plan_.antithetic;
  }

  std::string name() const override { return "landmark lanes"; }

  LaneEnds sample(std::uint64_t first_path, std::size_t lanes, const Sink& sink) const override {
    LandmarkBatch of_lanes = landmark_batch(model_.channels, first_path, start_);
    std::fill(of_lanes.status.begin() + static_cast<std::ptrdiff_t>(lanes), of_lanes.status.end(),
              LaneStatus::kBeyondBound);
    return sample_lanes(
        std::move(of_lanes), plan_, 2 * start_.q.size(), sink,
        [&](LandmarkBatch& batch, std::uint32_t first, std::uint32_t last) { advance(model_, batch, first, last); },
        [&](const LandmarkBatch& batch, LaneStates& states) { copy_states(batch, states); });
  }

 private:
  void copy_states(const LandmarkBatch& batch, LaneStates& states) const {
    const Eigen::Index half = start_.q.size();
    const auto rows = static_cast<Eigen::Index>(kPathBatch);
    states.values.leftCols(half) = Eigen::Map<const Eigen::ArrayXXd>(batch.q.data(), rows, half);
    states.values.rightCols(half) = Eigen::Map<const Eigen::ArrayXXd>(batch.p.data(), rows, half);
    states.smallest_gap.fill(std::numeric_limits<double>::infinity());
    for (std::size_t i = 1; i < batch.order.size(); ++i)
      for (std::size_t lane = 0; lane < kPathBatch; ++lane)
        states.smallest_gap[lane] =
            std::min(states.smallest_gap[lane],
                     batch.q[batch.order[i] * kPathBatch + lane] - batch.q[batch.order[i - 1] * kPathBatch + lane]);
  }

  Model model_;
  PhaseState start_;
  PathPlan plan_;
};

}  // namespace

std::unique_ptr<const PathSampler> make_landmark_sampler(const StochasticSystem& system, const std::string& integrator,
                                                         const PhaseState& start, const PathPlan& plan) {
  if (start.q.cols() > kMostLandmarks || has_own(system.kernel.terms()) || are_swept(system, start)) return nullptr;
  const auto dimension = static_cast<int>(start.q.rows()), count = static_cast<int>(start.q.cols());
  const NoiseTraits traits = system.noise->traits();
  const bool is_variational = integrator == "variational" || integrator == "variational-paper";
  if (is_variational && traits.additive && traits.hamiltonian)
    return std::make_unique<LandmarkSampler<LandmarkModel>>(
        LandmarkModel(system, dimension, count, plan.grid.dt(), plan.seed), start, plan);
  if (!StepModel::knows(system, integrator, dimension)) return nullptr;
  return std::make_unique<LandmarkSampler<StepModel>>(
      StepModel(system, integrator, dimension, count, plan.grid.dt(), plan.seed), start, plan);
}

}  // namespace pulson::ensemble
