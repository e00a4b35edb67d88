// Sums that are saved and read back: exact, for their own ensemble alone, and never from a damaged file.

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <string>

#include <gmock/gmock.h>

#include "core/checksum.hpp"
#include "ensemble_runs.hpp"

namespace pulson::records {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Everything is kept and paths get lost.
EnsembleExample full_example() {
  EnsembleExample example{.noise = "trouve-vialard:sigma=0.6+ch-sd:beta=1"};
  example.options = options_of({4, 200}, 200, 9);
  example.options.momentum_bound = 6;
  example.options.antithetic = true;
  example.options.records = {0, 7, 200};
  example.options.histograms = {7, 200};
  example.options.keep = ensemble::KeepStates::kAll;
  return example;
}

std::string checkpoint_error(const EnsembleRun& run, const std::string& bytes) {
  try {
    read_ensemble_checkpoint(run, bytes, "out/ensemble.partial");
  } catch (const InputError& error) {
    std::string message = error.what();
    EXPECT_EQ(message.find_first_of("\r\n"), std::string::npos);
    return message.substr(0, 300);
  }
  return "no error";
}

/// The sums with a part of the only node of their tree changed.
void change_node(ensemble::EnsembleSums& sums, const std::function<void(ensemble::MomentNode&)>& change) {
  ensemble::MomentNode node = sums.tree.nodes().front();
  change(node);
  sums.tree = {};
  sums.tree.add(node);
  sums.moments = node.moments;
  sums.pair_moments = node.pair_moments;
}

TEST(EnsembleCheckpoint, IsReadBackToTheSameBits) {
  for (const EnsembleExample& example : {full_example(), line_example(), plane_example()}) {
    for (const int blocks : {0, 1, 2, 100}) {
      SCOPED_TRACE(example.noise + ", blocks: " + std::to_string(blocks));
      const EnsembleRun run = run_after(example, blocks);
      const ensemble::EnsembleSums back = read_ensemble_checkpoint(run, ensemble_checkpoint(run), "x");
      expect_same_bits(back, run.sums);
      ensemble::Ensemble again = example.ensemble();
      again.resume(back);
      again.advance(100);
      expect_same_bits(again.sums(), example.sums());
    }
  }
}

TEST(EnsembleCheckpoint, KeepsEveryFieldWhateverItIs) {
  EnsembleRun run = run_after(full_example(), 1);
  ensemble::EnsembleSums& sums = run.sums;
  sums.samples = std::int64_t{1} << 41U;
  sums.paths = {std::int64_t{1} << 40U, 2, 3, 4};
  sums.crossing = {5, 6, {7, 8, std::int64_t{1} << 41U}};
  sums.momentum_error = 5e-324;
  sums.largest_momentum = std::numeric_limits<double>::infinity();
  change_node(sums, [](ensemble::MomentNode& node) {
    node.moments[1].mean[2] = -0.0;
    node.moments[1].squares[0] = std::nextafter(0.1, 1);
    node.pair_moments[2].count = 7;
  });
  sums.histograms[1][3].counts[511] = std::uint64_t{1} << 40U;
  sums.histograms[1][0].smallest = std::numeric_limits<double>::infinity();
  expect_same_bits(read_ensemble_checkpoint(run, ensemble_checkpoint(run), "x"), sums);
}

TEST(EnsembleCheckpoint, OfMoreThanThereArePathsIsDamaged) {
  const std::vector<std::function<void(ensemble::EnsembleSums&)>> changes = {
      [](ensemble::EnsembleSums& sums) { sums.paths.tie = sums.samples + 1; },
      [](ensemble::EnsembleSums& sums) { sums.crossing.at_end = sums.samples + 1; },
      [](ensemble::EnsembleSums& sums) { sums.crossing.ever = -1; },
      [](ensemble::EnsembleSums& sums) { sums.crossing.pairs[2] = std::int64_t{1} << 52U; },
      [](ensemble::EnsembleSums& sums) {
        sums.histograms[1][3].counts[5] = static_cast<std::uint64_t>(sums.samples) + 1;
      }};
  for (const auto& change : changes) {
    EnsembleRun run = run_after(full_example(), 1);
    change(run.sums);
    EXPECT_THROW(read_ensemble_checkpoint(run, ensemble_checkpoint(run), "x"), InputError);
  }
}

struct Change {
  std::string key;  // that the message names
  std::function<void(EnsembleRun&)> make;
};

TEST(EnsembleCheckpoint, OfAnotherEnsembleIsRefused) {
  const std::string bytes = ensemble_checkpoint(run_after(full_example(), 1));
  const std::vector<Change> changes = {
      {"seed", [](EnsembleRun& run) { run.options.seed = 10; }},
      {"noise", [](EnsembleRun& run) { run.system.noise = make_noise("trouve-vialard:sigma=0.6+ch-sd:beta=1.1"); }},
      {"kernel", [](EnsembleRun& run) { run.system.kernel = make_kernel("gaussian:alpha=1.0000000000000002", {}); }},
      {"integrator", [](EnsembleRun& run) { run.integrator = "variational-paper"; }},
      {"q", [](EnsembleRun& run) { run.start.q(1) = std::nextafter(3.0, 4.0); }},
      {"p", [](EnsembleRun& run) { run.start.p(0) = -4; }},
      {"time", [](EnsembleRun& run) { run.options.grid.time = 4.5; }},
      {"steps", [](EnsembleRun& run) { run.options.grid.steps = 201; }},
      {"samples", [](EnsembleRun& run) { run.options.samples = 202; }},
      {"momentum_bound", [](EnsembleRun& run) { run.options.momentum_bound = 7; }},
      {"antithetic", [](EnsembleRun& run) { run.options.antithetic = false; }},
      {"records",
       [](EnsembleRun& run) {
         run.options.records = {0, 8, 200};
       }},
      {"histograms", [](EnsembleRun& run) { run.options.histograms = {200}; }},
      {"keep", [](EnsembleRun& run) { run.options.keep = ensemble::KeepStates::kNone; }},
      {"shards", [](EnsembleRun& run) {
         run.options.shard = {1, 2};
       }}};
  for (const Change& change : changes) {
    EnsembleRun other = run_after(full_example(), 0);
    EXPECT_EQ(checkpoint_error(other, bytes), "no error");
    change.make(other);
    EXPECT_THAT(checkpoint_error(other, bytes), AllOf(HasSubstr("'out/ensemble.partial' holds another ensemble"),
                                                      HasSubstr(" " + change.key + " is ")));
  }
}

TEST(EnsembleCheckpoint, ThatIsCutOffIsDamaged) {
  const EnsembleRun run = run_after(full_example(), 1);
  const std::string bytes = ensemble_checkpoint(run);
  std::vector<std::size_t> sizes = {0, 1, 2, 10, 100, 1000, bytes.size() / 2, bytes.size() - 9, bytes.size() - 1};
  for (std::size_t size = 0; size < bytes.size(); size += 997) sizes.push_back(size);
  for (const std::size_t size : sizes)
    EXPECT_THAT(checkpoint_error(run, bytes.substr(0, size)), HasSubstr("is damaged")) << size;
  EXPECT_THAT(checkpoint_error(run, bytes + '\0'), HasSubstr("is damaged"));
  EXPECT_THAT(checkpoint_error(run, "time,landmark\n0,1\n"), HasSubstr("is damaged"));
  EXPECT_THAT(checkpoint_error(run, sealed("\xa1\x61x\x01")), HasSubstr("is damaged"));
  EXPECT_THAT(checkpoint_error(run, sealed("\xf6")), HasSubstr("is damaged"));
}

// Lists in lists in lists: to read them takes a stack as deep.
TEST(EnsembleCheckpoint, OfDeepListsIsDamaged) {
  const EnsembleRun run = run_after(line_example(), 0);
  EXPECT_THAT(checkpoint_error(run, sealed(std::string(10'000'000, '\x81'))), HasSubstr("is damaged"));
}

// Moments of more paths than were sampled: their lists may have any length, as nothing is checked where there is none.
TEST(EnsembleCheckpoint, WithMoreMomentsThanPathsIsDamaged) {
  EnsembleRun run = run_after(line_example(), 0);
  run.sums.tree.add({0, 0, {{1, Eigen::ArrayXd::Zero(3), Eigen::ArrayXd::Zero(3)}}, {}});
  EXPECT_THAT(checkpoint_error(run, ensemble_checkpoint(run)), HasSubstr("is damaged"));
}

TEST(EnsembleCheckpoint, WithCountsThatAreNoneIsDamaged) {
  const EnsembleRun run = run_after(line_example(), 1);
  for (const std::int64_t count : {std::int64_t{-1}, std::numeric_limits<std::int64_t>::max()}) {
    EnsembleRun damaged = run;
    damaged.sums.crossing.ever = count;
    EXPECT_THAT(checkpoint_error(run, ensemble_checkpoint(damaged)), HasSubstr("is damaged"));
  }
}

/// Reads damaged bytes as the program does, and goes on from them. @return whether that could be done
bool goes_on(const EnsembleExample& example, const EnsembleRun& run, const std::string& bytes) {
  ensemble::Ensemble ensemble = example.ensemble();
  try {
    ensemble.resume(read_ensemble_checkpoint(run, bytes, "x"));
    while (!ensemble.done()) ensemble.advance(1);
    EnsembleRun end = run;
    end.sums = ensemble.sums();
    EXPECT_FALSE(ensemble_json(end).empty());
    EXPECT_FALSE(ensemble_means_csv(end).empty());
    EXPECT_FALSE(ensemble_densities_csv(end).empty());
  } catch (const Error&) {  // also where sums are infinite, which records do not hold
    return false;
  }
  return true;
}

TEST(EnsembleCheckpoint, WithFlippedBitsIsRefused) {
  const EnsembleRun run = run_after(line_example(), 1);
  const std::string bytes = ensemble_checkpoint(run);
  for (std::size_t bit = 0; bit < 8 * bytes.size(); bit += 5) {
    std::string damaged = bytes;
    damaged[bit / 8] ^= static_cast<char>(1U << bit % 8);
    EXPECT_THAT(checkpoint_error(run, damaged), HasSubstr("is damaged")) << bit;
  }
}

// Of bytes that somebody changed who knows of the checksum: none may do harm.
TEST(EnsembleCheckpoint, WithAnotherChecksumIsRefusedOrDoesNoHarm) {
  EnsembleExample example = full_example();
  example.options.grid = {0.2, 10};
  example.options.records = {0, 10};
  example.options.histograms = {10};
  const EnsembleRun run = run_after(example, 1);
  const std::string whole = ensemble_checkpoint(run);
  const std::string bytes = whole.substr(0, whole.size() - 4);
  std::mt19937_64 engine(1);
  std::size_t refused = 0;
  for (int turn = 0; turn < 3000; ++turn) {
    std::string damaged = bytes;
    for (std::uint64_t flips = 1 + engine() % 3; flips > 0; --flips)
      damaged[engine() % bytes.size()] ^= static_cast<char>(1U << (engine() % 8));
    refused += goes_on(example, run, sealed(damaged)) ? 0 : 1;
  }
  EXPECT_GT(refused, 300U);
}

/// The bytes with the only occurrence of a text replaced.
std::string replaced(std::string bytes, const std::string& text, const std::string& by) {
  const std::size_t at = bytes.find(text);
  EXPECT_NE(at, std::string::npos);
  EXPECT_EQ(bytes.find(text, at + 1), std::string::npos);
  return bytes.replace(at, text.size(), by);
}

TEST(EnsembleCheckpoint, OfAnotherVersionIsRefused) {
  const EnsembleRun run = run_after(line_example(), 1);
  const std::string bytes = ensemble_checkpoint(run);
  EXPECT_EQ(checkpoint_error(run, sealed(replaced(bytes.substr(0, bytes.size() - 4), "pulson ensemble sums 4",
                                                  "pulson ensemble sums 3"))),
            "'out/ensemble.partial' was written by another version of pulson and cannot be resumed");
}

// Lists of other lengths than those of this ensemble: read with no check they would be written beyond their ends.
TEST(EnsembleCheckpoint, WithListsOfOtherLengthsIsRefused) {
  const EnsembleExample example = line_example();
  const std::vector<std::function<void(ensemble::EnsembleSums&)>> damages = {
      [](ensemble::EnsembleSums& sums) {
        change_node(sums, [](auto& node) { node.moments[1].mean.conservativeResize(3); });
      },
      [](ensemble::EnsembleSums& sums) { change_node(sums, [](auto& node) { node.moments[1].squares.resize(0); }); },
      [](ensemble::EnsembleSums& sums) { change_node(sums, [](auto& node) { node.moments.pop_back(); }); },
      [](ensemble::EnsembleSums& sums) { change_node(sums, [](auto& node) { node.first_block = 1; }); },
      [](ensemble::EnsembleSums& sums) { change_node(sums, [](auto& node) { node.level = 1; }); },
      [](ensemble::EnsembleSums& sums) { sums.tree = {}; },
      [](ensemble::EnsembleSums& sums) { sums.histograms.pop_back(); },
      [](ensemble::EnsembleSums& sums) { sums.histograms[1].pop_back(); },
      [](ensemble::EnsembleSums& sums) { sums.histograms[2].clear(); },
      [](ensemble::EnsembleSums& sums) { sums.histograms[1][0].counts.clear(); },
      [](ensemble::EnsembleSums& sums) { sums.states.push_back(1); }};
  for (std::size_t i = 0; i < damages.size(); ++i) {
    EnsembleRun run = run_after(example, 1);
    damages[i](run.sums);
    const std::string bytes = ensemble_checkpoint(run);
    EXPECT_THROW(example.ensemble().resume(read_ensemble_checkpoint(run, bytes, "x")), InputError) << i;
  }
}

}  // namespace
}  // namespace pulson::records
