// The verb `simulate`: what it writes and prints, and what it refuses.

#include <ostream>

#include <gmock/gmock.h>

#include "program.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr const char* kSimulatePair =
    "simulate --q 0,10 --p 4,1 --kernel gaussian:alpha=1 --noise ch-sd:beta=1.5,on=2 -o out";

class Simulate : public Program {};

TEST_F(Simulate, WritesARecordPathsAndPictures) {
  const ProgramRun done = run(joined(words(kSimulatePair), words("--time 2 --samples 3 --seed 7")));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.err, "");
  EXPECT_THAT(names_in("out"), ElementsAre("paths.csv", "paths.png", "paths.svg", "report.html", "simulation.json"));
  EXPECT_THAT(done.out, HasSubstr("3 paths of 2 landmarks in 1D to t = 2: 100 steps of 0.02, seed 7"));
  EXPECT_THAT(done.out, HasSubstr("momentum   total conserved to"));
  const nlohmann::json record = read_json("out/simulation.json");
  EXPECT_EQ(record["kernel"], "gaussian:alpha=1");
  EXPECT_EQ(record["noise"], "ch-sd:beta=1.5,on=2");
  EXPECT_EQ(record["integrator"], "variational");
  EXPECT_EQ(record["seed"], 7);
  EXPECT_EQ(record["steps"], 100);
  ASSERT_EQ(record["paths"].size(), 3U);
  for (const auto& path : record["paths"]) {
    EXPECT_EQ(path["status"], "clean");
    EXPECT_EQ(path["q"].size(), 2U);
    EXPECT_LT(path["momentum_error"], 1e-13);
    EXPECT_LT(path["contraction_bound"], 1);
  }
  const std::string csv = contents("out/paths.csv");
  EXPECT_THAT(csv, StartsWith("sample,step,time,landmark,q_x,p_x\n1,0,0,1,0,4\n1,0,0,2,10,1\n"));
  EXPECT_EQ(count_lines(csv), 1 + 3 * 101 * 2U);
}

TEST_F(Simulate, IsAFunctionOfTheSeed) {
  const auto paths = [](const std::string& options) {
    run(joined(words(kSimulatePair), words("--time 2 --no-picture " + options)));
    return contents("out/paths.csv");
  };
  EXPECT_EQ(paths("--seed 3 --threads 1 --samples 4"), paths("--seed 3 --threads 2 --samples 4"));
  EXPECT_NE(paths("--seed 3"), paths("--seed 4"));
}

TEST_F(Simulate, WritesEveryNthStepAndTheLast) {
  run(joined(words(kSimulatePair), words("--steps 25 --time 1 --every 10 --no-picture")));
  const std::string csv = contents("out/paths.csv");
  for (const char* step : {"\n1,0,", "\n1,10,", "\n1,20,", "\n1,25,"}) EXPECT_THAT(csv, HasSubstr(step));
  EXPECT_EQ(count_lines(csv), 1 + 4 * 2U);
}

TEST_F(Simulate, TakesMomentaByTheNamesOfLandmarks) {
  write("q.csv", "label,x,y\nnose,0,0\ntail,1,0\nfin,0,1\n");
  write("p.csv", "label,x,y\nNose,0.1,0\nTail,0,0.2\nFin,0,0\n");
  write("mixed.csv", "label,x,y\nFin,0,0\nNose,0.1,0\nTail,0,0.2\n");
  write("plain.csv", "x,y\n0.1,0\n0,0.2\n0,0\n");
  const std::string line = "simulate --shape q.csv --no-picture -o out --momenta ";
  ASSERT_EQ(run(words(line + "p.csv")).exit_code, 0);
  const std::string paths = contents("out/paths.csv");
  ASSERT_EQ(run(words(line + "mixed.csv")).exit_code, 0);
  EXPECT_EQ(contents("out/paths.csv"), paths);
  EXPECT_THAT(run(words(line + "plain.csv")).err, HasSubstr("plain.csv does not name its landmarks"));
  ASSERT_EQ(run(words(line + "plain.csv --by-order")).exit_code, 0);
  EXPECT_EQ(contents("out/paths.csv"), paths);
}

TEST_F(Simulate, TakesShapesAndMomentaFromFiles) {
  write("q.csv", "x,y\n0,0\n1,0\n0,1\n");
  write("p.csv", "x,y\n0.1,0\n0,0.2\n0,0\n");
  const ProgramRun done =
      run(words("simulate --shape q.csv --momenta p.csv --noise p-sd:beta=0.1,fields=grid,count=2 -o out --json -"));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  const nlohmann::json record = nlohmann::json::parse(done.out);
  EXPECT_EQ(record["time"], 1);
  EXPECT_EQ(record["q"], nlohmann::json::parse("[[0.0,0.0],[1.0,0.0],[0.0,1.0]]"));
  EXPECT_EQ(record["p"], nlohmann::json::parse("[[0.1,0.0],[0.0,0.2],[0.0,0.0]]"));
}

TEST_F(Simulate, FollowsARegistrationAgain) {
  run({"register", sample("swap_source"), sample("swap_target"), "--kernel", "gaussian:alpha=1", "-o", "fit"});
  const std::string integrator = read_json("fit/registration.json")["integrator"];
  const ProgramRun done =
      run(words("simulate --from fit/registration.json --steps 20 -o out --json - --integrator " + integrator));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  const nlohmann::json record = nlohmann::json::parse(done.out);
  EXPECT_EQ(record["paths"][0]["q"], read_json("fit/registration.json")["result"]);
}

TEST_F(Simulate, TakesTheLandmarksOfSpace) {
  const ProgramRun done = run(words("simulate --q 0/0/0,1/0/0,0/1/0 --p 1/0/0,0/1/0,0/0/1 --time 1 -o out"));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("3 landmarks in 3D"));
  EXPECT_THAT(names_in("out"), ElementsAre("paths.csv", "paths.png", "paths.svg", "report.html", "simulation.json"));
}

// Every noise of the table, by every integrator that takes it, in 1, 2 and 3 dimensions.
TEST_F(Simulate, RunsEveryNoiseWithEveryIntegrator) {
  for (const std::string noise :
       {"none", "ch-sd:beta=0.1", "ch-sd-screened:beta=0.1,gamma=1", "p-sd:beta=0.1,fields=cos",
        "trouve-vialard:sigma=0.1", "potential:beta=0.1,gamma=1", "langevin:sigma=0.1", "ch-sd:beta=0.1+p-sd:beta=0.1"})
    for (const std::string integrator :
         {"variational", "variational-paper", "variational-2", "midpoint", "heun", "rk4", "stormer-verlet"})
      for (const std::string start :
           {"--q 0,1 --p 1,0", "--q 0/0,1/0 --p 1/0,0/1", "--q 0/0/0,1/0/0 --p 1/0/0,0/1/0"}) {
        if (noise != "none" && (integrator == "rk4" || integrator == "stormer-verlet")) continue;
        const ProgramRun done =
            run(joined(words("simulate " + start), {"--kernel", "matern52:alpha=1", "--time", "0.5", "--no-picture",
                                                    "-o", "out", "--noise", noise, "--integrator", integrator}));
        EXPECT_EQ(done.exit_code, 0) << noise << ", " << integrator << ": " << done.err;
      }
}

// A step without a root ends its path; what came before is written, and the exit code is 3.
TEST_F(Simulate, TellsOfPathsThatEndEarly) {
  const ProgramRun done = run(words("simulate --q 0,0.1 --p -50,50 --kernel gaussian:alpha=1 --time 3 --dt 1 -o out"));
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_THAT(done.err, StartsWith("warning: 1 of 1 paths did not reach their end cleanly; path 1: step 1 of 3"));
  EXPECT_EQ(read_json("out/simulation.json")["paths"][0]["status"], "no_root");
  EXPECT_THAT(names_in("out"), ElementsAre("paths.csv", "paths.png", "paths.svg", "report.html", "simulation.json"));
}

struct WrongLine {
  const char* line;
  const char* message;
};
std::ostream& operator<<(std::ostream& out, const WrongLine& wrong) { return out << wrong.line; }

class WrongSimulation : public Program, public testing::WithParamInterface<WrongLine> {};

TEST_P(WrongSimulation, IsRefusedInOneLine) {
  write("q.csv", "x,y\n0,0\n1,0\n0,1\n");
  write("twice.csv", "x,y\n0,0\n1,0\n1,0\n");
  const auto before = all_files();
  const ProgramRun done = run(joined(words("simulate"), words(GetParam().line)));
  EXPECT_EQ(done.exit_code, 2) << done.err;
  EXPECT_EQ(done.out, "");
  EXPECT_EQ(count_lines(done.err), 1U) << done.err;
  EXPECT_THAT(done.err, StartsWith("pulson: "));
  EXPECT_THAT(done.err, HasSubstr(GetParam().message));
  EXPECT_THAT(changed_since(before), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    Line, WrongSimulation,
    testing::Values(
        WrongLine{"-o out", "an initial state is needed: --q, --shape or --from"},
        WrongLine{"--q 0,1 --shape q.csv -o out", "--shape"}, WrongLine{"--q 0,1", "--out"},
        WrongLine{"--q 0,x -o out", "--q is 'x'; a number is needed"},
        WrongLine{"--q 0,,1 -o out", "--q is ''; a number is needed"},
        WrongLine{"--q 0/0,1 -o out", "--q: landmark 2 has a different number of coordinates from the first (1 and 2)"},
        WrongLine{"--q 0/0/0/0 -o out", "--q: the first landmark has 4 coordinates; 1, 2 or 3 are needed"},
        WrongLine{"--q 0,nan -o out", "--q: '0,nan' has a number that is not finite"},
        WrongLine{"--q 0,0 -o out", "--q: landmarks 1 and 2 are at the same position"},
        WrongLine{"--shape twice.csv -o out", "twice.csv: landmarks 2 and 3 are at the same position"},
        WrongLine{"--shape none.csv -o out", "none.csv"}, WrongLine{"--from none.json -o out", "none.json"},
        WrongLine{"--q 0,1 --p 1 -o out", "--p has 1 landmarks in 1D, the positions 2 in 1D"},
        WrongLine{"--q 0,1 --momenta q.csv -o out", "--momenta has 3 landmarks in 2D, the positions 2 in 1D"},
        WrongLine{"--q 0,1 --samples 0 -o out", "--samples is 0; it must be from 1 to 1000"},
        WrongLine{"--q 0,1 --samples 1000 --steps 1000000 -o out", "at most"},
        WrongLine{"--q 0,1 --every 0 -o out", "--every is 0; it must be at least 1"},
        WrongLine{"--q 0,1 --time 0 -o out", "--time is 0"}, WrongLine{"--q 0,1 --dt 0 -o out", "--dt is 0"},
        WrongLine{"--q 0,1 --steps 10 --dt 1 -o out", "--dt"}, WrongLine{"--q 0,1 --seed -1 -o out", "--seed"},
        WrongLine{"--q 0,1 --noise chsd:beta=1 -o out", "unknown noise 'chsd'; did you mean 'ch-sd'"},
        WrongLine{"--q 0,1 --noise ch-sd:beta=1,on=3 -o out", "on=3 names a landmark beyond the last; the shape has 2"},
        WrongLine{"--q 0,1 --integrator eular -o out", "unknown integrator 'eular'"},
        WrongLine{"--q 0,1 --integrator rk4 --noise ch-sd:beta=1 -o out", "integrator 'rk4' takes no noise"},
        WrongLine{"--q 0 -o out", "alpha=auto needs at least two distinct landmarks"}));

}  // namespace
}  // namespace pulson
