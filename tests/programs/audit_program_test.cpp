// The verb `audit`: what it lists, writes, mends and refuses.

#include <functional>
#include <random>
#include <sstream>

#include <gmock/gmock.h>

#include "program.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class AuditProgram : public Program {
 protected:
  using Change = std::function<void(Landmarks&)>;

  static formats::LandmarkFile leaves() {
    return formats::read_landmark_file(std::filesystem::path(PULSON_SOURCE_DIR) / "sample_shapes" / "leaves.tps");
  }

  /// The eight leaves, the fifth of them changed.
  static void write_leaves(const std::string& name, const Change& change) {
    formats::LandmarkFile file = leaves();
    change(file.shapes[4]);
    formats::write_landmark_file(name, file);
  }

  static void exchange(Landmarks& shape) { shape.points.col(9).swap(shape.points.col(16)); }
  static void keep(Landmarks&) {}

  static ProgramRun audited(const std::string& line) {
    ProgramRun done = run(words("audit " + line));
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return done;
  }

  static void expect_refused(const std::string& line, const std::string& message) {
    const auto before = all_files();
    const ProgramRun done = run(words("audit " + line));
    EXPECT_EQ(done.exit_code, 2) << line;
    EXPECT_THAT(done.err, HasSubstr(message));
    EXPECT_TRUE(changed_since(before).empty()) << line;
  }
};

TEST_F(AuditProgram, NamesExchangedLandmarksAndMendsThem) {
  write_leaves("leaves.csv", exchange);
  const ProgramRun done = audited("leaves.csv -o out --fix mended.csv");
  EXPECT_THAT(done.out, AllOf(HasSubstr("1 of 8 specimens of 19 landmarks looks wrong"),
                              HasSubstr("one shape in 50 has an error"), HasSubstr("exchanged  10, 17"),
                              HasSubstr("mended     leaf_5: landmarks 10 and 17 exchanged"),
                              HasSubstr("wrote      mended.csv: 8 shapes, csv")));
  const nlohmann::json found = read_json("out/audit.json");
  EXPECT_EQ(found["specimens"], 8);
  EXPECT_EQ(found["landmarks"], 19);
  EXPECT_EQ(found["prior"], 0.02);
  ASSERT_EQ(found["findings"].size(), 1U);
  EXPECT_EQ(found["findings"][0]["specimen"], "leaf_5");
  EXPECT_EQ(found["findings"][0]["kind"], "exchanged");
  EXPECT_EQ(found["findings"][0]["landmarks"], (nlohmann::json{10, 17}));
  EXPECT_GT(found["findings"][0]["odds"], 1e9);
  EXPECT_LT(found["findings"][0]["distance_after"], found["findings"][0]["distance_before"]);
  EXPECT_THAT(contents("out/report.html"), AllOf(HasSubstr("leaf_5"), HasSubstr("data:image/svg+xml")));
  write_leaves("right.csv", keep);
  EXPECT_EQ(contents("mended.csv"), contents("right.csv"));
}

TEST_F(AuditProgram, WritesTheSameTwice) {
  write_leaves("leaves.csv", exchange);
  audited("leaves.csv -o out --no-picture -q");
  EXPECT_THAT(contents("out/report.html"), Not(HasSubstr("data:image/svg+xml")));
  const auto found = nlohmann::ordered_json::parse(contents("out/audit.json"))["findings"][0];
  std::istringstream table(contents("out/audit.csv"));
  std::string header, row;
  std::getline(table, header);
  std::getline(table, row);
  std::string keys, cells;
  for (const auto& [key, value] : found.items()) {
    keys += (keys.empty() ? "" : ",") + key;
    const std::string cell = key == "landmarks" ? "\"10; 17\"" : value.is_boolean() ? "1" : value.dump();
    cells += (cells.empty() ? "" : ",") + cell;
  }
  EXPECT_EQ(header, keys);
  EXPECT_EQ(row, cells);
  const ProgramRun printed = audited("leaves.csv --json -");
  EXPECT_EQ(nlohmann::ordered_json::parse(printed.out)["findings"][0], found);
  for (const char* key : {"specimen", "kind", "landmarks", "log_ratio", "odds", "distance_before", "distance_after"})
    EXPECT_THAT(run({"info", "columns"}).out, HasSubstr("\n    " + std::string(key) + " "));
}

// Nothing is wrong: the copy is that of convert, whose format counts y in the other direction.
TEST_F(AuditProgram, CopiesWhatIsRightAsConvertDoes) {
  write_leaves("leaves.tps", keep);
  for (const std::string name : {"copy.csv", "copy.json", "copy.tps"}) {
    const ProgramRun done = audited("leaves.tps --fix " + name);
    EXPECT_THAT(done.out, AllOf(HasSubstr("nothing looks wrong with 8 specimens of 19 landmarks"),
                                HasSubstr("wrote      " + name + ": 8 shapes")));
    EXPECT_EQ(run({"convert", "leaves.tps", "-o", "as_" + name}).exit_code, 0);
    EXPECT_EQ(contents(name), contents("as_" + name));
  }
}

// A file of labels in another order, in another unit, with y downwards: what is mended comes out as it came in.
TEST_F(AuditProgram, MendsInTheFrameOfEachFile) {
  formats::LandmarkFile file = leaves();
  for (int a = 0; a < 19; ++a)
    for (Landmarks& shape : file.shapes) shape.labels.push_back("L" + std::to_string(a + 1));
  formats::LandmarkFile other{"json", {file.shapes[4]}, {}, "um", {}};
  Landmarks& shape = other.shapes[0];
  shape.points *= 1000;
  shape.units = "um";
  for (int a = 0; a < 9; ++a) {
    shape.points.col(a).swap(shape.points.col(18 - a));
    std::swap(shape.labels[static_cast<std::size_t>(a)], shape.labels[static_cast<std::size_t>(18 - a)]);
  }
  const Points right = shape.points;
  shape.points.col(18 - 9).swap(shape.points.col(18 - 16));
  formats::write_landmark_file("five.json", other);
  file.shapes.erase(file.shapes.begin() + 4);
  file.units = "mm";
  for (Landmarks& of_mm : file.shapes) of_mm.units = "mm";
  formats::write_landmark_file("seven.json", file);
  const ProgramRun done = audited("seven.json five.json --fix mended/");
  EXPECT_THAT(done.out, HasSubstr("landmarks L10 and L17 exchanged"));
  EXPECT_EQ(formats::read_landmarks("mended/five.json").points, right);
  EXPECT_EQ(formats::read_landmarks("mended/five.json").labels, shape.labels);
  EXPECT_EQ(formats::read_landmark_file("mended/seven.json").shapes.size(), 7U);
  expect_refused("seven.json five.json --fix mended.json", "--fix mended.json/ is a folder for them");
  expect_refused("seven.json five.json --fix .", "which is an input");
}

TEST_F(AuditProgram, JudgesTheSecondOfTwoByTheFirst) {
  write_leaves("leaves.tps", exchange);
  EXPECT_THAT(audited("leaves.tps#1 leaves.tps#5 --fix five.tps").out,
              AllOf(HasSubstr("leaf_5 of 19 landmarks looks wrong"), HasSubstr("judged by leaves.tps#1"),
                    HasSubstr("wrote      five.tps: 1 shape, tps")));
  EXPECT_EQ(formats::read_landmarks("five.tps").points, leaves().shapes[4].points);
  const ProgramRun three = audited("leaves.tps#1 leaves.tps#2 leaves.tps#5");
  EXPECT_THAT(three.out, HasSubstr("1 of 2 specimens of 19 landmarks looks wrong"));
  EXPECT_THAT(three.err, HasSubstr("3 shapes are too few for a law of their own"));
}

TEST_F(AuditProgram, ListsWhatItDoesNotJudge) {
  write_leaves("leaves.tps", [](Landmarks& shape) { shape.points.conservativeResize(2, 18); });
  EXPECT_THAT(audited("leaves.tps").out,
              AllOf(HasSubstr("nothing looks wrong with 7 specimens"),
                    HasSubstr("not judged leaf_5 (leaves.tps#5): it has 18 landmarks in 2D, most have 19")));
  EXPECT_EQ(read_json("no.json").is_discarded(), true);
  EXPECT_THAT(audited("leaves.tps --json found.json -q").out, "");
  EXPECT_EQ(read_json("found.json")["not_judged"][0]["specimen"], "leaf_5");
}

TEST_F(AuditProgram, RefusesWhatItCannotJudgeOrMend) {
  write_leaves("leaves.tps", exchange);
  expect_refused("leaves.tps#1", "leaves.tps#1: an audit needs two shapes or more");
  expect_refused("leaves.tps --fix leaves.tps", "--fix would replace 'leaves.tps', which is an input (FILES)");
  expect_refused("leaves.tps --fix mended.xyz", "xyz");
  expect_refused("leaves.tps --fix no/mended.tps", "no/mended.tps");
  expect_refused("leaves.tps --fix one.fcsv", "fcsv holds one shape");
  expect_refused("none.tps", "none.tps");
}

TEST_F(AuditProgram, IsNamedByInfo) {
  write_leaves("leaves.tps", exchange);
  EXPECT_THAT(run(words("info leaves.tps")).out,
              HasSubstr("audit       1 of 8 specimens of 19 landmarks looks wrong; pulson audit leaves.tps\n"));
}

// The leaves twice, each time with known errors.
TEST_F(AuditProgram, MeasuresTheErrorOfRepeats) {
  formats::LandmarkFile file = leaves(), twice = file;
  twice.shapes.clear();
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (const Landmarks& shape : file.shapes)
    for (int session = 0; session < 2; ++session) {
      Landmarks& again = twice.shapes.emplace_back(shape);
      again.points += 0.5 * Points::NullaryExpr(2, shape.count(), [&] { return normal(random); });
    }
  formats::write_landmark_file("twice.tps", twice);
  EXPECT_THAT(audited("twice.tps --repeats names -o out").out, HasSubstr("16 shapes of 8 specimens: sigma 0."));
  const nlohmann::json repeats = read_json("out/audit.json")["repeats"];
  EXPECT_NEAR(repeats["sigma"].get<double>(), 0.5, 0.06);
  EXPECT_GT(repeats["bias"]["p"].get<double>(), 0.01);
  const auto covariances = formats::read_covariances("out/covariances.csv", file.shapes.front());
  EXPECT_NEAR(covariances[3](0, 1), repeats["landmarks"][3]["covariance"][0][1].get<double>(), 1e-12);
  write_leaves("once.csv", keep);
  expect_refused("once.csv --repeats names", "no specimen has more than one shape");
}

}  // namespace
}  // namespace pulson
