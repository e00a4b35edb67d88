#include <algorithm>
#include <limits>
#include <mutex>
#include <numeric>
#include <utility>

#include <fmt/core.h>

#include "core/text.hpp"
#include "core/undefined.hpp"
#include "path_sampler.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/ensemble/ensemble.hpp"
#include "pulson/random/brownian.hpp"

namespace pulson::ensemble {

namespace {

// The path as far as it goes: its first `steps` steps, which have been taken before.
Trajectory beginning(const StochasticSystem& system, const Integrator& integrator, const PhaseState& start,
                     const TimeGrid& grid, const Eigen::MatrixXd& increments, int steps) {
  for (; steps > 0; --steps) {
    try {
      return integrator.integrate(system, start, {steps * grid.dt(), steps}, increments.leftCols(steps));
    } catch (const StepError&) {  // the last bit of Δt decided
    }
  }
  Trajectory path;
  path.integrator = integrator.name();
  path.grid = {0, 0};
  path.increments = increments.leftCols(0);
  path.states.push_back(start);
  return path;
}

// A path whose numbers left their range, without those.
void cut_to_finite(SamplePath& sample) {
  std::vector<PhaseState>& states = sample.path.states;
  const auto is_finite = [](const PhaseState& state) { return state.q.allFinite() && state.p.allFinite(); };
  const auto lost = std::find_if_not(states.begin(), states.end(), is_finite);
  if (lost == states.end() || lost == states.begin()) return;
  const auto steps = static_cast<int>(lost - states.begin()) - 1;
  sample.status = PathStatus::kMomentumBound;
  sample.reason = fmt::format("the numbers left their range after t = {:.4g}", sample.path.grid.at(steps));
  sample.path.grid = {sample.path.grid.at(steps), steps};
  sample.path.increments = Eigen::MatrixXd(sample.path.increments.leftCols(steps));
  states.erase(lost, states.end());
}

void measure(SamplePath& sample, double bound) {
  cut_to_finite(sample);
  const PhaseState& start = sample.path.initial();
  const Eigen::VectorXd total = start.p.rowwise().sum();
  const double size = start.p.colwise().norm().sum();
  for (std::size_t k = 0; k < sample.path.states.size(); ++k) {
    const Points& p = sample.path.states[k].p;
    const double largest = p.colwise().norm().maxCoeff();
    sample.largest_momentum = std::max(sample.largest_momentum, largest);
    sample.momentum_error = std::max(sample.momentum_error, (p.rowwise().sum() - total).norm() / (size > 0 ? size : 1));
    if (!(largest <= bound) && sample.status != PathStatus::kMomentumBound) {
      sample.status = PathStatus::kMomentumBound;
      sample.reason =
          fmt::format("a momentum passed {:.3g} at t = {:.4g}", bound, sample.path.grid.at(static_cast<int>(k)));
    }
  }
}

}  // namespace

std::string path_status_name(PathStatus status) {
  if (status == PathStatus::kClean) return "clean";
  return status == PathStatus::kNoRoot ? "no_root" : "momentum_bound";
}

SamplePath sample_path(const StochasticSystem& system, const Integrator& integrator, const PhaseState& start,
                       const TimeGrid& grid, const Eigen::MatrixXd& increments, double momentum_bound) {
  SamplePath sample;
  try {
    sample.path = integrator.integrate(system, start, grid, increments);
  } catch (const StepError& error) {
    sample.status = PathStatus::kNoRoot;
    sample.reason = error.what();
    sample.path = beginning(system, integrator, start, grid, increments, error.step());
  }
  measure(sample, momentum_bound);
  return sample;
}

std::vector<SamplePath> sample_paths(const StochasticSystem& system, const Integrator& integrator,
                                     const PhaseState& start, const SamplePathsOptions& options) {
  const auto d = static_cast<int>(start.q.rows());
  const auto n = static_cast<int>(start.q.cols());
  require_size("the momenta at the start", start.p, d, n);
  system.noise->check(d, n);
  const int channels = system.noise->channels(d, n);
  std::vector<SamplePath> samples(static_cast<std::size_t>(options.samples));
  parallel_for(options.samples, [&](int m) {
    SamplePath& sample = samples[static_cast<std::size_t>(m)];
    sample = sample_path(system, integrator, start, options.grid,
                         brownian_increments(options.seed, static_cast<std::uint64_t>(m), channels, options.grid),
                         options.momentum_bound);
    sample.contraction_bound = contraction_bound(system.kernel, sample.path);
  });
  return samples;
}

namespace {

/// Landmarks of a line in their order at the start.
std::vector<Eigen::Index> order_of(const Points& q) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(q.cols()));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return q(a) < q(b); });
  return order;
}

double smallest_gap(const Points& q, const std::vector<Eigen::Index>& order) {
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < order.size(); ++i) smallest = std::min(smallest, q(order[i]) - q(order[i - 1]));
  return smallest;
}

class ScalarSampler final : public PathSampler {
 public:
  ScalarSampler(const StochasticSystem& system, const std::string& integrator, const PhaseState& start, PathPlan plan)
      : system_(system),
        integrator_(make_integrator(integrator)),
        start_(start),
        plan_(std::move(plan)),
        channels_(system.noise->channels(static_cast<int>(start.q.rows()), static_cast<int>(start.q.cols()))) {
    if (start.q.rows() == 1) order_ = order_of(start.q);
  }

  std::string name() const override { return "one path at a time"; }

  LaneEnds sample(std::uint64_t first_path, std::size_t lanes, const Sink& sink) const override {
    std::vector<LaneStates> records(plan_.records.size());
    for (LaneStates& record : records) {
      record.values.setZero(kPathBatch, 2 * start_.q.size());
      record.running.fill(false);
    }
    LaneEnds ends{};
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const std::uint64_t number = first_path + lane;
      Eigen::MatrixXd increments =
          brownian_increments(plan_.seed, plan_.antithetic ? number / 2 : number, channels_, plan_.grid);
      if (plan_.antithetic && number % 2 == 1) increments = -increments;
      take(sample_path(system_, *integrator_, start_, plan_.grid, increments), lane, records, ends);
    }
    for (std::size_t record = 0; record < records.size(); ++record) sink(record, records[record]);
    return ends;
  }

 private:
  // The path, as one lane of the records.
  void take(const SamplePath& sample, std::size_t lane, std::vector<LaneStates>& records, LaneEnds& ends) const {
    const auto last = static_cast<int>(sample.path.states.size()) - 1;
    const auto row = static_cast<Eigen::Index>(lane);
    double largest = 0;
    double gap = std::numeric_limits<double>::infinity();
    std::size_t record = 0;
    for (int step = 0; step <= last; ++step) {
      const PhaseState& state = sample.path.states[static_cast<std::size_t>(step)];
      largest = max_or_undefined(largest, state.p.colwise().norm().maxCoeff());
      const double now = order_.empty() ? std::numeric_limits<double>::infinity() : smallest_gap(state.q, order_);
      gap = std::min(gap, now);
      if (record == records.size() || plan_.records[record] != step) continue;
      records[record].values.row(row) << state.q.reshaped().transpose().array(), state.p.reshaped().transpose().array();
      records[record].smallest_gap[lane] = now;
      records[record].largest_momentum[lane] = largest;
      records[record].running[lane] = true;
      ++record;
    }
    ends.reached_end[lane] = last == plan_.grid.steps;
    ends.largest_momentum[lane] = largest;
    ends.smallest_gap[lane] = gap;
  }

  StochasticSystem system_;
  std::unique_ptr<const Integrator> integrator_;
  PhaseState start_;
  PathPlan plan_;
  int channels_;
  std::vector<Eigen::Index> order_;  // d = 1
};

// A sampler that samples the first block once: for the ranges of histograms, and then, unchanged, for the sums.
class FirstBlockKeeper final : public PathSampler {
 public:
  explicit FirstBlockKeeper(std::unique_ptr<const PathSampler> sampler) : sampler_(std::move(sampler)) {}

  std::string name() const override { return sampler_->name(); }

  LaneEnds sample(std::uint64_t first_path, std::size_t lanes, const Sink& sink) const override {
    if (first_path != 0) return sampler_->sample(first_path, lanes, sink);
    const std::scoped_lock lock(mutex_);
    if (records_.empty())
      ends_ = sampler_->sample(0, lanes, [&](std::size_t, const LaneStates& states) { records_.push_back(states); });
    for (std::size_t record = 0; record < records_.size(); ++record) sink(record, records_[record]);
    return ends_;
  }

 private:
  std::unique_ptr<const PathSampler> sampler_;
  mutable std::mutex mutex_;
  mutable std::vector<LaneStates> records_;
  mutable LaneEnds ends_{};
};

}  // namespace

std::unique_ptr<const PathSampler> make_scalar_sampler(const StochasticSystem& system, const std::string& integrator,
                                                       const PhaseState& start, const PathPlan& plan) {
  return std::make_unique<ScalarSampler>(system, integrator, start, plan);
}

std::unique_ptr<const PathSampler> keep_first_block(std::unique_ptr<const PathSampler> sampler) {
  return std::make_unique<FirstBlockKeeper>(std::move(sampler));
}

std::unique_ptr<const PathSampler> make_path_sampler(const StochasticSystem& system, const std::string& integrator,
                                                     const PhaseState& start, const PathPlan& plan) {
  system.noise->check(static_cast<int>(start.q.rows()), static_cast<int>(start.q.cols()));
  make_integrator(integrator);  // an unknown name
  if (auto sampler = make_pair_sampler(system, integrator, start, plan)) return sampler;
  if (auto sampler = make_landmark_sampler(system, integrator, start, plan)) return sampler;
  return make_scalar_sampler(system, integrator, start, plan);
}

}  // namespace pulson::ensemble
