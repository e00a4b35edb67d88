#include "sampling.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "pulson/core/parallel.hpp"
#include "shell/ranks.hpp"

namespace pulson {
namespace {

constexpr double kCheckpointSeconds = 10;
constexpr double kPieceSeconds = 1.0 / 3;

/// Consecutive blocks, as they are dealt out.
struct Blocks {
  std::int64_t first = 0;
  std::int64_t count = 0;
};

/// Deals out blocks and puts their sums together, in the order of the paths, whatever order they come in.
class Sampling {
 public:
  Sampling(ensemble::Ensemble& ensemble, records::EnsembleRun& run, const SamplingPlan& plan, Progress& progress)
      : progress_(progress),
        ensemble_(ensemble),
        run_(run),
        plan_(plan),
        dealt_(ensemble.blocks_done()),
        end_(std::clamp(blocks_in(plan.stop_after.value_or(run.options.samples)), dealt_, ensemble.blocks())),
        first_(ensemble.blocks_done()) {}

  /// Until all paths are there or a signal comes; saves the sums every so often.
  void run() {
    ranks::share<Blocks, ensemble::EnsembleSums>(
        {.next = [this] { return next(); },
         .work = [this](const Blocks& blocks) { return ensemble_.sample(blocks.first, blocks.count); },
         .take = [this](const Blocks& blocks, ensemble::EnsembleSums sums) { take(blocks, std::move(sums)); },
         .to_bytes = [](const ensemble::EnsembleSums& sums) { return bytes_of(sums); },
         .of_bytes = [](std::string_view bytes) { return ensemble::sums_of_bytes(bytes); }});
    run_.sums = ensemble_.sums();
    run_.seconds = seconds_now() - begin_;
    if (ranks::is_first() && (run_.partial() || saved_ > begin_ || plan_.keep)) save();
  }

 private:
  static std::int64_t blocks_in(std::int64_t samples) {
    return (samples + ensemble::kBlockPaths - 1) / ensemble::kBlockPaths;
  }

  // So many that they take a third of a second, and fewer where few are left, so that all threads end together.
  std::optional<Blocks> next() {
    if (dealt_ == end_) return std::nullopt;
    const auto done = static_cast<double>(ensemble_.blocks_done() - first_);
    const auto in_time =
        static_cast<std::int64_t>(done / std::max(1e-3, seconds_now() - begin_) / threads_ * kPieceSeconds);
    const auto in_turn = static_cast<std::int64_t>(static_cast<double>(end_ - dealt_) / (2 * threads_));
    last_ = std::max<std::int64_t>(1, std::min({in_time, in_turn, 2 * last_}));
    const Blocks blocks{dealt_, last_};
    dealt_ += blocks.count;
    return blocks;
  }

  void take(const Blocks& blocks, ensemble::EnsembleSums sums) {
    waiting_.emplace(blocks.first, std::move(sums));
    for (auto found = waiting_.find(ensemble_.blocks_done()); found != waiting_.end();
         found = waiting_.find(ensemble_.blocks_done())) {
      ensemble_.append(found->second);
      waiting_.erase(found);
    }
    progress_.show(static_cast<double>(ensemble_.blocks_done()) / static_cast<double>(end_),
                   fmt::format("{}{}{} of {} paths", plan_.what, plan_.what.empty() ? "" : ", ",
                               ensemble_.sums().samples, run_.options.shard_samples()));
    const double time = seconds_now();
    if (time - saved_ < kCheckpointSeconds) return;
    saved_ = time;
    run_.sums = ensemble_.sums();
    save();
  }

  void save() const { write_file_atomically(plan_.checkpoint, ensemble_checkpoint(run_)); }

  Progress& progress_;
  ensemble::Ensemble& ensemble_;
  records::EnsembleRun& run_;
  const SamplingPlan& plan_;
  double threads_ = thread_count() * ranks::size();
  double begin_ = seconds_now();
  double saved_ = begin_;
  std::int64_t dealt_;
  std::int64_t end_;
  std::int64_t first_;
  std::int64_t last_ = 1;                                   // blocks dealt out together
  std::map<std::int64_t, ensemble::EnsembleSums> waiting_;  // for those before them
};

}  // namespace

void sample_blocks(ensemble::Ensemble& ensemble, records::EnsembleRun& run, const SamplingPlan& plan,
                   Progress& progress) {
  Sampling(ensemble, run, plan, progress).run();
}

}  // namespace pulson
