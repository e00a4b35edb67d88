// Options of `pulson register` beyond the plain match, as a user meets them.

#include <cmath>
#include <fstream>

#include <gmock/gmock.h>

#include "program.hpp"

namespace pulson {
namespace {

using testing::AnyOf;
using testing::HasSubstr;
using testing::MatchesRegex;

class RegisterOptions : public Program {
 protected:
  static void write(const std::string& name, const std::string& text) { std::ofstream(name) << text; }

  static ProgramRun register_files(const std::string& options) {
    return run(joined({"register", "a.csv", "b.csv", "-o", "out", "--no-picture"}, words(options)));
  }

  /// The record of a registration that went well.
  static nlohmann::json expect_record(const ProgramRun& done) {
    EXPECT_EQ(done.exit_code, 0) << done.err;
    EXPECT_EQ(done.err, "");
    const nlohmann::json record = read_json("out/registration.json");
    EXPECT_TRUE(record.is_object());
    EXPECT_EQ(record.value("converged", false), true);
    EXPECT_EQ(record.value("matched", false), true);
    return record;
  }

  static void write_triangles() {
    write("a.csv", "0,0\n1,0\n0.3,0.8\n");
    write("b.csv", "0.1,0\n1.1,0.1\n0.3,1\n");
  }
};

TEST_F(RegisterOptions, HomotopySaysHowFarFromDiffeomorphicAPairIs) {
  write_triangles();
  const std::string options = "--homotopy --kernel gaussian:alpha=1 --lambda 1 --sigma 0.01 --align none --noise ";
  const ProgramRun done = register_files(options + "ch-sd:beta=0.5");
  EXPECT_THAT(done.out, HasSubstr("a diffeomorphism matches these shapes"));
  const nlohmann::json homotopy = expect_record(done)["homotopy"];
  EXPECT_EQ(homotopy["steps"].size(), 11U);
  EXPECT_EQ(homotopy["diffeomorphic"], true);
  EXPECT_EQ(homotopy["least_beta"], 0.5 / 1024);
  EXPECT_THAT(contents("out/homotopy.csv"),
              HasSubstr("beta,J,energy,action,data,rms,matched,converged,iterations\n0.5,"));
  const ProgramRun refused = register_files("--homotopy");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("mode deterministic"));
}

TEST_F(RegisterOptions, VarifoldTakesOutlinesOfDifferentNumbersOfPoints) {
  const auto outline = [](int count, double width) {
    std::string rows;
    for (int i = 0; i < count; ++i) {
      const double angle = 6.283185307179586 * i / count;
      rows += std::to_string(width * std::cos(angle)) + "," + std::to_string(std::sin(angle)) + "\n";
    }
    return rows;
  };
  write("a.csv", outline(24, 1));
  write("b.csv", outline(31, 1.2));
  const nlohmann::json record =
      expect_record(register_files("--data varifold --curve-ends closed --sigma 0.02 --kernel gaussian:alpha=0.5"));
  EXPECT_EQ(record["data"]["kind"], "varifold");
  EXPECT_EQ(record["data"]["ends"], "closed");
  EXPECT_GT(record["data"]["width"], 0);
  EXPECT_EQ(record["result"].size(), 24U);
  EXPECT_EQ(record["target"].size(), 31U);
  double widest = 0;
  for (const nlohmann::json& point : record["result"]) widest = std::max(widest, point[0].get<double>());
  EXPECT_NEAR(widest, 1.2, 0.03);
}

TEST_F(RegisterOptions, WeightsNeedARowForEachLandmark) {
  write_triangles();
  for (const std::string rows : {"1\n2\n", "1\n2\n3\n4\n"}) {
    write("weights.csv", rows);
    const ProgramRun done = register_files("--weights weights.csv");
    EXPECT_EQ(done.exit_code, 2);
    EXPECT_THAT(done.err, HasSubstr("weights.csv"));
    EXPECT_THAT(done.err, HasSubstr("3"));
    EXPECT_FALSE(std::filesystem::exists("out"));
  }
  write("weights.csv", "1\n2\n3\n");
  EXPECT_EQ(expect_record(register_files("--weights weights.csv"))["data"]["weights"].size(), 3U);
}

TEST_F(RegisterOptions, UncertaintyAddsDeviationsAndTheEvidence) {
  write_triangles();
  const nlohmann::json record = expect_record(register_files("--kernel gaussian:alpha=1 --uncertainty"));
  ASSERT_TRUE(record.contains("uncertainty"));
  const nlohmann::json& uncertainty = record["uncertainty"];
  for (const char* key : {"momenta", "velocities", "result"}) {
    ASSERT_EQ(uncertainty[key].size(), 3U) << key;
    for (const nlohmann::json& landmark : uncertainty[key])
      for (const nlohmann::json& deviation : landmark) EXPECT_GT(deviation, 0) << key;
  }
  // What is known of an end point is known by the data at least: sigma = 0.01.
  for (const nlohmann::json& landmark : uncertainty["result"])
    for (const nlohmann::json& deviation : landmark) EXPECT_LE(deviation, 0.01);
  EXPECT_TRUE(uncertainty["log_evidence"].is_number());
  EXPECT_FALSE(expect_record(register_files("--kernel gaussian:alpha=1")).contains("uncertainty"));
}

TEST_F(RegisterOptions, FitFindsAParameterOfTheKernel) {
  write_triangles();
  const nlohmann::json record = expect_record(register_files("--kernel gaussian:alpha=1:fit"));
  ASSERT_TRUE(record.contains("fitted"));
  const nlohmann::json& fitted = record["fitted"];
  EXPECT_EQ(fitted["names"], nlohmann::json({"alpha"}));
  const double alpha = fitted["values"][0];
  EXPECT_GE(alpha, 0.01);
  EXPECT_LE(alpha, 100);
  EXPECT_NE(alpha, 1);
  const std::string kernel = record["kernel"];
  EXPECT_NEAR(std::stod(kernel.substr(kernel.find('=') + 1)), alpha, 1e-5 * alpha);
  EXPECT_GE(fitted["evaluations"], 1);
  const ProgramRun unknown = register_files("--noise ch-sd:beta=1,on=fit");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("'on' is not a parameter of these models"));
}

// The larger sigma is, the less these eight landmarks say of the noise.
TEST_F(RegisterOptions, FittedNumbersHaveDeviationsOrIntervals) {
  write("a.csv", "1,0\n0.71,0.49\n0,0.7\n-0.71,0.49\n-1,0\n-0.71,-0.49\n0,-0.7\n0.71,-0.49\n");
  write("b.csv", "1.13,0.08\n0.78,0.46\n0.02,0.74\n-0.85,0.45\n-0.96,0.03\n-0.61,-0.34\n0,-0.72\n0.62,-0.54\n");
  const std::string options = "--noise ch-sd:beta=0.2:fit --kernel gaussian:alpha=1 --lambda 200 --align none --sigma ";
  const auto fitted = [&](const std::string& sigma) {
    const std::string out = register_files(options + sigma).out;
    const std::size_t start = out.find("beta = ", out.find("\nfitted "));
    return out.substr(start, out.find("; log evidence", start) - start);
  };
  EXPECT_THAT(fitted("0.05"), MatchesRegex("beta = 0\\.0[0-9]+ \\(± [0-9]+ %\\)"));
  EXPECT_THAT(fitted("0.065"), MatchesRegex("beta = 0\\.0[0-9]+ \\(0\\.00[0-9]+ to 0\\.[0-9]+\\)"));
  EXPECT_THAT(fitted("0.08"), MatchesRegex("beta = 0\\.00[0-9]+ \\(undetermined\\)"));
}

TEST_F(RegisterOptions, ReflectTurnsTheShapeOver) {
  write("a.csv", "0,0\n1,0\n0.3,0.8\n-0.2,0.5\n");
  write("b.csv", "0,0\n-1,0\n-0.3,0.8\n0.2,0.5\n");
  const nlohmann::json turned = expect_record(register_files("--align rigid --reflect"));
  const auto& linear = turned["alignment"]["linear"];
  const double determinant =
      linear[0][0].get<double>() * linear[1][1].get<double>() - linear[0][1].get<double>() * linear[1][0].get<double>();
  EXPECT_NEAR(determinant, -1, 1e-12);
  EXPECT_LT(turned["initial_rms"], 1e-12);
  const ProgramRun kept = register_files("--align rigid");
  EXPECT_THAT(kept.exit_code, AnyOf(0, 3)) << kept.err;
  EXPECT_GT(read_json("out/registration.json")["initial_rms"], 0.1);
}

}  // namespace
}  // namespace pulson
