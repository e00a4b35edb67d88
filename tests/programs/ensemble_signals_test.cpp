// The verb `ensemble` under signals: it stops in order, loses nothing that was saved, and goes on to the same bits.

#include <algorithm>
#include <chrono>
#include <csignal>
#include <thread>

#include <gmock/gmock.h>

#include "ensemble_program.hpp"
#include "program_signals.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::StartsWith;

/// What a killed process leaves in its folder: its lock, which holds nobody back.
constexpr const char* kLock = ".pulson.lock";

using EnsembleSignals = WithSignals<EnsembleProgram>;

TEST_F(EnsembleSignals, StopsAfterASignalAndGoesOn) {
  const std::string kRun = "--samples 40000 --threads 1 ";  // a second or two
  ASSERT_EQ(run_pair(kRun + "-o whole").exit_code, 0);
  for (const int signal : {SIGINT, SIGTERM}) {
    SCOPED_TRACE(signal);
    const pid_t child = sampling(kPair + kRun + "-o parts");
    ::kill(child, signal);
    const ProgramRun stopped = finished(child);
    EXPECT_EQ(stopped.exit_code, 3) << stopped.err;
    EXPECT_THAT(stopped.err, StartsWith("warning: partial: "));
    EXPECT_EQ(read_json("parts/ensemble.json")["partial"], true);
    EXPECT_LT(read_json("parts/ensemble.json")["samples"], 40000);
    EXPECT_EQ(run_pair(kRun + "-o parts --resume").exit_code, 0);
    expect_same_results("whole", "parts");
    std::filesystem::remove_all("parts");
  }
}

TEST_F(EnsembleSignals, EndsAtOnceAfterASecondSignal) {
  // The first 64 paths alone take minutes.
  const pid_t child = sampling(kPair + std::string("--integrator midpoint --dt 0.0001 --threads 1 -o out"));
  // A signal before the first path would end it in order.
  while (seconds_used(child) < 0.2 && is_running(child)) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  ::kill(child, SIGINT);
  while (catches(child, SIGINT) && is_running(child)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  ::kill(child, SIGINT);
  EXPECT_EQ(finished(child).exit_code, -SIGINT);
  EXPECT_THAT(names_in("out"), ElementsAre(kLock));
}

TEST_F(EnsembleSignals, LosesNothingOfWhatWasSavedWhenItIsKilled) {
  const std::string kRun = "--samples 40000 --threads 1 -o ";
  run_pair(kRun + "out --stop-after 1");
  const auto before = all_files();
  const pid_t child = sampling(kPair + kRun + "out --resume");
  ::kill(child, SIGKILL);
  EXPECT_EQ(finished(child).exit_code, -SIGKILL);
  std::filesystem::remove("out.txt");
  std::filesystem::remove("err.txt");
  EXPECT_THAT(changed_since(before), ElementsAre(std::string("./out/") + kLock));
  const ProgramRun done = run_pair(kRun + "out --resume");
  EXPECT_FALSE(std::filesystem::exists(std::string("out/") + kLock));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  run_pair(kRun + "whole");
  expect_same_results("whole", "out");
}

TEST_F(EnsembleSignals, LosesNothingOfAShardThatIsKilled) {
  const std::string kRun = "--samples 40000 --threads 1 -o ";
  run_pair(kRun + "parts --shard 2/2");
  run_pair(kRun + "parts --shard 1/2 --stop-after 1");
  const pid_t child = sampling(kPair + kRun + "parts --shard 1/2 --resume");
  ::kill(child, SIGKILL);
  EXPECT_EQ(finished(child).exit_code, -SIGKILL);
  EXPECT_EQ(run_pair(kRun + "parts --shard 1/2 --resume").exit_code, 0);
  EXPECT_THAT(names_in("parts"), ElementsAre("part-1-of-2.ensemble", "part-2-of-2.ensemble"));
  EXPECT_EQ(run(words("merge parts/part-1-of-2.ensemble parts/part-2-of-2.ensemble --no-picture -o out")).exit_code, 0);
  run_pair(kRun + "whole");
  expect_same_results("whole", "out");
}

// Sums are saved every ten seconds.
TEST_F(EnsembleSignals, BeginsAnewWhenItWasKilledBeforeAnythingWasSaved) {
  const std::string kRun = "--samples 100000000 --threads 1 -o out --no-picture";
  const pid_t child = sampling(kPair + kRun);
  ::kill(child, SIGKILL);
  EXPECT_EQ(finished(child).exit_code, -SIGKILL);
  EXPECT_THAT(names_in("out"), ElementsAre(kLock));
  const ProgramRun done = run_pair(kRun + " --resume --stop-after 64");
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_THAT(done.err, StartsWith("note: nothing is saved in 'out' yet: the run begins\n"));
  EXPECT_EQ(read_json("out/ensemble.json")["samples"], 64);
}

}  // namespace
}  // namespace pulson
