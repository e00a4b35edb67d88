// `ensemble --sweep`, and the runs of `reproduce` that are built on it: against single ensembles, and after being
// killed.

#include <chrono>
#include <csignal>
#include <thread>

#include <gmock/gmock.h>

#include "program_signals.hpp"

namespace pulson {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

/// The paper's pair in steps that are too coarse for it, so that paths take little time.
const std::string kSweepPair = "ensemble --q 0,10 --p 4,1 --dt 0.1 --samples 512 ";
const std::string kSweepKernel = "--kernel gaussian:alpha=1 ";

class Sweeps : public WithSignals<Program> {
 protected:
  static ProgramRun run_line(const std::string& line) { return run(words(line)); }

  static void expect_refused(const std::string& line, const std::string& message) {
    const auto before = all_files();
    const ProgramRun refused = run_line(line);
    EXPECT_EQ(refused.exit_code, 2) << line;
    EXPECT_THAT(refused.err, HasSubstr(message));
    EXPECT_EQ(count_lines(refused.err), 1U);
    EXPECT_THAT(changed_since(before), IsEmpty());
  }

  /// The entry of a sweep is what the ensemble of these options has.
  static void expect_entry(const nlohmann::json& entry, const std::string& options) {
    const std::string kernel = options.find("--kernel") == std::string::npos ? kSweepKernel : "";
    ASSERT_EQ(run_line(kSweepPair + kernel + options + " --no-picture -o single").exit_code, 0);
    const nlohmann::json record = read_json("single/ensemble.json");
    EXPECT_EQ(entry["crossing"], record["crossing"]) << options;
    EXPECT_EQ(entry["paths"], record["paths"]) << options;
  }

  /// Runs the command and kills it as soon as `folder` holds so many ensembles.
  static void kill_after(const std::string& line, const std::string& folder, std::size_t ensembles) {
    const pid_t child = sampling(line);
    while (count_ensembles(folder) < ensembles && is_running(child))
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ::kill(child, SIGKILL);
    EXPECT_EQ(finished(child).exit_code, -SIGKILL);
    EXPECT_GE(count_ensembles(folder), ensembles);
  }

 private:
  static std::size_t count_ensembles(const std::string& folder) {
    const std::vector<std::string> names = names_in(folder);
    return static_cast<std::size_t>(std::count_if(names.begin(), names.end(), [](const std::string& name) {
      return !name.starts_with('.') && name.ends_with(".ensemble");
    }));
  }
};

TEST_F(Sweeps, HaveTheEnsembleOfEachValue) {
  const ProgramRun done = run_line(kSweepPair + kSweepKernel +
                                   "--noise ch-sd:on=2 --sweep beta=3,0,1.5 --antithetic --json all.json -o out");
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(names_in("out"),
              testing::ElementsAre("report.html", "sweep.csv", "sweep.json", "sweep.png", "sweep.svg"));
  const nlohmann::json record = read_json("out/sweep.json");
  EXPECT_EQ(record["parameter"], "beta");
  ASSERT_EQ(record["sweep"].size(), 3U);
  EXPECT_EQ(record["sweep"][0]["crossing"]["probability"], 0);
  EXPECT_TRUE(record["sweep"][0]["crossing"].contains("below_95"));
  EXPECT_EQ(record["sweep"][1]["value"], 1.5);
  expect_entry(record["sweep"][0], "--antithetic --noise none");
  expect_entry(record["sweep"][1], "--antithetic --noise ch-sd:beta=1.5,on=2");
  expect_entry(record["sweep"][2], "--antithetic --noise ch-sd:beta=3,on=2");
  EXPECT_THAT(
      contents("out/sweep.csv"),
      StartsWith("value,probability,standard_error,ever,samples,clean,no_root,momentum_bound,tie\n0,0,NA,0,512,"));
  EXPECT_EQ(contents("all.json"), contents("out/sweep.json"));
}

TEST_F(Sweeps, AreOfAnyNumberOfTheNoiseOrTheKernel) {
  EXPECT_EQ(run_line(kSweepPair + kSweepKernel +
                     "--noise ch-sd:beta=2,on=2 --sweep kernel.alpha=0.5:1.5:0.5 --no-picture -o out")
                .exit_code,
            0);
  const nlohmann::json widths = read_json("out/sweep.json")["sweep"];
  ASSERT_EQ(widths.size(), 3U);
  EXPECT_EQ(widths[2]["kernel"], "gaussian:alpha=1.5");
  expect_entry(widths[2], "--noise ch-sd:beta=2,on=2 --kernel gaussian:alpha=1.5");

  EXPECT_EQ(run_line(kSweepPair + kSweepKernel +
                     "--noise ch-sd:on=2+p-sd:beta=0.5 --sweep ch-sd.beta=0,2 --no-picture -o sum")
                .exit_code,
            0);
  const nlohmann::json sums = read_json("sum/sweep.json")["sweep"];
  expect_entry(sums[0], "--noise p-sd:beta=0.5");
  expect_entry(sums[1], "--noise p-sd:beta=0.5+ch-sd:beta=2,on=2");
}

TEST_F(Sweeps, RefuseWhatTheyHaveNoUseFor) {
  const std::string pair = kSweepPair + kSweepKernel + "--noise ch-sd:on=2 -o out ";
  expect_refused(pair + "--sweep beta", "--sweep is 'beta'; it must be NAME=from:to:step or NAME=a,b,c");
  expect_refused(pair + "--sweep beta=0:1:0", "it must go up");
  expect_refused(pair + "--sweep beta=1,2,1", "has the value 1 twice");
  expect_refused(pair + "--sweep beta=1,-2", "beta is -2; it must be greater than 0");
  expect_refused(kSweepPair + kSweepKernel + "--noise ch-sd:beta=1 -o out --sweep gamma=1,2",
                 "has no number 'gamma'; valid: beta");
  expect_refused(kSweepPair + kSweepKernel + "--noise ch-sd:beta=1+p-sd:beta=1 -o out --sweep beta=1,2",
                 "has more than one number 'beta': ch-sd.beta, p-sd.beta");
  for (const std::string option :
       {"--densities 1", "--records 5", "--save-final f.npy", "--shard 1/2", "--stop-after 64"})
    expect_refused(pair + "--sweep beta=1,2 " + option, "--sweep and " + option.substr(0, option.find(' ')));
  expect_refused("ensemble --q 0/0,1/0 --noise ch-sd:beta=1 --sweep beta=1,2 -o out",
                 "landmarks on a line; there are 2");
}

TEST_F(Sweeps, GoOnAfterBeingKilledToTheSameBits) {
  const std::string line =
      kSweepPair + kSweepKernel + "--noise ch-sd:on=2 --sweep beta=0:5.5:0.5 --threads 1 --no-picture -o ";
  ASSERT_EQ(run_line(line + "whole").exit_code, 0);
  kill_after(line + "out", "out/sweep.partial", 3);
  const ProgramRun refused = run_line(line + "out");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("'out/sweep.partial' belongs to an unfinished run: continue it with --resume"));
  EXPECT_THAT(run_line(line + "out --resume --seed 2").err, HasSubstr("it has seed = 1, here it is seed = 2"));
  EXPECT_EQ(run_line(line + "out --resume").exit_code, 0);
  EXPECT_EQ(names_in("out"), names_in("whole"));
  EXPECT_EQ(contents("out/sweep.json"), contents("whole/sweep.json"));
  EXPECT_EQ(contents("out/sweep.csv"), contents("whole/sweep.csv"));
  EXPECT_THAT(run_line(line + "out --resume").err, HasSubstr("there is nothing left to do"));
}

TEST_F(Sweeps, OfTheThirdFigureGoOnAfterBeingKilledToTheSameBits) {
  const std::string line =
      "reproduce figure3 --kernel gaussian:alpha=1 --beta 0:5:1 --time 20 --dt 0.1 --samples 512 --threads 1 --quick "
      "--no-picture -o ";
  const ProgramRun whole = run_line(line + "whole");
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_THAT(whole.out, HasSubstr("not judged     these are not the paper's values"));
  EXPECT_EQ(count_lines(contents("whole/figure3.csv")), 1 + 4 * 6U);
  for (const std::size_t ensembles : {2, 24}) {  // in the first sweep, and in the grids
    kill_after(line + "out", "out/reproduce.partial", ensembles);
    EXPECT_THAT(run_line(line + "out --seed 7").err,
                HasSubstr("it has seed = 1, here it is seed = 7; repeat that run, remove 'out/reproduce.partial'"));
    const ProgramRun done = run_line(line + "out");
    EXPECT_EQ(done.exit_code, 0);
    EXPECT_THAT(done.err, HasSubstr("note: continuing the run that 'out' has begun"));
    EXPECT_EQ(names_in("out"), names_in("whole"));
    EXPECT_EQ(contents("out/figure3.csv"), contents("whole/figure3.csv"));
  }
}

TEST_F(Sweeps, OfTheThirdFigureAreThoseOfEnsembles) {
  ASSERT_EQ(run_line("reproduce figure3 --kernel peakon:alpha=0.5 --noise p-sd:fields=cos --beta 0.5 --time 2 --dt 0.1 "
                     "--samples 64 --quick --no-picture -o out")
                .exit_code,
            0);
  ASSERT_EQ(
      run_line("ensemble --q 0,10 --p 8,1 --kernel peakon:alpha=0.5 --noise p-sd:fields=cos --sweep beta=0.5 --time 2 "
               "--dt 0.1 --samples 64 --integrator variational-paper --no-picture -o sweep")
          .exit_code,
      0);
  const nlohmann::json entry = read_json("sweep/sweep.json")["sweep"][0];
  EXPECT_THAT(contents("out/figure3.csv"),
              HasSubstr("\npeakon:alpha=0.5,8,0.5,64," + entry["paths"]["clean"].dump() + ","));
  EXPECT_THAT(contents("out/figure3.csv"), HasSubstr(",NA,NA\n"));  // no grid knows this noise
}

TEST_F(Sweeps, OfExperimentsTakeOtherValuesThanThePapers) {
  for (const std::string line :
       {"figure1 --beta 2 --kernel matern32:alpha=1", "figure4 --noise ch-sd-screened:beta=1,gamma=2,on=2",
        "figure2 --noise trouve-vialard:on=2 --beta 0.1,0.2", "section5.4 --beta 0.5 --kernel gaussian:alpha=1"}) {
    const ProgramRun done =
        run_line("reproduce " + line + " --time 2 --dt 0.1 --samples 64 --quick --no-picture -o out");
    EXPECT_EQ(done.exit_code, 0) << line << done.err;
    EXPECT_THAT(done.out, HasSubstr("not judged     these are not the paper's values")) << line;
    EXPECT_THAT(contents("out/report.html"), HasSubstr("so its claims are not judged")) << line;
  }
  EXPECT_THAT(run_line("reproduce figure1 --beta 4 --time 100 --samples 64 --dt 0.1 --quick --no-picture -o same").out,
              HasSubstr("Without noise the faster pulson can never pass"));
}

TEST_F(Sweeps, OfExperimentsRefuseValuesThatHaveNoPlace) {
  expect_refused("reproduce figure1 --beta 1,2 -o out", "--beta has 2 values; 'figure1' takes one");
  expect_refused("reproduce fokker-planck --beta 1 -o out",
                 "--beta is not for 'fokker-planck'; the experiments that take it, one at a time: figure1, figure2");
  expect_refused("reproduce all --noise ch-sd:beta=1 -o out", "--noise is not for 'all'");
  expect_refused("reproduce figure3 --noise none -o out", "has no amplitude");
  expect_refused("reproduce figure3 --noise ch-sd:beta=1+p-sd:beta=1 -o out", "more than one amplitude");
  expect_refused("reproduce figure3 --time 0 -o out", "--time is 0");
}

}  // namespace
}  // namespace pulson
