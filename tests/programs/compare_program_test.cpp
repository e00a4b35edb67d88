// The verb `compare`: what it writes, and what it refuses.

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "program.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class CompareProgram : public Program {
 protected:
  static ProgramRun compare(const std::string& line) { return run(joined({"compare"}, words(line))); }

  static std::string ellipse() { return sample("ellipse_source") + ' ' + sample("ellipse_target"); }

  // Shapes of five landmarks, one file; they differ by more than a similarity.
  static void write_shapes(int count) {
    std::string text = "specimen,landmark,x,y\n";
    for (int s = 0; s < count; ++s) {
      const std::vector<double> xs = {0, 1 + 0.03 * s, 1.3, 0.5, -0.2 - 0.02 * s * s};
      const std::vector<double> ys = {0, 0.1, 0.9 - 0.05 * s, 1.4 + 0.04 * (s % 2), 0.8};
      for (std::size_t a = 0; a < 5; ++a)
        text += "s" + std::to_string(s) + "," + std::to_string(a + 1) + "," + std::to_string(xs[a]) + "," +
                std::to_string(ys[a]) + "\n";
    }
    write("shapes.csv", text);
  }

  static void expect_refused(const std::string& line, const std::string& message) {
    const auto before = all_files();
    const ProgramRun refused = compare(line);
    EXPECT_EQ(refused.exit_code, 2) << line;
    EXPECT_EQ(refused.out, "") << line;
    EXPECT_EQ(count_lines(refused.err), 1U) << line << '\n' << refused.err;
    EXPECT_THAT(refused.err, HasSubstr(message)) << line;
    EXPECT_THAT(changed_since(before), IsEmpty()) << line;
  }
};

TEST_F(CompareProgram, WritesARecordOfEveryModel) {
  const ProgramRun done = compare(sample("swap_source") + ' ' + sample("swap_target") +
                                  " -o out --sigma 0.05 --noise none --noise ch-sd:beta=1 --lambda 1 --no-picture");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(names_in("out"), ElementsAre("aligned.csv", "comparison.json", "landmarks.csv", "models.csv",
                                           "report.html", "shapes.csv", "source.csv", "specimens.csv", "spectrum.csv"));
  EXPECT_THAT(done.out, AllOf(HasSubstr("one shape, to which no path of none leads, but of ch-sd:beta=1 at cost 0.667"),
                              HasSubstr("wrote      out")));
  const nlohmann::json recorded = read_json("out/comparison.json");
  ASSERT_EQ(recorded["models"].size(), 2U);
  for (const auto& model : recorded["models"])
    for (const char* key :
         {"noise", "mode", "converged", "rms", "energy", "action", "total", "log_evidence", "order_inversions",
          "flipped_triangles", "folded_fraction", "seconds", "score", "weight", "prediction", "integrator", "fitted"})
      EXPECT_TRUE(model.contains(key)) << key;
  EXPECT_EQ(recorded["best"], "ch-sd:beta=1");
  const auto& geodesic = recorded["models"][0];
  const auto& stochastic = recorded["models"][1];
  EXPECT_EQ(geodesic["mode"], "deterministic");
  EXPECT_EQ(stochastic["mode"], "map");
  EXPECT_EQ(geodesic["action"], 0);
  EXPECT_EQ(geodesic["order_inversions"], 0);
  EXPECT_EQ(stochastic["order_inversions"], 1);
  EXPECT_TRUE(stochastic["flipped_triangles"].is_null());
  EXPECT_LT(stochastic["rms"], 0.1);
  EXPECT_GT(geodesic["rms"], 0.3);  // (0, 1) to (1, 0): 0.5 each
  EXPECT_EQ(count_lines(contents("out/shapes.csv")), 3U);
}

// A copy of the record that does not fit is an error, and what was computed is there.
TEST_F(CompareProgram, ResultsOutliveARecordThatDoesNotFitElsewhere) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full";
  const std::string line = sample("swap_source") + ' ' + sample("swap_target") +
                           " -o out --sigma 0.05 --noise none --lambda 1 --no-picture --json /dev/full";
  for (const std::string study : {"", " --simulate none --true-lambda 1 --count 1 --cohort-size 2"}) {
    const ProgramRun done = compare(line + study);
    EXPECT_EQ(done.exit_code, 2) << study;
    EXPECT_THAT(done.err, HasSubstr("/dev/full"));
    EXPECT_FALSE(read_json(study.empty() ? "out/comparison.json" : "out/recovery.json").is_discarded()) << study;
  }
}

TEST_F(CompareProgram, ComparesTheShapesOfAFileWithTheirMean) {
  write_shapes(6);
  const ProgramRun done = compare(
      "shapes.csv -o out --sigma 0.01 --noise none --noise ch-sd:beta=fit --folds 2 --importance 20 --json - --steps 5 "
      "--forward-samples 50");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(names_in("out"),
              ElementsAre("aligned.csv", "checks.csv", "comparison.json", "comparison.png", "comparison.svg",
                          "landmarks.csv", "models.csv", "noise_map.png", "noise_map.svg", "report.html", "shapes.csv",
                          "sigma.csv", "sigma.png", "sigma.svg", "source.csv", "specimens.csv", "spectrum.csv"));
  const nlohmann::json recorded = nlohmann::json::parse(done.out);
  EXPECT_EQ(recorded, read_json("out/comparison.json"));
  EXPECT_EQ(recorded["targets"].size(), 6U);
  EXPECT_EQ(recorded["alignment"], "similarity");
  EXPECT_EQ(recorded["coordinates"], 6 * (10 - 4));
  EXPECT_THAT(recorded["source"].get<std::string>(), HasSubstr("mean of 6 shapes"));
  EXPECT_EQ(recorded["models"][1]["fitted"].size(), 3U);
  EXPECT_TRUE(recorded["models"][1]["prediction"]["energy_score"].is_number());
  EXPECT_EQ(count_lines(contents("out/shapes.csv")), 13U);
}

TEST_F(CompareProgram, TakesTheEndsOfClosedOutlinesAsOne) {
  std::string text = "specimen,landmark,x,y\n";
  for (int s = 0; s < 4; ++s)
    for (int a = 0; a <= 6; ++a) {
      const double angle = 2 * std::acos(-1.0) * (a % 6) / 6;
      const double x = (1 + 0.1 * s) * std::cos(angle), y = std::sin(angle + 0.05 * s * s);
      text += "s" + std::to_string(s) + "," + std::to_string(a + 1) + "," + std::to_string(x) + "," +
              std::to_string(y) + "\n";
    }
  write("closed.csv", text);
  const std::string options = " -o out --sigma 0.01 --noise none --folds 0 --importance 0 --steps 4 --no-picture ";
  const ProgramRun done = compare("closed.csv" + options);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err,
              HasSubstr("landmarks 1 and 7 are at the same position in all shapes and are merged: a closed outline"));
  EXPECT_EQ(read_json("out/comparison.json")["coordinates"], 4 * (12 - 4));

  write("a.csv", "0,0\n1,0\n1,1\n0,1\n0,0\n");
  write("b.csv", "0,0\n1.1,0\n1,1.2\n0,1\n0.1,0\n");
  expect_refused("a.csv b.csv" + options, "--merge-coincident");
  const ProgramRun merged = compare("a.csv b.csv --merge-coincident" + options);
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_EQ(read_json("out/comparison.json")["coordinates"], 8);
}

TEST_F(CompareProgram, SaysWhatItsStepsLackAndWarnsOfFew) {
  write_shapes(6);
  const std::string options = " --noise none --folds 0 --no-maps --no-picture ";
  const ProgramRun done = compare("shapes.csv -o out --sigma 0.01 --steps 4 --noise ch-sd:beta=fit" + options);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, AllOf(HasSubstr("heun in 4 steps"), HasSubstr("steps      log evidences are corrected by ")));
  EXPECT_THAT(done.err, Not(HasSubstr("warning: the steps")));
  const nlohmann::json recorded = read_json("out/comparison.json");
  EXPECT_LT(std::abs(recorded["models"][0]["step_error"].get<double>()), 0.01);
  EXPECT_EQ(recorded["verdict"]["steps"], "");
  EXPECT_THAT(contents("out/models.csv"), HasSubstr(",step_error,step_error_error,difference_step_error,"));
  const std::string leaves = (std::filesystem::path(PULSON_SOURCE_DIR) / "sample_shapes" / "leaves.tps").string();
  const ProgramRun of_few = compare(leaves + " -o far --sigma 0.5 --steps 1" + options);
  EXPECT_THAT(of_few.err, AllOf(HasSubstr("warning: the steps are too long"), HasSubstr("take --steps ")));
  EXPECT_GT(std::abs(read_json("far/comparison.json")["models"][0]["step_error"].get<double>()), 2);
}

TEST_F(CompareProgram, SaysThatShapesDifferInPoseWhereNoneIsRemoved) {
  write("a.csv", "0,0\n1,0\n1,1\n0,1\n0.5,1.4\n");
  write("bent.csv", "0,0\n1.1,0\n1,1.1\n-0.1,1\n0.5,1.2\n");
  write("turned.csv", "5,5\n5,6.1\n3.9,6\n4,4.9\n3.8,5.5\n");  // the same by a right angle, elsewhere
  const std::string options = " -o out --sigma 0.05 --noise none --lambda 1 --steps 4 --no-picture ";
  const auto pose = HasSubstr("are position, orientation and size of the shapes, and count as deformation; --align");
  EXPECT_THAT(compare("a.csv bent.csv" + options).err, Not(pose));
  EXPECT_THAT(compare("a.csv turned.csv" + options).err, pose);
  EXPECT_THAT(compare("a.csv turned.csv --align none" + options).err, Not(pose));
  EXPECT_THAT(compare("a.csv turned.csv --align similarity" + options).err, Not(pose));
  write("fewer.csv", "5,5\n5,6.1\n3.9,6\n4,4.9\n");
  expect_refused("a.csv fewer.csv" + options, "fewer.csv");
}

// A ring that bends smoothly, with less than a hundredth of independent variation: constant ch-sd is like sigma.
TEST_F(CompareProgram, SaysThatConstantNoiseIsHiddenInAFittedSigma) {
  std::string text = "specimen,landmark,x,y\n";
  for (int s = 0; s < 8; ++s)
    for (int k = 0; k < 6; ++k) {
      const double x = std::cos(k * M_PI / 3), y = std::sin(k * M_PI / 3);
      const double wider = 0.12 * std::sin(2.1 * s + 0.3);
      const double u = x * (1 + wider) + 0.1 * std::cos(1.3 * s) * x * y + 0.01 * std::sin(12.9 * k + 78.2 * s);
      const double v =
          y * (1 - wider) + 0.08 * std::sin(3.7 * s + 1) * (x * x - y * y) + 0.01 * std::sin(39.3 * k + 11.1 * s);
      text += fmt::format("s{},{},{:.5f},{:.5f}\n", s, k + 1, u, v);
    }
  write("ring.csv", text);
  const std::string line =
      "ring.csv --noise none --noise ch-sd:beta=fit --kernel gaussian:alpha=1.5 --no-picture --folds 0 --no-maps -o ";
  const ProgramRun fitted = compare(line + "fitted");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  EXPECT_THAT(fitted.out, HasSubstr("no noise is found, but ch-sd has the effect of sigma, which is fitted"));
  EXPECT_THAT(fitted.err, HasSubstr("note: ch-sd: beta has the same effect as sigma"));
  const ProgramRun known = compare(line + "known --sigma 0.01");
  ASSERT_EQ(known.exit_code, 0) << known.err;
  EXPECT_THAT(known.out, AllOf(HasSubstr("the geodesic is enough: noise has at most "),
                               HasSubstr("% of the variance (ch-sd)"), Not(HasSubstr("effect of sigma"))));
  const ProgramRun wider = compare(line + "wider --sigma 0.01 --noise p-sd:beta=fit,fields=grid,count=3");
  EXPECT_THAT(wider.out,
              AllOf(HasSubstr("no noise is found (ch-sd has at most "), HasSubstr("% of the variance (p-sd); about ")));
  const ProgramRun two = compare(line + "two --sigma 0.01 --noise p-sd:beta=fit,fields=grid,count=2" +
                                 " --noise p-sd:beta=fit,fields=grid,count=3");
  EXPECT_THAT(two.out, HasSubstr("% of the variance (p-sd:fields=grid,count=3); about "));
  const ProgramRun alike = compare(line + "alike --noise kunita:beta=fit");
  EXPECT_THAT(alike.out, HasSubstr("ch-sd and kunita have the effect of sigma, which is fitted; a measured sigma"));
}

TEST_F(CompareProgram, CountsHowOftenTheRightModelIsChosen) {
  write_shapes(4);
  const ProgramRun done = compare(
      "shapes.csv -o out --sigma 0.01 --noise none --noise ch-sd:beta=fit --simulate ch-sd:beta=0.1 --count 2 "
      "--cohort-size 3 "
      "--steps 4 --no-picture -q");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.out, "");
  EXPECT_THAT(names_in("out"), ElementsAre("recovery.json", "report.html"));
  const nlohmann::json recorded = read_json("out/recovery.json");
  EXPECT_EQ(recorded["cohorts"], 2);
  EXPECT_EQ(recorded["shapes"], 3);
  ASSERT_EQ(recorded["models"].size(), 1U);
  EXPECT_EQ(recorded["models"][0]["noise"], "ch-sd:beta=0.1");
  const auto& chosen = recorded["models"][0]["chosen"];
  ASSERT_EQ(chosen.size(), 2U);
  EXPECT_EQ(chosen[0].get<int>() + chosen[1].get<int>() + recorded["models"][0]["unfit"].get<int>(), 2);
}

TEST_F(CompareProgram, Refuses) {
  write_shapes(1);
  write("file", "no folder");
  const std::string pair = ellipse() + " -o out --no-picture ";
  expect_refused(pair + "--noise ch-ds", "ch-ds");
  expect_refused(pair + "--sigma 0", "sigma is 0");
  expect_refused(pair + "--sigma=-1", "sigma is -1");
  expect_refused(pair + "--sigma wide", "--sigma");
  expect_refused(pair + "--sigma nan", "sigma");
  expect_refused(pair + "--lambda 0", "lambda");
  expect_refused(pair + "--lambda=-2", "lambda");
  expect_refused(pair + "--count 0", "--count is 0; it must be at least 1");
  expect_refused(pair + "--folds=-1", "--folds is -1; it must be at least 0");
  expect_refused(pair + "--importance=-1", "--importance is -1");
  expect_refused(pair + "--forward-samples 1", "--forward-samples is 1");
  expect_refused(pair + "--cohort-size 0", "--cohort-size is 0");
  expect_refused(pair + "--align round", "unknown alignment 'round'");
  expect_refused(pair + "--kernel gaussina", "gaussina");
  expect_refused(pair + "--simulate ch-ds", "ch-ds");
  expect_refused(pair + "--simulate none --true-lambda 1 --noise none,ch-sd",
                 "'none,ch-sd' lists 2 models; repeat --noise");
  expect_refused(sample("ellipse_source") + ' ' + sample("cs_target") + " -o out --no-picture",
                 "ellipse_source.csv has 40, ");
  expect_refused("shapes.csv -o out --no-picture", "a single shape cannot be compared with its mean");
  expect_refused("missing.csv -o out --no-picture", "missing.csv");
  expect_refused(ellipse() + " --no-picture -o file/out", "file");
}

}  // namespace
}  // namespace pulson
