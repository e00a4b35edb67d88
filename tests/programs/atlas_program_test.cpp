// `pulson atlas`.

#include <fstream>

#include <gmock/gmock.h>

#include "program.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class AtlasProgram : public Program {
 protected:
  static std::string leaves() {
    return (std::filesystem::path(PULSON_SOURCE_DIR) / "sample_shapes" / "leaves.tps").string();
  }

  static ProgramRun atlas(const std::string& options, const std::string& cohort = leaves()) {
    return run(joined({"atlas", cohort}, words("-o out " + options)));
  }

  // Of the eight leaves.
  static void write_table() {
    std::ofstream table("leaves.csv");
    table << "specimen,kind,length\n";
    for (int i = 8; i >= 1; --i)
      table << "leaf_" << i << "," << (i % 2 == 0 ? "even" : "odd") << "," << 0.5 * i << "\n";
  }

  static nlohmann::json record() {
    nlohmann::json json = read_json("out/atlas.json");
    json.erase("seconds");
    return json;
  }
};

TEST_F(AtlasProgram, WritesWhatScriptsReadAndPeopleLookAt) {
  const ProgramRun done = atlas("");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, AllOf(HasSubstr("template    of 8 shapes: 19 landmarks in 2D"), HasSubstr("converged"),
                              HasSubstr("modes       "), HasSubstr("wrote      out: atlas.json, template.tps")));
  for (const std::string name :
       {"atlas.json", "template.tps", "momenta.npy", "momenta.csv", "aligned.csv", "specimens.csv", "scores.csv",
        "procrustes_scores.csv", "modes.csv", "report.html", "template.png", "modes.svg", "scores.png", "scree.png"})
    EXPECT_TRUE(std::filesystem::exists("out/" + name)) << name;
  const nlohmann::json json = record();
  EXPECT_EQ(json["template"].size(), 19U);
  EXPECT_EQ(json["specimens"].size(), 8U);
  EXPECT_EQ(json["specimens"][2]["name"], "leaf_3");
  EXPECT_EQ(json["modes"]["scores"].size(), 8U);
  EXPECT_EQ(json["modes"]["eigenvalues"].size(), 7U);
  EXPECT_EQ(json["procrustes"]["mean"].size(), 19U);
  EXPECT_TRUE(json["converged"]);
  EXPECT_EQ(count_lines(contents("out/scores.csv")), 9);
  EXPECT_EQ(count_lines(contents("out/momenta.csv")), 8 * 19 + 1);
  // Momenta have the sum 0; the file is numpy's: a header and 8·19·2 doubles.
  double sum = 0, size = 0;
  std::istringstream rows(contents("out/momenta.csv"));
  std::string row;
  std::getline(rows, row);
  while (std::getline(rows, row)) {
    const double p = std::stod(row.substr(row.rfind(',') + 1));
    sum += p;
    size += std::abs(p);
  }
  EXPECT_NEAR(sum, 0, 1e-6 * size);  // the template moves until the mean is below this
  EXPECT_EQ(contents("out/momenta.npy").size() % 64, 8U * 19 * 2 * 8 % 64);
  EXPECT_THAT(contents("out/report.html"), AllOf(HasSubstr("leaf_8"), HasSubstr("Mode 1")));
  // Two of the leaves have their pictures beside the file.
  EXPECT_THAT(contents("out/report.html"),
              HasSubstr("Mean of the pictures of 2 specimens, each carried to the template"));
}

TEST_F(AtlasProgram, IsTheSameForAnyNumberOfThreads) {
  ASSERT_EQ(atlas("--no-picture -q --threads 1").exit_code, 0);
  const nlohmann::json one = record();
  ASSERT_EQ(atlas("--no-picture -q --threads 2").exit_code, 0);
  EXPECT_EQ(record(), one);
}

TEST_F(AtlasProgram, ReachesEveryShapeExactlyWhereSigmaIsZero) {
  const ProgramRun done = atlas("--no-picture --sigma 0");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_LT(record()["exp_log_error"], 1e-10);
}

TEST_F(AtlasProgram, ACovariateAndGroupsOfATableBelongToSpecimensByName) {
  write_table();
  const ProgramRun done =
      atlas("--no-picture --covariate leaves.csv:length --groups leaves.csv:kind --permutations 99");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out,
              AllOf(HasSubstr("model       length: 8 specimens, 99 permutations"),
                    HasSubstr("model       kind: 8 specimens"), HasSubstr("even – odd: Procrustes distance ")));
  const nlohmann::json json = record();
  EXPECT_EQ(json["specimens"][0]["length"], 0.5);
  EXPECT_EQ(json["specimens"][0]["group"], "odd");
  EXPECT_EQ(json["regression"]["specimens"], 8);
  EXPECT_EQ(json["groups"]["sizes"], (std::vector<int>{4, 4}));
  EXPECT_THAT(contents("out/scores.csv"), HasSubstr("specimen,group,\"length\",PC1"));
  EXPECT_EQ(count_lines(contents("out/regression.csv")), 3 * 19 + 1);
  EXPECT_EQ(count_lines(contents("out/pairs.csv")), 2);
}

TEST_F(AtlasProgram, PredictsWhatIsMissing) {
  std::string text = contents(leaves());
  const std::size_t first = text.find('\n') + 1;
  text.replace(first, text.find('\n', first) - first, "NA NA");
  std::ofstream("missing.tps") << text;
  const ProgramRun done = atlas("--no-picture", "missing.tps");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("predicted   1 missing landmark"));
  EXPECT_EQ(count_lines(contents("out/predicted.csv")), 2);
  EXPECT_THAT(contents("out/complete.csv"), Not(HasSubstr("NA")));
  const nlohmann::json predicted = record()["specimens"][0]["predicted"][0];
  EXPECT_EQ(predicted["landmark"], 1);
  EXPECT_GT(predicted["half_width_90"][0], 0);
}

TEST_F(AtlasProgram, WhatIsWrongIsToldInOneLineAndNothingIsWritten) {
  write_table();
  std::ofstream("short.csv") << "specimen,size\nleaf_1,1\nleaf_2,2\n";
  std::ofstream("words.csv") << "specimen,size\n";
  for (int i = 1; i <= 8; ++i) std::ofstream("words.csv", std::ios::app) << "leaf_" << i << (i < 8 ? ",1\n" : ",big\n");
  for (const auto& [options, message] : std::vector<std::pair<std::string, std::string>>{
           {"--covariate leaves.csv", "--covariate is 'leaves.csv'; it must be FILE.csv:COLUMN"},
           {"--covariate leaves.csv:width", "there is no column 'width'; there are specimen, kind, length"},
           {"--covariate leaves.csv:kind", "is not a number"},
           {"--covariate short.csv:size", "6 of 8 shapes have no row of their own in the column 'specimen': 'leaf_3'"},
           {"--covariate words.csv:size", "is not a number"},
           {"--groups species", "--groups is 'species'; it must be FILE.csv:COLUMN"},
           {"--sigma -1", "--sigma is -1; it must be 0 or greater"},
           {"--align affine", "use similarity"},
           {"--noise p-sd:beta=1", "an atlas takes none or ch-sd:beta=B"},
           {"--at 3", "--at needs --covariate"},
           {"--model length", "--model: there is no column 'length', and --data names no table; there are"},
           {"--model length+width --data leaves.csv",
            "there is no column 'width' in leaves.csv; there are specimen, kind"},
           {"--model kind --groups leaves.csv:kind", "--model has all terms in its formula; leave out --groups"},
           {"--data leaves.csv", "--data needs --model"},
           {"--lambda 0", "--lambda is 0; it must be greater than 0"}}) {
    const ProgramRun failed = atlas("--no-picture " + options);
    EXPECT_EQ(failed.exit_code, 2) << options;
    EXPECT_THAT(failed.err, HasSubstr(message));
    EXPECT_EQ(count_lines(failed.err), 1) << failed.err;
    EXPECT_FALSE(std::filesystem::exists("out/atlas.json"));
  }
  const ProgramRun single = atlas("--no-picture", leaves() + "#1");
  EXPECT_EQ(single.exit_code, 2);
  EXPECT_THAT(single.err, HasSubstr("an atlas needs two or more"));
}

// At scores of 0 the page's polynomial is the template of the record, and its scores are those in standard deviations.
TEST_F(AtlasProgram, ThePageHasTheShapesByTheirScores) {
  ASSERT_EQ(atlas("--pictures svg").exit_code, 0);
  const std::string page = contents("out/report.html");
  const std::size_t figure = page.find("<figure class=\"motion space\"");
  ASSERT_NE(figure, std::string::npos);
  const std::string begin = "<script type=\"application/json\">";
  const std::size_t from = page.find(begin, figure) + begin.size();
  const nlohmann::json space = nlohmann::json::parse(page.substr(from, page.find("</script>", from) - from));
  const nlohmann::json json = record();
  EXPECT_EQ(space["specimens"].size(), 8U);
  EXPECT_TRUE(space["specimens"][0].contains("picture"));
  EXPECT_EQ(space["powers"].size(), 20U);  // of three scores, up to the third degree
  const double unit = space["unit"];
  for (std::size_t a = 0; a < 19; ++a)
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double low = space["low"][axis], place = space["terms"][0][2 * a + axis];
      EXPECT_NEAR(low + unit * place, json["template"][a][axis].get<double>(), 1e-3 * 1e5 * unit);
    }
  for (std::size_t i = 0; i < 8; ++i)
    EXPECT_NEAR(
        space["specimens"][i]["scores"][0].get<double>() * std::sqrt(json["modes"]["eigenvalues"][0].get<double>()),
        json["modes"]["scores"][i][0].get<double>(), 1e-2 * std::abs(json["modes"]["scores"][i][0].get<double>()));
  EXPECT_THAT(page, testing::ContainsRegex("landmarks are within 0?[.0-9]+ % of the diameter"));
}

TEST_F(AtlasProgram, ThePageShowsSpecimensThatLookWrongWithTheirCorrection) {
  std::string text = contents(leaves());
  std::size_t at = text.find("ID=leaf_3");
  at = text.rfind("LM=", at);
  const std::size_t first = text.find('\n', at) + 1, second = text.find('\n', first) + 1;
  const std::size_t eighth = [&] {
    std::size_t line = second;
    for (int k = 0; k < 6; ++k) line = text.find('\n', line) + 1;
    return line;
  }();
  const std::string one = text.substr(first, second - first),
                    other = text.substr(eighth, text.find('\n', eighth) + 1 - eighth);
  text.replace(eighth, other.size(), one);
  text.replace(first, one.size(), other);
  std::ofstream("wrong.tps") << text;
  const ProgramRun done = atlas("--pictures svg", "wrong.tps");
  EXPECT_THAT(done.err, HasSubstr("specimen 'leaf_3'"));
  const std::string page = contents("out/report.html");
  EXPECT_THAT(page, AllOf(HasSubstr("<h2>leaf_3</h2>"), HasSubstr("look exchanged")));
}

}  // namespace
}  // namespace pulson
