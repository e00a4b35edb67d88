// Results that are no results: numbers that are not finite, diagnostics that are undefined, data that determine
// nothing. Each is refused in one line, or marked, and nothing is called converged, matched or equal.

#include <cmath>
#include <filesystem>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "program.hpp"

namespace pulson {
namespace {

using testing::AnyOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class Honesty : public Program {
 protected:
  static ProgramRun run_words(const std::string& line) { return run(words(line)); }

  static void expect_refused(const std::string& line, const std::string& message) {
    const auto before = all_files();
    const ProgramRun refused = run_words(line);
    EXPECT_EQ(refused.exit_code, 2) << line << refused.out;
    EXPECT_EQ(count_lines(without_notes(refused.err)), 1U) << line << refused.err;
    EXPECT_THAT(refused.err, HasSubstr(message)) << line;
    EXPECT_THAT(changed_since(before), IsEmpty()) << line;
  }

  // A run with numbers beyond all measure: refused in one line that claims nothing, or finished with finite numbers.
  static void expect_honest(const std::string& line) {
    SCOPED_TRACE(line);
    std::filesystem::remove_all("out");
    const ProgramRun done = run_words(line + " -o out");
    EXPECT_THAT(done.exit_code, AnyOf(0, 2, 3)) << done.err;
    EXPECT_FALSE(std::regex_search(done.out, std::regex("(^|[ =-])(nan|inf)([ ,;)\n]|$)"))) << done.out;
    if (done.exit_code == 2) {
      EXPECT_EQ(count_lines(without_notes(done.err)), 1U) << done.err;
      EXPECT_THAT(done.out, IsEmpty());
    }
    if (done.exit_code == 3) {
      EXPECT_THAT(done.err, HasSubstr("warning: "));
    }
  }

  static std::string without_notes(const std::string& err) {
    std::istringstream lines(err);
    std::string rest;
    for (std::string line; std::getline(lines, line);)
      if (!line.starts_with("note: ")) rest += line + '\n';
    return rest;
  }

  static std::string fish() { return sample("fish_source") + ' ' + sample("fish_target"); }
};

TEST_F(Honesty, ChainsThatHardlyMovedHaveNotConverged) {
  const ProgramRun done = run_words("sample " + fish() +
                                    " --noise ch-sd:beta=2%:fit --kernel auto:alpha=fit --lambda fit --sigma fit "
                                    "--method pcn --chains 1 --draws 6 --warmup 0 --steps 6 "
                                    "--no-picture -o out");
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_THAT(done.err, HasSubstr("the chains have not converged"));
  EXPECT_THAT(done.err, HasSubstr("undefined"));
  EXPECT_THAT(done.err, HasSubstr("--warmup"));
  EXPECT_THAT(done.out, HasSubstr("ESS at least undefined"));
  EXPECT_THAT(done.out, HasSubstr("log p(y) = undetermined"));
  const nlohmann::json summary = read_json("out/summary.json");
  EXPECT_EQ(summary["converged"], false);
  EXPECT_TRUE(summary["path"].at("ess_min").is_null());
  EXPECT_TRUE(summary["parameters"]["beta"].at("ess_bulk").is_null());
  EXPECT_TRUE(summary["parameters"]["beta"]["mean"].is_number());
  EXPECT_TRUE(summary["log_evidence"].at("value").is_null());
}

TEST_F(Honesty, OneObservedLandmarkIsNoMatch) {
  write("source.csv", "x,y\n0,0\n2,0\n2,1\n0,1\n");
  write("target.csv", "x,y\n5,5\nNA,NA\nNA,NA\nNA,NA\n");
  const std::string pair = "source.csv target.csv -o out --no-picture ";
  expect_refused("register " + pair,
                 "the match is undetermined: alignment similarity has 4 parameters in 2D, no fewer "
                 "than the 2 coordinates of the 1 landmark observed in both shapes; use --align "
                 "none");
  for (const char* kind : {"translation", "rigid"})
    expect_refused("register " + pair + "--align " + kind, "the match is undetermined");
  expect_refused("sample " + pair, "the match is undetermined");
  expect_refused("compare " + pair + "--noise ch-sd:beta=fit --noise none", "noise 'ch-sd' is undetermined");
  expect_refused("compare " + pair + "--noise none --align similarity", "the match is undetermined");
  expect_refused("atlas source.csv target.csv -o out --no-picture", "the match is undetermined");
  const ProgramRun done = run_words("register " + pair + "--align none");
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, Not(HasSubstr("equal")));
}

TEST_F(Honesty, NothingObservedIsNoMatch) {
  write("source.csv", "x,y\n0,0\n2,0\n2,1\nNA,NA\n");
  write("target.csv", "x,y\nNA,NA\nNA,NA\nNA,NA\n5,5\n");
  expect_refused("register source.csv target.csv -o out --no-picture", "no landmark can be aligned");
  expect_refused("register source.csv target.csv --align none -o out --no-picture", "nothing is observed");
}

TEST_F(Honesty, ParametersNeedMoreCoordinates) {
  write("source.csv", "x\n0\n1\n");
  write("target.csv", "x\n0.1\n1.3\n");
  const std::string pair = "source.csv target.csv -o out --no-picture ";
  expect_refused("register " + pair + "--kernel gaussian:alpha=1:fit --noise ch-sd:beta=0.1:fit",
                 "the parameters are undetermined: there are 2 parameters, and 2 coordinates to determine them");
  expect_refused("sample " + pair + "--kernel gaussian:alpha=1 --noise ch-sd:beta=0.1:fit --lambda fit",
                 "the parameters are undetermined: there are 2 parameters, and 2 coordinates to determine them");
  expect_refused("compare " + pair + "--kernel gaussian:alpha=1 --noise ch-sd:beta=fit --noise none",
                 "is undetermined: there are 2 parameters, and 2 coordinates");
  const ProgramRun atlas = run_words("atlas source.csv target.csv -o out --no-picture");
  EXPECT_EQ(atlas.exit_code, 0) << atlas.err;
  EXPECT_THAT(atlas.err, HasSubstr("note: so few coordinates (2) determine neither kernel nor sigma"));
}

TEST_F(Honesty, ExtremeTimesAreRefused) {
  expect_refused("register " + fish() + " --time 1e-300 -o out --no-picture", "--time is 1e-300");
  expect_refused("register " + fish() + " --time 1e300 -o out --no-picture", "--time is 1e+300");
}

TEST_F(Honesty, ExtremeNumbersAreNeverResults) {
  for (const char* number : {"1e-300", "1e-150", "1e-80", "1e80", "1e150", "1e300"}) {
    const std::string n = number;
    for (const std::string& option : {"--time " + n, "--sigma " + n, "--lambda " + n, "--kernel gaussian:alpha=" + n,
                                      "--noise ch-sd:beta=" + n, "--kernel matern32:alpha=1,weight=" + n}) {
      expect_honest("register " + fish() + " --steps 4 --max-iterations 5 --no-picture " + option);
    }
    for (const std::string& options :
         {"--time " + n, "--time 1 --kernel gaussian:alpha=" + n, "--time 1 --p " + n + ",0"})
      expect_honest("simulate --q 0,1 --noise ch-sd:beta=0.1 --steps 4 --samples 2 --no-picture " + options);
    expect_honest("ensemble --q 0,1 --noise ch-sd:beta=0.1 --steps 4 --samples 64 --no-picture --time " + n);
  }
}

TEST_F(Honesty, ProbabilitiesOfNoPathAreUndetermined) {
  // Every path breaks this bound.
  const ProgramRun none = run_words(
      "ensemble --q 0,3 --p 4,1 --kernel gaussian:alpha=1 --noise ch-sd:beta=1 --time 1 --samples 64 --bound 1e-3 "
      "--no-picture -o none");
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_THAT(none.err, HasSubstr("64 of 64 paths are not clean; no probability and no mean is determined"));
  EXPECT_THAT(none.out, Not(HasSubstr("conserved")));
  EXPECT_TRUE(read_json("none/ensemble.json").at("crossing").is_null());
  // None crosses in so short a time.
  const ProgramRun rare = run_words(
      "ensemble --q 0,3 --p 1,1 --kernel gaussian:alpha=1 --noise ch-sd:beta=0.01 --time 0.1 --samples 64 --no-picture "
      "-o rare");
  EXPECT_EQ(rare.exit_code, 0) << rare.err;
  EXPECT_THAT(rare.out, HasSubstr("crossing   0 (below 0.046 with 95 % confidence)"));
  const nlohmann::json crossing = read_json("rare/ensemble.json").at("crossing");
  EXPECT_TRUE(crossing.at("standard_error").is_null());
  EXPECT_NEAR(crossing.at("below_95").get<double>(), 1 - std::pow(0.05, 1.0 / 64), 1e-12);
}

}  // namespace
}  // namespace pulson
