// The verb `ensemble`: what it writes, and that stops do not change it.

#include "ensemble_program.hpp"

#include <cmath>
#include <cstring>

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pulson/core/parallel.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

TEST_F(EnsembleProgram, WritesARecordAndTables) {
  const ProgramRun done = run_pair("--samples 200 --time 10 --seed 3 --records 11 --densities 2.5 -o out");
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.err, "");
  EXPECT_THAT(names_in("out"), ElementsAre("densities.csv", "ensemble.json", "means.csv", "report.html"));
  EXPECT_THAT(done.out, StartsWith("200 paths of 2 landmarks in 1D to t = 10: 500 steps of 0.02, seed 3\n"));
  EXPECT_THAT(done.out, HasSubstr("\npaths      200 clean, 0 without a root, 0 with momenta beyond 1e8, 0 ties\n"));
  EXPECT_THAT(done.out, HasSubstr("\ncrossing   "));
  EXPECT_THAT(done.out, HasSubstr("\nmomentum   total conserved to "));
  const nlohmann::json record = read_json("out/ensemble.json");
  EXPECT_EQ(record["samples"], 200);
  EXPECT_EQ(record["partial"], false);
  EXPECT_EQ(record["times"], nlohmann::json::parse("[0.0, 1.0, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]"));
  EXPECT_EQ(record["mean_q"].size(), 12U);
  EXPECT_EQ(count_lines(contents("out/means.csv")), 1 + 12 * 4U);
  const std::string densities = contents("out/densities.csv");
  EXPECT_THAT(densities, HasSubstr("\n2.5,1,q,x,"));
  EXPECT_THAT(densities, HasSubstr("\n10,2,p,x,"));
}

TEST_F(EnsembleProgram, IsAFunctionOfTheSeedAlone) {
  for (const int threads : {1, 2, 3}) {
    const std::string folder = "by" + std::to_string(threads);
    EXPECT_EQ(run_pair("--samples 1000 --time 10 --threads " + std::to_string(threads) + " -o " + folder).exit_code, 0);
    EXPECT_EQ(read_json(folder + "/ensemble.json")["threads"], std::min(threads, thread_count()));
    expect_same_results("by1", folder);
  }
  run_pair("--samples 1000 --time 10 --seed 2 -o other");
  EXPECT_NE(record_of("by1"), record_of("other"));
}

TEST_F(EnsembleProgram, PrintsOnlyTheRecordWhereItIsAskedFor) {
  const ProgramRun done = run_pair("--samples 64 --time 1 -o out --json -");
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.err, "");
  EXPECT_TRUE(done.out == contents("out/ensemble.json"));
  EXPECT_EQ(run_pair("--samples 64 --time 1 -o out --quiet --json copy.json").out, "");
  EXPECT_EQ(read_json("copy.json")["samples"], 64);
}

TEST_F(EnsembleProgram, GoesOnToTheSameBits) {
  const std::string kRun = "--samples 2000 --time 20 --antithetic --save-paths ";
  ASSERT_EQ(run_pair(kRun + "whole.npy -o whole").exit_code, 0);
  std::string options = kRun + "parts.npy -o parts --stop-after ";
  std::int64_t before = 0;
  for (const std::string stop : {"1 --threads 1", "65 --threads 2 --resume", "193 --threads 3 --resume"}) {
    const ProgramRun part = run_pair(options + stop);
    EXPECT_EQ(part.exit_code, 3);
    EXPECT_THAT(part.out, StartsWith("PARTIAL: "));
    EXPECT_THAT(part.err, HasSubstr("of 2000 paths; continue with --resume"));
    EXPECT_THAT(names_in("parts"),
                ElementsAre("densities.csv", "ensemble.json", "ensemble.partial", "means.csv", "report.html"));
    const nlohmann::json record = read_json("parts/ensemble.json");
    EXPECT_EQ(record["partial"], true);
    EXPECT_EQ(record["samples_wanted"], 2000);
    EXPECT_GT(record["samples"], before);
    before = record["samples"];
  }
  EXPECT_LT(before, 2000);
  EXPECT_EQ(run_pair(kRun + "parts.npy -o parts --resume").exit_code, 0);
  expect_same_results("whole", "parts");
  EXPECT_TRUE(contents("whole.npy") == contents("parts.npy"));
}

// Rounded up to whole blocks of 64.
TEST_F(EnsembleProgram, StopsAfterSoManySamples) {
  for (const auto& [stop, samples] : std::vector<std::pair<int, int>>{{1, 64}, {200, 256}, {640, 640}}) {
    const std::string folder = "out" + std::to_string(stop);
    run_pair("--samples 4000 --time 1 --threads 2 --stop-after " + std::to_string(stop) + " -o " + folder);
    EXPECT_EQ(read_json(folder + "/ensemble.json")["samples"], samples);
  }
}

TEST_F(EnsembleProgram, WritesStatesForNumpy) {
  const ProgramRun done =
      run_pair("--samples 70 --time 2 --records 5 --save-final ends.npy --save-paths all.npy -o out");
  EXPECT_EQ(done.exit_code, 0) << done.err;
  const std::string ends = contents("ends.npy");
  const std::string all = contents("all.npy");
  EXPECT_THAT(ends.substr(0, 128), HasSubstr("'shape': (70, 2, 2, 1,)"));
  EXPECT_THAT(all.substr(0, 128), HasSubstr("'shape': (70, 5, 2, 2, 1,)"));
  ASSERT_EQ(ends.size() % 64, (70 * 4 * 8) % 64U);
  ASSERT_GT(all.size(), 70 * 5 * 4 * 8U);
  const auto number = [](const std::string& file, std::size_t from_end) {
    double x = 0;
    std::memcpy(&x, file.data() + file.size() - 8 * from_end, 8);
    return x;
  };
  double mean = 0;
  for (std::size_t m = 0; m < 70; ++m) {
    for (std::size_t c = 1; c <= 4; ++c) EXPECT_EQ(number(ends, 4 * m + c), number(all, 20 * m + c));
    EXPECT_EQ(number(all, 20 * m + 20), 0);  // q1 at time 0
    EXPECT_EQ(number(all, 20 * m + 19), 10);
    mean += number(ends, 4 * m + 3) / 70;
  }
  EXPECT_NEAR(mean, read_json("out/ensemble.json")["mean_q"].back()[1][0].get<double>(), 1e-12);
}

TEST_F(EnsembleProgram, TakesAShapeOfThePlane) {
  write("five.csv", "x,y\n0,0\n1,0\n1,1\n0,1\n0.5,1.5\n");
  const ProgramRun done = run(words(
      "ensemble --shape five.csv --noise ch-sd:beta=0.1 --samples 100 --dt 0.05 --records 3 --no-picture -o out"));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, StartsWith("100 paths of 5 landmarks in 2D to t = 1: 20 steps of 0.05, seed 1\n"));
  EXPECT_THAT(done.out, testing::Not(HasSubstr("crossing")));
  const nlohmann::json record = read_json("out/ensemble.json");
  EXPECT_TRUE(record["crossing"].is_null());
  ASSERT_EQ(record["mean_q"].size(), 3U);
  // Momenta are 0: the positions are those of the noise alone, whose variance is β²(T − ¾Δt).
  const double deviation = 0.1 * std::sqrt(1 - 0.75 * 0.05);
  const std::vector<std::vector<double>> start = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0.5, 1.5}};
  for (std::size_t a = 0; a < 5; ++a)
    for (std::size_t axis = 0; axis < 2; ++axis) {
      EXPECT_EQ(record["mean_q"][0][a][axis], start[a][axis]);
      EXPECT_NEAR(record["mean_q"][2][a][axis].get<double>(), start[a][axis], 5 * deviation / 10);
      EXPECT_NEAR(record["deviation_q"][2][a][axis].get<double>(), deviation, 5 * deviation / std::sqrt(200));
      EXPECT_EQ(record["mean_p"][2][a][axis], 0);
    }
}

TEST_F(EnsembleProgram, TellsOfPathsThatAreLost) {
  const ProgramRun done = run_pair("--samples 100 --time 20 --bound 3.9999 -o out");
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_THAT(done.err,
              StartsWith("warning: 100 of 100 paths are not clean; no probability and no mean is determined"));
  EXPECT_EQ(read_json("out/ensemble.json")["paths"]["momentum_bound"], 100);
  EXPECT_TRUE(read_json("out/ensemble.json")["crossing"].is_null());
  EXPECT_EQ(count_lines(contents("out/means.csv")), 1U);
}

// As on a cluster: parts in one folder, at the same time and in any order, given --resume from the start.
TEST_F(EnsembleProgram, MergesPartsToTheFilesOfOneRun) {
  const std::string options = "--samples 1000 --time 10 --densities 5 ";
  ASSERT_EQ(run_pair(options + "--save-final one.npy -o one").exit_code, 0);
  std::vector<pid_t> parts;
  for (const int index : {3, 1, 4, 2}) {
    const pid_t child = ::fork();
    if (child == 0)
      ::_exit(
          run_pair(options + "--save-final parts.npy --resume --quiet -o parts --shard " + std::to_string(index) + "/4")
              .exit_code);
    parts.push_back(child);
  }
  for (const pid_t child : parts) {
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_EQ(WEXITSTATUS(status), 0);
  }
  EXPECT_THAT(names_in("parts"), ElementsAre("part-1-of-4.ensemble", "part-2-of-4.ensemble", "part-3-of-4.ensemble",
                                             "part-4-of-4.ensemble"));
  const ProgramRun merge =
      run(words("merge parts/part-2-of-4.ensemble parts/part-4-of-4.ensemble parts/part-1-of-4.ensemble "
                "parts/part-3-of-4.ensemble --save-final two.npy --no-picture -o two"));
  EXPECT_EQ(merge.exit_code, 0) << merge.err;
  expect_same_results("one", "two");
  EXPECT_TRUE(contents("one.npy") == contents("two.npy"));
}

TEST_F(EnsembleProgram, SaysWhatPartsLackAndWritesNothing) {
  ASSERT_EQ(run_pair("--samples 200 --time 1 --shard 1/2 -o parts").exit_code, 0);
  ASSERT_EQ(run_pair("--samples 200 --time 1 --shard 2/2 --stop-after 64 -o parts").exit_code, 3);
  const auto error_of_merge = [](const std::string& arguments) {
    const ProgramRun merge = run(words("merge " + arguments + " --no-picture -o out"));
    EXPECT_EQ(merge.exit_code, 2);
    EXPECT_THAT(names_in("out"), ElementsAre());
    return merge.err;
  };
  EXPECT_EQ(error_of_merge("parts/part-1-of-2.ensemble"), "pulson: part 2/2 is missing\n");
  EXPECT_EQ(error_of_merge("parts/part-1-of-2.ensemble parts/part-2-of-2.ensemble"),
            "pulson: 'parts/part-2-of-2.ensemble' is not finished: it has 64 of 72 paths. Part 2/2 has to go on before "
            "it is merged\n");
  EXPECT_EQ(error_of_merge("none"), "pulson: cannot read 'none': No such file or directory\n");
  const ProgramRun again = run_pair("--samples 200 --time 1 --shard 2/2 --resume -o parts");
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_THAT(again.out, HasSubstr("part 2 of 2: 72 of its 72 paths"));
  EXPECT_EQ(error_of_merge("parts/part-1-of-2.ensemble parts/part-2-of-2.ensemble --save-final x.npy"),
            "pulson: 'x.npy' cannot be written: give --save-final or --save-paths to the parts\n");
  EXPECT_EQ(run(words("merge parts/part-1-of-2.ensemble parts/part-2-of-2.ensemble --no-picture -o out")).exit_code, 0);
}

TEST_F(EnsembleProgram, TakesShardsThatAreSome) {
  for (const std::string shard : {"0/2", "3/2", "1", "1/2/3", "a/2", "/2", "1/", "-1/2"}) {
    const ProgramRun wrong = run_pair("--samples 200 -o out --shard=" + shard);
    EXPECT_EQ(wrong.exit_code, 2) << shard;
    EXPECT_EQ(wrong.err, "pulson: --shard is '" + shard + "'; it must be i/n, as in 3/8, i from 1 to n\n");
  }
}

}  // namespace
}  // namespace pulson
