#include <algorithm>
#include <limits>

#include "landmark_lanes.hpp"
#include "path_sampler.hpp"
#include "sample_lanes.hpp"

namespace pulson {
namespace {

// Beyond it the lanes' memory for each pair, 64 bytes and more, outgrows the caches, and shapes are their own vectors.
constexpr Eigen::Index kMostLandmarks = 1000;

class LandmarkSampler final : public PathSampler {
 public:
  LandmarkSampler(LandmarkModel model, PhaseState start, PathPlan plan)
      : model_(std::move(model)), start_(std::move(start)), plan_(std::move(plan)) {}

  std::string name() const override { return "landmark lanes"; }

  LaneEnds sample(std::uint64_t first_path, const Sink& sink) const override {
    return sample_lanes(
        landmark_batch(model_, first_path, start_), plan_, 2 * start_.q.size(), sink,
        [&](LandmarkBatch& batch, std::uint32_t first, std::uint32_t last) {
          advance_landmarks(model_, batch, first, last);
        },
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

  LandmarkModel model_;
  PhaseState start_;
  PathPlan plan_;
};

}  // namespace

std::unique_ptr<const PathSampler> make_landmark_sampler(const StochasticSystem& system, const std::string& integrator,
                                                         const PhaseState& start, const PathPlan& plan) {
  const NoiseTraits traits = system.noise->traits();
  if (integrator != "variational" && integrator != "variational-paper") return nullptr;
  if (!traits.additive || !traits.hamiltonian || start.q.cols() > kMostLandmarks) return nullptr;
  LandmarkModel model(system, static_cast<int>(start.q.rows()), static_cast<int>(start.q.cols()), plan.grid.dt(),
                      plan.seed);
  model.antithetic = plan.antithetic;
  return std::make_unique<LandmarkSampler>(std::move(model), start, plan);
}

}  // namespace pulson
