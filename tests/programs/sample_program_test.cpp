// The verb `sample`: what it writes, and what it refuses.

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "program.hpp"
#include "program_signals.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class SampleProgram : public Program {
 protected:
  static ProgramRun sample_pair(const std::string& options) {
    return run(joined({"sample"}, words(sample("swap_source") + ' ' + sample("swap_target") + ' ' + options)));
  }

  static void expect_refused(const std::string& options, const std::string& message) {
    const auto before = all_files();
    const ProgramRun refused = sample_pair(options);
    EXPECT_EQ(refused.exit_code, 2) << options;
    EXPECT_EQ(count_lines(refused.err), 1U) << refused.err;
    EXPECT_THAT(refused.err, HasSubstr(message)) << options;
    EXPECT_THAT(changed_since(before), IsEmpty()) << options;
  }
};

TEST_F(SampleProgram, WritesDrawsAndTheirSummary) {
  const ProgramRun done = sample_pair(
      "-o out --noise ch-sd:beta=1:fit(0.2) --sigma 0.2 --lambda 1 --kernel gaussian:alpha=1 --steps 4 "
      "--chains 2 --draws 40 --warmup 20 --searches 1 --no-picture");
  ASSERT_TRUE(done.exit_code == 0 || done.exit_code == 3) << done.err;
  EXPECT_THAT(names_in("out"), ElementsAre("draws.csv", "momenta.npy", "paths.npy", "report.html", "summary.json"));
  const nlohmann::json summary = read_json("out/summary.json");
  EXPECT_EQ(summary["chains"], 2);
  EXPECT_EQ(summary["draws"], 40);
  EXPECT_GT(summary["parameters"]["beta"]["mean"].get<double>(), 0);
  EXPECT_EQ(summary["momenta"].size(), 2U);
  EXPECT_EQ(summary["momentum_prior"], "kernel");
  EXPECT_GT(summary["path"]["ess_min"].get<double>(), 0);
  EXPECT_TRUE(summary["log_evidence"]["value"].is_number());
  EXPECT_EQ(summary["converged"].get<bool>(), done.exit_code == 0);
  EXPECT_EQ(count_lines(contents("out/draws.csv")), 81U);
}

// Where sigma is half the distance of the landmarks, momenta of the two priors are of different sizes.
TEST_F(SampleProgram, TakesSmoothMomenta) {
  const std::string model =
      "--noise none --sigma 0.5 --lambda 1 --kernel gaussian:alpha=1 --steps 4 --align none "
      "--method pcn --chains 1 --draws 40 --warmup 20 --searches 1 --no-picture ";
  const ProgramRun smooth = sample_pair(model + "--momenta smooth -o smooth"),
                   kernel = sample_pair(model + "-o kernel");
  EXPECT_THAT(smooth.out, HasSubstr("lambda 1 of smooth momenta, sigma 0.5"));
  const nlohmann::json record = read_json("smooth/summary.json"), other = read_json("kernel/summary.json");
  EXPECT_EQ(record["momentum_prior"], "smooth");
  EXPECT_GT(std::abs(record["log_evidence"]["laplace"].get<double>() - other["log_evidence"]["laplace"].get<double>()),
            0.1);
}

// A ring of 40 landmarks that move by themselves, much wider a kernel than they are apart.
TEST_F(SampleProgram, NamesSmoothMomentaWhereDenseLandmarksDoNotConverge) {
  std::ofstream source("ring.csv"), target("oval.csv");
  for (int a = 0; a < 40; ++a) {
    const double x = std::cos(0.05 * a * std::numbers::pi), y = std::sin(0.05 * a * std::numbers::pi);
    source << x << ',' << y << '\n';
    target << 1.2 * x + 0.2 * y * y << ',' << 0.8 * y << '\n';
  }
  source.close();
  target.close();
  const std::string rest =
      " --kernel matern32:alpha=2 --lambda 10 --sigma 0.01 --steps 4 --chains 2 --draws 20 --warmup 80 "
      "--no-picture -o dense";
  const ProgramRun done = run(words("sample ring.csv oval.csv --noise ch-sd:beta=3%" + rest));
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_THAT(done.err, HasSubstr(", or --momenta smooth --method rto\n"));
}

using SampleSignals = WithSignals<SampleProgram>;

TEST_F(SampleSignals, SavesTheChainsAfterASignalAndGoesOn) {
  const std::string kRun =
      "--noise ch-sd:beta=1:fit(0.2) --sigma 0.2 --lambda 1 --kernel gaussian:alpha=1 --steps 10 --chains "
      "2 "
      "--draws 2000 --warmup 100 --searches 1 --no-picture --threads 1 ";  // some seconds
  const std::string kPair = "sample " + sample("swap_source") + ' ' + sample("swap_target") + ' ';
  const pid_t child = sampling(kPair + kRun + "-o parts");
  ::kill(child, SIGINT);
  const ProgramRun stopped = finished(child);
  EXPECT_EQ(stopped.exit_code, 3) << stopped.err;
  EXPECT_EQ(stopped.err,
            "warning: interrupted: the chains are saved in 'parts/sample.partial'; continue with --resume\n");
  EXPECT_THAT(names_in("parts"), ElementsAre("sample.partial"));
  expect_refused(kRun + "-o parts", "'parts/sample.partial' belongs to an unfinished run: continue it with --resume");
  expect_refused(kRun + "-o parts --resume --seed 2",
                 "is of another run than this: it has seed = 1, here it is seed = 2");
  const ProgramRun done = sample_pair(kRun + "-o parts --resume");
  ASSERT_TRUE(done.exit_code == 0 || done.exit_code == 3) << done.err;
  const ProgramRun whole = sample_pair(kRun + "-o whole");
  EXPECT_EQ(contents("parts/draws.csv"), contents("whole/draws.csv"));
  EXPECT_EQ(contents("parts/paths.npy"), contents("whole/paths.npy"));
  EXPECT_EQ(names_in("parts"), names_in("whole"));
  const auto before = all_files();
  const ProgramRun again = sample_pair(kRun + "-o parts --resume");
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_EQ(again.err, "note: there is nothing left to do: 'parts/summary.json' has the results of this run\n");
  EXPECT_THAT(changed_since(before), testing::IsEmpty());
}

TEST_F(SampleProgram, WritesTheNodesOfATree) {
  std::ofstream("tree.nwk") << "((a:1,b:1)x:1,c:2);\n";
  std::ofstream("root.csv") << "x,y\n0,0\n4,1\n";
  std::ofstream("leaves.csv") << "shape,x,y\na,0.5,0.1\na,4.2,1\nb,0.4,0.3\nb,4.1,0.8\nc,-0.4,0\nc,3.5,1.2\n";
  const std::string kTree = "root.csv leaves.csv --tree tree.nwk --time 2 --steps 4 --sigma 0.1:fit ";
  const std::string kRun = "--chains 2 --draws 40 --warmup 20 --noise kunita:beta=0.3:fit,width=1:fit -o out ";
  const ProgramRun done = run(words("sample " + kTree + kRun));
  ASSERT_TRUE(done.exit_code == 0 || done.exit_code == 3) << done.err;
  EXPECT_THAT(done.out, HasSubstr("a tree of 4 branches, with 3 observed nodes of 2 landmarks in 2D"));
  EXPECT_THAT(names_in("out"), ElementsAre("chains.png", "chains.svg", "draws.csv", "nodes.csv", "nodes.npy",
                                           "paths.png", "paths.svg", "report.html", "summary.json"));
  const nlohmann::json summary = read_json("out/summary.json");
  EXPECT_EQ(summary["tree"][1]["node"], "a");
  EXPECT_EQ(summary["tree"][1]["parent"], "x");
  EXPECT_EQ(summary["tree"][3]["steps"], 4);
  EXPECT_EQ(summary["path"]["end"].size(), 16U);
  EXPECT_EQ(summary["path"]["end"][0]["node"], "x");
  EXPECT_TRUE(summary["momenta"].empty());
  EXPECT_EQ(summary["parameters"].size(), 4U);  // beta, width, data-sigma, log_likelihood
  EXPECT_EQ(count_lines(contents("out/nodes.csv")), 17U);
  const ProgramRun rootless =
      run(words("sample leaves.csv --tree tree.nwk --time 2 --steps 4 --sigma 0.1:fit " + kRun));
  ASSERT_TRUE(rootless.exit_code == 0 || rootless.exit_code == 3) << rootless.err;
  EXPECT_THAT(rootless.err, HasSubstr("the root is estimated from 3 shapes by generalised least squares"));
  // a and b count as their mean 0.5 behind x, at a distance of 1.5 beside the 2 of c
  EXPECT_NEAR(read_json("out/summary.json")["root"][0][0].get<double>(), (0.45 / 1.5 - 0.4 / 2) / (1 / 1.5 + 1 / 2.0),
              1e-12);
  const ProgramRun study = run(words("sample " + kTree + kRun + "--calibrate 3 --ranks 7 --no-picture --resume"));
  EXPECT_EQ(study.exit_code, 0);
  EXPECT_THAT(study.err, HasSubstr("note: nothing is saved in 'out' yet: the run begins\n"));
  for (const auto& [options, message] :
       {std::pair<std::string, std::string>{kTree + "--noise none", "a tree needs noise"},
        {kTree + "--noise ch-sd:beta=1 --lambda fit", "'lambda' has no effect on a tree"},
        {kTree + "--noise ch-sd:beta=1 --momenta smooth", "--momenta is the prior of momenta"},
        {"leaves.csv --noise ch-sd:beta=1", "no TARGET is given"},
        {"root.csv root.csv --tree tree.nwk --noise ch-sd:beta=1", "the tree has no node 'root'"},
        {"root.csv leaves.csv --tree root.csv --noise ch-sd:beta=1", "root.csv:1: "}}) {
    const ProgramRun refused = run(words("sample " + options + " -o none"));
    EXPECT_EQ(refused.exit_code, 2) << options;
    EXPECT_THAT(refused.err, HasSubstr(message));
    EXPECT_EQ(count_lines(refused.err), 1U) << refused.err;
  }
  EXPECT_FALSE(std::filesystem::exists("none"));
}

TEST_F(SampleProgram, RanksTrueValuesInSimulations) {
  const ProgramRun done = sample_pair(
      "-o out --noise ch-sd:beta=1:fit --sigma 0.2 --lambda 1 --kernel gaussian:alpha=1 --steps 2 "
      "--calibrate 5 --draws 40 --warmup 20 --ranks 7 --searches 1 --method pcn --no-picture");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(names_in("out"), ElementsAre("calibration.json", "report.html"));
  const nlohmann::json record = read_json("out/calibration.json");
  EXPECT_EQ(record["bins"], 8);
  EXPECT_EQ(record["ranks"]["beta"].size(), 5U);
  EXPECT_TRUE(record["inside_band"].is_boolean());
}

TEST_F(SampleProgram, RefusesWhatCannotBeSampled) {
  expect_refused("-o out --noise ch-sd:beta=1,on=fit", "'on' is not a parameter of these models");
  expect_refused("-o out --noise ch-sd:beta=1 --method nutz", "unknown sampler 'nutz'");
  expect_refused("-o out --noise ch-sd:beta=1 --chains 0", "--chains");
  expect_refused("-o out --noise ch-sd:beta=1 --momenta rough", "unknown prior of the momenta 'rough'");
  expect_refused("-o out --noise ch-sd:beta=1 --calibrate 5 --fault beta", "NAME=FACTOR");
}

}  // namespace
}  // namespace pulson
