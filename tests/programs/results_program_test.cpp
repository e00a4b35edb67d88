// Numbers first, pictures after: no picture or page decides over a number, and each record says what belongs to it.

#include <algorithm>
#include <filesystem>
#include <ostream>

#include <gmock/gmock.h>

#include "core/checksum.hpp"
#include "program.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using testing::AnyOf;
using testing::HasSubstr;
using testing::IsEmpty;

/// A short run of a verb that writes into the folder `out`.
struct DrawingRun {
  std::string name;
  std::string line;
  std::string record;
  std::vector<std::string> shown;  ///< pictures and pages
};

void PrintTo(const DrawingRun& run, std::ostream* stream) { *stream << run.name; }

class Results : public Program, public testing::WithParamInterface<DrawingRun> {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("a.csv", "0,0\n1,0\n0,1\n1.2,1\n");
    write("b.csv", "0,0.1\n1.1,0\n0,1\n1.2,1.3\n");
    write("three.tps",
          "LM=4\n0 0\n1 0\n0 1\n1 1\nID=a\nLM=4\n0 0.1\n1 0\n0 1.2\n1 1\nID=b\nLM=4\n0 0\n1.2 0\n0.1 1\n1 1\nID=c\n");
  }

  static nlohmann::json record() { return read_json("out/" + GetParam().record); }
};

TEST_P(Results, AreThereWhereNothingCanBeDrawn) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full";
  const ProgramRun whole = run(words(GetParam().line));
  ASSERT_THAT(whole.exit_code, AnyOf(0, 3)) << whole.err;
  const std::vector<std::string> names = names_in("out");
  fs::remove_all("out");
  fs::create_directory("out");
  for (const std::string& shown : GetParam().shown) {
    ASSERT_NE(std::find(names.begin(), names.end(), shown), names.end()) << shown;
    fs::create_symlink("/dev/full", "out/" + shown);
  }
  const ProgramRun done = run(words(GetParam().line));
  EXPECT_EQ(done.exit_code, whole.exit_code) << done.err;
  EXPECT_THAT(done.err, HasSubstr("No space left on device; the numbers are in 'out'"));
  for (const std::string& shown : GetParam().shown) EXPECT_THAT(done.out, Not(HasSubstr(" " + shown)));
  EXPECT_FALSE(record().is_discarded());
}

TEST_P(Results, AreNamedByTheirRecordWithChecksums) {
  ASSERT_THAT(run(words(GetParam().line + " --no-picture --json copy.json")).exit_code, AnyOf(0, 3));
  EXPECT_EQ(contents("copy.json"), contents("out/" + GetParam().record));
  const nlohmann::json json = record();
  std::vector<std::string> numbers;
  for (const std::string& name : names_in("out"))
    if (name != GetParam().record && name != "report.html" && fs::is_regular_file("out/" + name))
      numbers.push_back(name);
  std::vector<std::string> named;
  if (json.contains("files"))
    for (const auto& [name, sum] : json["files"].items()) {
      named.push_back(name);
      EXPECT_EQ(sum["crc32"], crc32_text(contents("out/" + name))) << name;
      EXPECT_EQ(sum["bytes"], contents("out/" + name).size()) << name;
    }
  std::sort(named.begin(), named.end());
  EXPECT_EQ(named, numbers);
}

// Every picture of the page has a layout for screens as narrow as a phone's.
TEST_P(Results, HaveNarrowLayoutsOnTheirPage) {
  ASSERT_THAT(run(words(GetParam().line)).exit_code, AnyOf(0, 3));
  const std::string page = contents("out/report.html");
  const auto count = [&](const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = page.find(part); at != std::string::npos; at = page.find(part, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("<picture><source media"), count("<div class=\"still"));
  if (GetParam().name != std::string("cohort")) {
    EXPECT_GT(count("<picture><source media"), 0U);
  }
}

// A copy of the record that cannot be written is an error, and not the end of the results.
TEST_P(Results, OutliveARecordThatCannotBeWrittenElsewhere) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full";
  const ProgramRun refused = run(words(GetParam().line + " --json /dev/full -q"));
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_EQ(refused.err.substr(refused.err.rfind("pulson: ")),
            "pulson: cannot write '/dev/full': No space left on device; all other results are in 'out'\n");
  EXPECT_FALSE(record().is_discarded());
}

INSTANTIATE_TEST_SUITE_P(
    Verb, Results,
    testing::Values(
        DrawingRun{"register",
                   "register a.csv b.csv -o out",
                   "registration.json",
                   {"registration.png", "registration.svg", "report.html"}},
        DrawingRun{"cohort", "register three.tps -o out", "cohort.json", {"report.html"}},
        DrawingRun{"atlas",
                   "atlas three.tps -o out --max-iterations 3",
                   "atlas.json",
                   {"modes.png", "report.html", "procrustes_scores.svg", "scree.png", "template.png"}},
        DrawingRun{"simulate",
                   "simulate --q 0,1 --p 1,0 --steps 5 -o out",
                   "simulation.json",
                   {"paths.png", "paths.svg", "report.html"}},
        DrawingRun{"ensemble",
                   "ensemble --q 0,1 --p 1,0 --steps 5 --samples 128 --noise ch-sd:beta=1 -o out",
                   "ensemble.json",
                   {"ensemble.png", "ensemble.svg", "report.html"}},
        DrawingRun{"compare",
                   "compare three.tps -o out --sigma 0.1 --noise none",
                   "comparison.json",
                   {"comparison.png", "comparison.svg", "report.html"}},
        DrawingRun{"study",
                   "compare a.csv b.csv -o out --sigma 0.1 --noise none --simulate all --count 2 --lambda 1",
                   "recovery.json",
                   {"recovery.png", "report.html"}},
        DrawingRun{"sample",
                   "sample a.csv b.csv -o out --noise ch-sd:beta=5% --align none --steps 4 --draws "
                   "20 --warmup 20",
                   "summary.json",
                   {"chains.png", "paths.svg", "report.html"}},
        DrawingRun{"calibration",
                   "sample a.csv b.csv -o out --noise ch-sd:beta=5% --align none --steps 4 --draws "
                   "20 --warmup 20 "
                   "--ranks 7 --calibrate 4",
                   "calibration.json",
                   {"calibration.png", "report.html"}},
        DrawingRun{"fokker_planck",
                   "fokker-planck --q 0,2 --p 1,0.5 --time 0.5 --grids 2 --samples 0 --noise ch-sd:beta=0.5 -o out",
                   "fokker_planck.json",
                   {"fokker_planck.png", "report.html"}}),
    kName);

using ListedFacts = Program;

// Each fact that `info columns` lists of a verb is in its record, under its key.
TEST_F(ListedFacts, AreWritten) {
  write("a.csv", "0\n1\n");
  write("b.csv", "0.1\n1.2\n");
  ASSERT_EQ(run(words("info columns --json columns.json")).exit_code, 0);
  const nlohmann::json listed = read_json("columns.json");
  const auto expect_written = [&](const std::string& line, const std::string& begin, const std::string& record,
                                  const std::string& place) {
    ASSERT_THAT(run(words(line)).exit_code, AnyOf(0, 3)) << line;
    const nlohmann::json written = read_json(record);
    int tables = 0;
    for (const auto& table : listed["columns"]) {
      if (!table["files"].get<std::string>().starts_with(begin)) continue;
      ++tables;
      EXPECT_FALSE(table["columns"].empty());
      for (const auto& column : table["columns"]) {
        std::string key = column["key"];
        std::replace(key.begin(), key.end(), '.', '/');
        EXPECT_TRUE(written.contains(nlohmann::json::json_pointer(place + key))) << record << ": " << key;
        EXPECT_FALSE(column["description"].get<std::string>().empty()) << key;
      }
    }
    EXPECT_GT(tables, 0) << begin;
  };
  const std::string kSample =
      "sample a.csv b.csv -o sample --noise ch-sd:beta=1 --steps 2 --chains 2 --draws 8 --warmup 4 --searches 1 "
      "--no-picture";
  expect_written(kSample, "sample: summary.json", "sample/summary.json", "/");
  expect_written(kSample, "sample: convergence", "sample/summary.json", "/");
  expect_written(kSample, "sample: the model", "sample/summary.json", "/");
  expect_written(kSample, "sample: \"parameters\"", "sample/summary.json", "/momenta/0/");
  expect_written("ensemble --q 0,1 --p 1,0 --noise ch-sd:beta=1 --samples 64 --dt 0.1 -o ensemble --no-picture",
                 "ensemble: ", "ensemble/ensemble.json", "/");
  expect_written("register a.csv b.csv -o pair --no-picture", "register: ", "pair/registration.json", "/");
  const std::string kPair = " --q 0,1 --p 2,1 --noise ch-sd:beta=1,on=2 --time 1 --dt 0.1 --no-picture ";
  expect_written("simulate --samples 2 -o paths" + kPair, "simulate: simulation.json", "paths/simulation.json", "/");
  expect_written("simulate --samples 2 -o others" + kPair, "simulate: \"paths\"", "others/simulation.json",
                 "/paths/1/");
  expect_written("fokker-planck --samples 10 -o crossing" + kPair, "fokker-planck", "crossing/fokker_planck.json", "/");
  write("source.csv", "0,0\n1,0\n0,1\n");
  write("target.csv", "0,0\n1.1,0\n0,1\n");
  ASSERT_EQ(run(words("register source.csv target.csv -o flat --no-picture")).exit_code, 0);
  expect_written("warp flat source.csv -o moved.csv --json moved.json", "warp: --json", "moved.json", "/");
  write("image.pgm", "P2\n2 2\n255\n0 1\n2 3\n");
  expect_written("warp flat image.pgm -o moved.png --pixel-size 1 --json image.json", "warp", "image.json", "/");
}

}  // namespace
}  // namespace pulson
