// Shards of the verbs whose work is many independent units: merged they are what one run writes, and what makes no
// whole is named.

#include <csignal>
#include <ostream>
#include <regex>

#include <gmock/gmock.h>

#include "program.hpp"
#include "program_signals.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct ShardedRun {
  std::string name;
  std::string line;    ///< but for -o
  std::string record;  ///< of the results
  int units = 0;
};

void PrintTo(const ShardedRun& run, std::ostream* stream) { *stream << run.name; }

class ShardsProgram : public Program {
 protected:
  static std::string part(const ShardedRun& run, int index, int count) {
    return "parts/part-" + std::to_string(index) + "-of-" + std::to_string(count) + "." + run.name;
  }

  static ProgramRun run_part(const ShardedRun& sharded, int index, int count, const std::string& more = "") {
    return run(words(sharded.line + "-o parts --shard " + std::to_string(index) + "/" + std::to_string(count) + more));
  }

  /// But for times.
  static std::string record_in(const std::string& folder, const ShardedRun& run) {
    return std::regex_replace(contents(folder + "/" + run.record), std::regex("\"seconds\": [^\n]*"), "");
  }

  static ProgramRun merge(const std::string& parts) { return run(words("merge " + parts + " --no-picture -o out")); }

  static void expect_error_of_merge(const std::string& parts, const std::string& message) {
    const ProgramRun refused = merge(parts);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_EQ(count_lines(refused.err), 1U) << refused.err;
    EXPECT_THAT(refused.err, HasSubstr(message));
    EXPECT_THAT(names_in("out"), IsEmpty());
  }
};

std::vector<ShardedRun> sharded_runs() {
  const std::filesystem::path shapes = std::filesystem::path(PULSON_SOURCE_DIR) / "sample_shapes";
  const std::string pair = (shapes / "swap_source.csv").string() + ' ' + (shapes / "swap_target.csv").string();
  const std::string leaves = (shapes / "leaves.tps").string();
  return {
      {"sample",
       "sample " + pair +
           " --noise ch-sd:beta=1:fit --sigma 0.2 --lambda 1 --kernel gaussian:alpha=1 --steps 2 "
           "--calibrate 5 --draws 40 --warmup 20 --ranks 7 --searches 1 --method pcn --no-picture ",
       "calibration.json", 5},
      {"compare",
       "compare " + leaves + "#1 " + leaves + "#2 " + leaves +
           "#3 --sigma 0.5 --noise none --noise ch-sd:beta=fit --simulate all --count 2 --cohort-size 3 --importance 0 "
           "--lambda 1 --steps 4 --no-picture ",
       "recovery.json", 4}};
}

class ShardedVerbs : public ShardsProgram, public testing::WithParamInterface<ShardedRun> {};

TEST_P(ShardedVerbs, MergeToTheRecordOfOneRun) {
  const ProgramRun whole = run(words(GetParam().line + "-o whole"));
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  for (const int count : {2, 3}) {
    std::string parts;
    for (int index = count; index >= 1; --index) {
      const ProgramRun done = run_part(GetParam(), index, count);
      ASSERT_EQ(done.exit_code, 0) << done.err;
      EXPECT_THAT(done.out, HasSubstr("part " + std::to_string(index) + " of " + std::to_string(count)));
      parts += part(GetParam(), index, count) + ' ';
    }
    const ProgramRun merged = merge(parts);
    ASSERT_EQ(merged.exit_code, 0) << merged.err;
    EXPECT_EQ(names_in("whole"), names_in("out"));
    EXPECT_GT(record_in("out", GetParam()).size(), 200U);
    EXPECT_TRUE(record_in("whole", GetParam()) == record_in("out", GetParam()));
    EXPECT_EQ(merged.err, whole.err);
  }
}

TEST_P(ShardedVerbs, NeedNothingButTheirParts) {
  ASSERT_EQ(run_part(GetParam(), 1, 2).exit_code, 0);
  ASSERT_EQ(run_part(GetParam(), 2, 2).exit_code, 0);
  expect_error_of_merge(part(GetParam(), 1, 2), "pulson: part 2/2 is missing");
  expect_error_of_merge(part(GetParam(), 1, 2) + ' ' + part(GetParam(), 1, 2), "are both part 1/2");
  std::filesystem::rename("parts", "kept");
  ASSERT_EQ(run(words(GetParam().line + "-o parts --seed 2 --shard 2/2")).exit_code, 0);
  expect_error_of_merge(
      "kept/part-1-of-2." + GetParam().name + ' ' + part(GetParam(), 2, 2),
      "is part of another run than 'kept/part-1-of-2." + GetParam().name + "': it has seed = 2, there it is seed = 1");
  const std::string bytes = contents(part(GetParam(), 2, 2));
  write(part(GetParam(), 2, 2), bytes.substr(0, bytes.size() - 1));
  expect_error_of_merge(part(GetParam(), 2, 2), "is damaged");
}

TEST_P(ShardedVerbs, AreFinishedOnce) {
  ASSERT_EQ(run_part(GetParam(), 1, 2).exit_code, 0);
  const auto before = all_files();
  const ProgramRun again = run_part(GetParam(), 1, 2);
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("exists already: continue or keep it with --resume"));
  EXPECT_THAT(changed_since(before), IsEmpty());
  EXPECT_EQ(run_part(GetParam(), 1, 2, " --resume").exit_code, 0);
  const ProgramRun other = run_part(GetParam(), 1, 2, " --resume --seed 2");
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("it has seed = 1, here it is seed = 2"));
  const ProgramRun many = run_part(GetParam(), 1, 100);
  EXPECT_EQ(many.exit_code, 2);
  EXPECT_EQ(count_lines(many.err), 1U) << many.err;
  EXPECT_THAT(many.err, HasSubstr("--shard asks for 100 parts, and there are " + std::to_string(GetParam().units)));
}

// Scripts give --resume whatever there is: nothing yet, or all.
TEST_P(ShardedVerbs, AreDoneOnceHoweverOftenTheyAreResumed) {
  const std::string line = GetParam().line + "-o whole --resume";
  const ProgramRun first = run(words(line));
  EXPECT_EQ(first.exit_code, 0);
  EXPECT_THAT(first.err, HasSubstr("note: nothing is saved in 'whole' yet: the run begins\n"));
  const auto before = all_files();
  const ProgramRun again = run(words(line));
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_THAT(again.err, HasSubstr("note: there is nothing left to do: 'whole/" + GetParam().record +
                                   "' has the results of this run\n"));
  EXPECT_THAT(changed_since(before), IsEmpty());
  EXPECT_EQ(run(words(line + " --seed 2")).exit_code, 0);
  EXPECT_FALSE(changed_since(before).empty()) << "the results of other options are other results";
}

TEST_F(ShardsProgram, ThatWereChangedAreRefused) {
  const std::string line = "ensemble --q 0,2 --p 1,0 --time 1 --steps 4 --samples 128 --noise ch-sd:beta=1 ";
  ASSERT_EQ(run(words(line + "-o parts --shard 1/2")).exit_code, 0);
  const std::string file = "parts/part-1-of-2.ensemble", bytes = contents(file);
  for (std::size_t bit = 3; bit < 8 * bytes.size(); bit += bytes.size() / 2) {
    std::string changed = bytes;
    changed[bit / 8] = static_cast<char>(changed[bit / 8] ^ (1 << bit % 8));
    write(file, changed);
    expect_error_of_merge(file, "is damaged");
  }
}

INSTANTIATE_TEST_SUITE_P(Verb, ShardedVerbs, testing::ValuesIn(sharded_runs()), kName);

using ShardsUnderSignals = WithSignals<ShardsProgram>;

TEST_F(ShardsUnderSignals, GoOn) {
  ShardedRun sharded = sharded_runs().front();
  sharded.line =
      std::regex_replace(sharded.line, std::regex("--calibrate 5 --draws 40"), "--calibrate 40 --draws 1000") +
      "--threads 1 ";
  ASSERT_EQ(run(words(sharded.line + "-o whole")).exit_code, 0);
  const pid_t child = sampling(sharded.line + "-o parts");
  ::kill(child, SIGTERM);
  const ProgramRun stopped = finished(child);
  EXPECT_EQ(stopped.exit_code, 3) << stopped.err;
  EXPECT_THAT(stopped.err, HasSubstr("simulations are saved in 'parts/sample.partial'; continue with --resume"));
  EXPECT_THAT(names_in("parts"), ElementsAre("sample.partial"));
  EXPECT_EQ(run(words(sharded.line + "-o parts --resume")).exit_code, 0);
  EXPECT_EQ(names_in("whole"), names_in("parts"));
  EXPECT_TRUE(record_in("whole", sharded) == record_in("parts", sharded));
}

TEST_F(ShardsProgram, AreOfUnitsAlone) {
  const std::string pair = sample("swap_source") + ' ' + sample("swap_target") + " -o out ";
  for (const auto& [line, message] :
       {std::pair<std::string, std::string>{"sample " + pair + "--shard 1/2", "--shard is for the simulations"},
        {"compare " + pair + "--sigma 0.1 --shard 1/2", "--shard is for the cohorts"}}) {
    const ProgramRun refused = run(words(line));
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_EQ(count_lines(refused.err), 1U) << refused.err;
    EXPECT_THAT(refused.err, HasSubstr(message));
  }
}

}  // namespace
}  // namespace pulson
