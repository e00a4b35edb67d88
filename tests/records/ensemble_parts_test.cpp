// Shards of an ensemble: however it is shared out, and in whatever order the parts come, their sum has the bits of one
// run.

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "ensemble_runs.hpp"
#include "error_of.hpp"

namespace pulson::records {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Eleven blocks and a part of one; some paths get lost, and all states are kept.
EnsembleExample eleven_blocks() {
  EnsembleExample example{.noise = "trouve-vialard:sigma=0.6+ch-sd:beta=1"};
  example.options = options_of({4, 40}, 11 * 64 + 10, 9);
  example.options.momentum_bound = 6;
  example.options.antithetic = true;
  example.options.records = {0, 7, 40};
  example.options.histograms = {7, 40};
  example.options.keep = ensemble::KeepStates::kAll;
  return example;
}

/// As another process reads it.
EnsembleRun written_and_read(const EnsembleRun& run) { return read_ensemble_part(ensemble_checkpoint(run), "part"); }

std::vector<EnsembleRun> parts_of(EnsembleExample example, int count) {
  std::vector<EnsembleRun> parts;
  for (int index = 1; index <= count; ++index) {
    example.options.shard = {index, count};
    parts.push_back(written_and_read(finished_run(example)));
  }
  return parts;
}

std::vector<std::string> names_of(const std::vector<EnsembleRun>& parts) {
  std::vector<std::string> names;
  for (const EnsembleRun& part : parts) names.push_back("part-" + std::to_string(part.options.shard.index));
  return names;
}

EnsembleRun merged(const std::vector<EnsembleRun>& parts) { return merge_ensembles(parts, names_of(parts)); }

TEST(EnsembleParts, MergeToTheBitsOfOneRun) {
  for (const EnsembleExample& example : {eleven_blocks(), line_example(), plane_example()}) {
    const EnsembleRun whole = finished_run(example);
    const int blocks = static_cast<int>((example.options.samples + 63) / 64);
    for (const int count : {1, 2, 3, 5, 7, 12}) {
      if (count > blocks) continue;
      SCOPED_TRACE(example.noise + " in parts: " + std::to_string(count));
      std::vector<EnsembleRun> parts = parts_of(example, count);
      for (int turn = 0; turn < 3; ++turn) {
        const EnsembleRun all = merged(parts);
        expect_same_bits(all.sums, whole.sums);
        EXPECT_EQ(ensemble_means_csv(all), ensemble_means_csv(whole));
        EXPECT_EQ(ensemble_densities_csv(all), ensemble_densities_csv(whole));
        std::rotate(parts.begin(), parts.begin() + 1, parts.end());
        std::reverse(parts.begin(), parts.end());
      }
    }
  }
}

TEST(EnsembleParts, HaveAllPathsOnce) {
  ensemble::EnsembleOptions options = eleven_blocks().options;
  for (int count = 1; count <= 12; ++count) {
    std::int64_t next = 0;
    for (int index = 1; index <= count; ++index) {
      options.shard = {index, count};
      EXPECT_EQ(options.first_path(), next);
      EXPECT_GT(options.shard_samples(), 0);
      next += options.shard_samples();
    }
    EXPECT_EQ(next, options.samples);
  }
}

// After an interruption the blocks that are left must be added up in the same order.
TEST(EnsembleParts, GoOnAfterAnInterruption) {
  EnsembleExample example = eleven_blocks();
  const EnsembleRun whole = finished_run(example);
  std::vector<EnsembleRun> parts = parts_of(example, 2);
  example.options.shard = {2, 2};
  for (int blocks = 0; blocks < 6; ++blocks) {
    EnsembleRun run = run_after(example, blocks);
    ensemble::Ensemble again = example.ensemble();
    again.resume(read_ensemble_checkpoint(run, ensemble_checkpoint(run), "x"));
    again.advance(100);
    run.sums = again.sums();
    parts[1] = written_and_read(run);
    expect_same_bits(merged(parts).sums, whole.sums);
  }
}

TEST(EnsembleParts, KeepWhatTheRecordSays) {
  EnsembleExample example = plane_example();
  example.options.shard = {2, 2};
  EnsembleRun run = finished_run(example);
  run.shape.labels = {"nose", "left, eye", "right \"eye\""};
  run.shape.groups = {"a", "b", "b"};
  run.shape.numbers = {3, 5, 8};
  run.shape.frame.y_down = true;
  run.notes = {"a note"};
  const EnsembleRun back = written_and_read(run);
  EXPECT_EQ(ensemble_json(back), ensemble_json(run));
  EXPECT_EQ(back.shape.labels, run.shape.labels);
  EXPECT_EQ(back.shape.groups, run.shape.groups);
  EXPECT_EQ(back.shape.numbers, run.shape.numbers);
  EXPECT_TRUE(back.shape.frame.y_down);
  EXPECT_EQ(back.notes, run.notes);
  EXPECT_EQ(back.densities, run.densities);
}

TEST(EnsembleParts, ThatDoNotMakeAWholeAreNamed) {
  const std::vector<EnsembleRun> parts = parts_of(eleven_blocks(), 12);
  const auto error_with = [&](const std::function<void(std::vector<EnsembleRun>&)>& change) {
    std::vector<EnsembleRun> changed = parts;
    change(changed);
    return error_of([&] { merged(changed); });
  };
  EXPECT_EQ(error_with([](auto& all) { all.erase(all.begin() + 4); }), "part 5/12 is missing");
  EXPECT_EQ(error_with([](auto& all) { all.erase(all.begin(), all.begin() + 2); }), "parts 1/12, 2/12 are missing");
  EXPECT_EQ(error_with([](auto& all) { all.erase(all.begin() + 1, all.end()); }),
            "parts 2/12, 3/12, 4/12, 5/12, 6/12, 7/12, 8/12, 9/12, 10/12, 11/12 and 1 more are missing");
  EXPECT_EQ(error_with([](auto& all) { all[3] = all[2]; }),
            "'part-3' and 'part-3' are both part 3/12; one of them is enough");
  EXPECT_EQ(error_with([](auto& all) {
              EnsembleExample example = eleven_blocks();
              example.options.shard = {12, 12};
              all[11] = run_after(example, 0);
            }),
            "'part-12' is not finished: it has 0 of 10 paths. Part 12/12 has to go on before it is merged");
  EXPECT_THAT(error_with([](auto& all) { all[7].options.seed = 10; }),
              AllOf(HasSubstr("'part-8' is part of another ensemble than 'part-1'"), HasSubstr("its seed is 10")));
  EXPECT_THAT(error_with([](auto& all) { all.back() = parts_of(eleven_blocks(), 2).back(); }),
              HasSubstr("its shards is 2, there it is 12"));
}

TEST(EnsembleParts, CannotBeMoreThanTheBlocks) {
  EnsembleExample example = eleven_blocks();
  for (const ensemble::Shard shard : {ensemble::Shard{1, 13}, {0, 2}, {3, 2}, {1, 0}}) {
    example.options.shard = shard;
    EXPECT_THROW(example.ensemble(), InputError) << shard.index << "/" << shard.count;
  }
}

TEST(EnsembleParts, OfDamagedBytesAreRefused) {
  EnsembleExample example = plane_example();
  example.options.shard = {1, 2};
  const std::string bytes = ensemble_checkpoint(finished_run(example));
  for (std::size_t size = 0; size < bytes.size(); size += 211)
    EXPECT_THROW(read_ensemble_part(bytes.substr(0, size), "p"), InputError) << size;
}

}  // namespace
}  // namespace pulson::records
