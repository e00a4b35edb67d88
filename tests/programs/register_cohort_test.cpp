// `pulson register` of several shapes.

#include <fstream>

#include <gmock/gmock.h>

#include "program.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class RegisterCohort : public Program {
 protected:
  static std::string leaves() {
    return (std::filesystem::path(PULSON_SOURCE_DIR) / "sample_shapes" / "leaves.tps").string();
  }

  static ProgramRun register_shapes(const std::vector<std::string>& shapes, const std::string& options = "") {
    return run(joined(joined({"register"}, shapes), words("-o out " + options)));
  }

  static void write_triangle_pair() { std::ofstream("two.csv") << "x,y\n0,0\n1,1\n"; }

  // Without what differs between runs.
  static nlohmann::json record(const std::string& name) {
    nlohmann::json json = read_json(name);
    json.erase("seconds");
    return json;
  }
};

TEST_F(RegisterCohort, EachRecordIsThatOfItsPair) {
  ASSERT_EQ(register_shapes({leaves() + "#1", leaves() + "#2", leaves() + "#3"}, "-q").exit_code, 0);
  EXPECT_THAT(names_in("out"), ElementsAre("cohort.csv", "cohort.json", "leaf_2", "leaf_3", "report.html"));
  EXPECT_THAT(names_in("out/leaf_2"), ElementsAre("registration.json", "residuals.csv", "trajectory.csv"));
  ASSERT_EQ(run({"register", leaves() + "#1", leaves() + "#3", "-o", "pair", "-q", "--no-picture"}).exit_code, 0);
  EXPECT_EQ(record("out/leaf_3/registration.json"), record("pair/registration.json"));
  const nlohmann::json cohort = read_json("out/cohort.json"), pair = read_json("pair/registration.json");
  EXPECT_EQ(cohort["specimens"][1]["total"], pair["cost"]["total"]);
  EXPECT_EQ(cohort["specimens"][1]["rms"], pair["rms"]);
  // energy = (λ/2) p·Kp
  const double norm = cohort["specimens"][1]["momenta_norm"], energy = pair["cost"]["energy"];
  EXPECT_NEAR(0.5 * pair["lambda"].get<double>() * norm * norm, energy, 1e-3 * energy);
}

TEST_F(RegisterCohort, AFileOfSeveralShapesIsRegisteredToItsMean) {
  const ProgramRun done = register_shapes({leaves()});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, AllOf(HasSubstr("mean of 8 shapes → 8 shapes"), HasSubstr("converged  8 of 8")));
  EXPECT_EQ(count_lines(contents("out/cohort.csv")), 9);
  EXPECT_THAT(contents("out/cohort.csv"),
              HasSubstr("specimen,rms,energy,action,total,converged,centroid_size,momenta_norm,"));
  EXPECT_THAT(contents("out/report.html"), AllOf(HasSubstr("<svg class=\"sketch\""), HasSubstr("leaf_8")));
  const std::string table = contents("out/cohort.csv");
  ASSERT_EQ(register_shapes({leaves()}, "--template mean --threads 1 -q").exit_code, 0);
  EXPECT_EQ(contents("out/cohort.csv"), table);
}

TEST_F(RegisterCohort, ATemplateOfOnesOwn) {
  ASSERT_EQ(register_shapes({leaves()}, "-q --template " + leaves() + "#2").exit_code, 0);
  const nlohmann::json cohort = read_json("out/cohort.json");
  EXPECT_EQ(cohort["specimens"].size(), 8U);
  EXPECT_THAT(cohort["source"].get<std::string>(), HasSubstr("leaves.tps#2"));
  EXPECT_LT(cohort["specimens"][1]["initial_rms"], 1e-9);
}

TEST_F(RegisterCohort, AShapeThatFailsIsReportedAndTheOthersAreKept) {
  write_triangle_pair();
  const ProgramRun done = register_shapes({leaves() + "#1", "two.csv", leaves() + "#2"}, "--flip-y");
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_THAT(done.err, HasSubstr("warning: two: the shapes have different numbers of landmarks"));
  EXPECT_THAT(done.out, HasSubstr("1 of 2, 1 FAILED"));
  EXPECT_THAT(names_in("out"), ElementsAre("cohort.csv", "cohort.json", "leaf_2", "report.html"));
  EXPECT_THAT(contents("out/cohort.csv"), HasSubstr("\"two\",NA,NA,NA,NA,0,"));
  const nlohmann::json cohort = read_json("out/cohort.json");
  EXPECT_EQ(cohort["failed"], 1);
  EXPECT_TRUE(cohort["specimens"][0].contains("error"));
}

TEST_F(RegisterCohort, NothingIsWrittenWhereAllFail) {
  write_triangle_pair();
  const ProgramRun done = register_shapes({leaves() + "#1", "two.csv", "two.csv"}, "-q");
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_THAT(done.err, HasSubstr("all 2 shapes failed"));
  EXPECT_FALSE(std::filesystem::exists("out"));
}

TEST_F(RegisterCohort, NamesOfFoldersAreSafeAndDiffer) {
  std::string text = "specimen,x,y\n";
  for (const std::string name : {"../a b", ".._a_b", "cohort.csv"})
    for (const std::string row : {"0,0", "1,0", "0.1,1"}) text.append(name).append(",").append(row).append("\n");
  std::ofstream("odd.csv") << text;
  ASSERT_EQ(run(words("register odd.csv -q -o out")).exit_code, 0);
  EXPECT_THAT(names_in("out"),
              ElementsAre("_._a_b", "_._a_b_2", "cohort.csv", "cohort.csv_2", "cohort.json", "report.html"));
}

TEST_F(RegisterCohort, OptionsOfOnePairAreRefused) {
  for (const std::string option : {"--homotopy", "--image a.png", "--pixel-size 2", "--origin 0,0"}) {
    const ProgramRun done = register_shapes({leaves()}, option);
    EXPECT_EQ(done.exit_code, 2) << option;
    EXPECT_THAT(done.err, HasSubstr("is for one target"));
  }
}

}  // namespace
}  // namespace pulson
