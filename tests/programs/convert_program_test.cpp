// `pulson convert`, and what `pulson info` reports about files.

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "program.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class ConvertProgram : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("pair.json",
          R"({"shapes": [{"name": "ann", "points": [[0, 1], [2, 3], [0, 1]], "image": "a.jpg", "scale": 0.5,
                           "curves": [[[0, 1], [5, 6]]]}, {"name": "bob", "points": [[-1, 1], [2, null]],
                           "outlines": [[[1, 1]]]}], "units": "mm"})");
    write("head.fcsv", "# Markups fiducial file version = 4.11\n# CoordinateSystem = RAS\n1,1,2,3\n2,4,5,6\n");
  }

  static ProgramRun converted(const std::string& line) {
    ProgramRun done = run(words("convert " + line));
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return done;
  }

  static void expect_refused(const std::string& line, const std::string& part) {
    const auto before = all_files();
    const ProgramRun done = run(words(line));
    EXPECT_EQ(done.exit_code, 2) << line;
    EXPECT_EQ(done.out, "") << line;
    EXPECT_EQ(count_lines(done.err), 1U) << done.err;
    EXPECT_THAT(done.err, HasSubstr(part));
    EXPECT_TRUE(changed_since(before).empty()) << line;
  }
};

TEST_F(ConvertProgram, WritesAllShapesOrOne) {
  const ProgramRun all = converted("pair.json copy.json");
  EXPECT_EQ(all.out, "wrote copy.json: 2 shapes, json\n");
  EXPECT_EQ(all.err, "");
  expect_refused("convert copy.json copy.json", "OUT would replace 'copy.json', which is an input (FILES)");
  const formats::LandmarkFile copy = formats::read_landmark_file("copy.json");
  EXPECT_EQ(copy.shapes.at(1).name, "bob");
  EXPECT_EQ(copy.units, "mm");
  for (const std::string address : {"pair.json#1", "pair.json#id=ann"}) {
    const ProgramRun one = converted(address + " ann.vtk");
    EXPECT_EQ(one.out, "wrote ann.vtk: 1 shape, vtk\n");
    EXPECT_THAT(one.err, StartsWith("note: ann.vtk: vtk cannot hold images\n"));
    EXPECT_EQ(formats::read_landmarks("ann.vtk").points, copy.shapes[0].points);
  }
}

TEST_F(ConvertProgram, JoinsFiles) {
  write("tail.fcsv", "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n1,7,8,9\n2,0,1,1\n");
  EXPECT_EQ(converted("head.fcsv tail.fcsv head.fcsv both.json --axes RAS").out, "wrote both.json: 3 shapes, json\n");
  const formats::LandmarkFile both = formats::read_landmark_file("both.json");
  EXPECT_EQ(both.axes, "RAS");
  ASSERT_EQ(both.shapes.size(), 3U);
  EXPECT_EQ(both.shapes[0].name, "head");
  EXPECT_EQ(both.shapes[1].name, "tail");
  EXPECT_EQ(both.shapes[1].points.col(0), Eigen::Vector3d(-7, -8, 9));
  EXPECT_EQ(both.shapes[2].points, both.shapes[0].points);
  converted("pair.json#2 pair.json -o three.tps");
  EXPECT_EQ(formats::read_landmark_file("three.tps").shapes.size(), 3U);
  expect_refused("convert head.fcsv tail.fcsv both.json --axes RAS",
                 "'both.json' exists and may be meant as an input; --out both.json replaces it");
  for (const std::string input : {"pair.json", "pair.json#2"})
    expect_refused("convert " + input + " both.json", "'both.json' exists and may be meant as an input");
  expect_refused("convert both.json#2 both.json", "OUT would replace 'both.json', which is an input (FILES)");
  converted("head.fcsv head.fcsv --out both.json");
  expect_refused("convert head.fcsv", "IN [IN ...] OUT");
  expect_refused("convert head.fcsv tail.fcsv new.json",
                 "tail.fcsv: its axes are LPS, those of the previous files RAS");
  expect_refused("convert head.fcsv tail.fcsv one.fcsv --axes RAS", "fcsv holds one shape");
}

TEST_F(ConvertProgram, TakesTheFormatFromTheOptionOrTheName) {
  EXPECT_EQ(converted("head.fcsv a.mrk.json").out, "wrote a.mrk.json: 1 shape, mrk.json\n");
  EXPECT_EQ(converted("head.fcsv a.dat --to npy").out, "wrote a.dat: 1 shape, npy\n");
  EXPECT_EQ(formats::read_landmark_file("a.dat").format, "npy");
  expect_refused("convert head.fcsv a.dat", "the extension 'dat'");
  expect_refused("convert head.fcsv a.json --to jsn", "'jsn'");
  expect_refused("convert pair.json a.fcsv", "fcsv holds one shape; there are 2");
  expect_refused("convert none.json a.fcsv", "'none.json'");
  expect_refused("convert pair.json#3 a.json", "there is no #3");
  expect_refused("convert pair.json nowhere/a.json", "nowhere");
}

TEST_F(ConvertProgram, TurnsAxes) {
  converted("head.fcsv lps.mrk.json --axes LPS");
  const formats::LandmarkFile turned = formats::read_landmark_file("lps.mrk.json");
  EXPECT_EQ(turned.axes, "LPS");
  EXPECT_EQ(turned.shapes.at(0).points, (Points(3, 2) << -1, -4, -2, -5, 3, 6).finished());
  converted("head.fcsv same.json --axes RAS");
  EXPECT_EQ(formats::read_landmarks("same.json").points, formats::read_landmarks("head.fcsv").points);
  converted("head.fcsv said.json --from-axes LPS --axes RAS");
  EXPECT_EQ(formats::read_landmarks("said.json").points, turned.shapes[0].points);
  expect_refused("convert pair.json a.json --axes RAS", "--from-axes");
  expect_refused("convert head.fcsv a.json --axes XYZ", "--axes is 'XYZ'; it must be LPS or RAS");
}

TEST_F(ConvertProgram, TurnsRowsOfAnImage) {
  converted("pair.json up.json --flip-y 10");
  const Landmarks shape = formats::read_landmarks("up.json#1");
  EXPECT_EQ(shape.points, points_2d({0, 9, 2, 7, 0, 9}));
  EXPECT_EQ(shape.curves.at(0), points_2d({0, 9, 5, 4}));
  write("line.json", "[[1], [2]]");
  expect_refused("convert line.json a.json --flip-y 10", "--flip-y needs y");
  expect_refused("convert pair.json a.json --flip-y inf", "--flip-y is inf");
}

TEST_F(ConvertProgram, TakesNegativesForMissingOnes) {
  converted("pair.json marked.json --missing negative");
  EXPECT_THAT(incomplete_points(formats::read_landmarks("marked.json#2").points), ElementsAre(0, 1));
  expect_refused("convert pair.json a.json --missing none",
                 "--missing is 'none'; it must be negative, zero, a number as 9999, or absent:NUMBER, absent:NA");
}

TEST_F(ConvertProgram, TakesARegistration) {
  const ProgramRun registered =
      run(joined({"register", sample("swap_source"), sample("swap_target")}, words("-o out --no-picture --steps 2")));
  ASSERT_NE(registered.exit_code, 2) << registered.err;
  EXPECT_EQ(converted("out/registration.json#id=target target.npy").out, "wrote target.npy: 1 shape, npy\n");
  EXPECT_EQ(formats::read_landmarks("target.npy").points, formats::read_landmarks(sample("swap_target")).points);
}

TEST_F(ConvertProgram, TellsWhatIsInAFile) {
  const std::string text = run(words("info pair.json")).out;
  EXPECT_EQ(text,
            "pair.json: json with 2 shapes\n"
            "landmarks   2 to 3 in 2D\n"
            "missing     1 in 1 shape\n"
            "coincident  1 in 1 shape\n"
            "repeat end  1 in 1 shape\n"
            "units       mm\n"
            "images      1 in 1 shape\n"
            "scales      1 in 1 shape\n"
            "curves      1 in 1 shape\n"
            "outlines    1 in 1 shape\n"
            "    1  ann                          3 landmarks in 2D, x 0 to 2 y 1 to 3, 1 and 3 coincide, the last "
            "repeats the first, image a.jpg, scale 0.5, 1 curve of 2 points\n"
            "    2  bob                          2 landmarks in 2D, x -1 to -1 y 1 to 1, 1 missing, 1 outline of 1 "
            "point\n");
  EXPECT_THAT(run(words("info pair.json --missing negative")).out, HasSubstr("missing     2 in 1 shape\n"));
  EXPECT_THAT(run(words("info head.fcsv")).out, HasSubstr("landmarks   2 in 3D\nunits       mm\naxes        RAS\n"));
  EXPECT_THAT(run(words("info pair.json#2")).out, StartsWith("pair.json#2: json with 1 shape\n"));
}

TEST_F(ConvertProgram, TellsItAsJson) {
  EXPECT_THAT(run(words("info pair.json --json facts.json")).out, StartsWith("pair.json: json"));
  const std::string printed = run(words("info pair.json --json -")).out;
  EXPECT_EQ(printed, contents("facts.json"));
  const nlohmann::json facts = read_json("facts.json");
  EXPECT_EQ(facts["file"], "pair.json");
  EXPECT_EQ(facts["format"], "json");
  EXPECT_EQ(facts["units"], "mm");
  EXPECT_EQ(facts["axes"], "");
  EXPECT_EQ(facts["warnings"], nlohmann::json::array());
  EXPECT_EQ(facts["shapes"][0], nlohmann::json::parse(R"({"name": "ann", "count": 3, "dimension": 2, "missing": 0,
    "absent": 0,
    "coincident": 1, "repeated_end": true, "image": "a.jpg", "scale": 0.5, "curves": 1, "outlines": 0})"));
  EXPECT_EQ(facts["shapes"][1]["scale"], nullptr);
  expect_refused("info pair.json --json nowhere/x.json", "nowhere");
}

TEST_F(ConvertProgram, ListsTwentyShapesOrAll) {
  std::string shapes;
  for (int i = 0; i < 23; ++i) shapes += std::string(i == 0 ? "" : ", ") + "{\"points\": [[1, 2]]}";
  write("many.json", "{\"shapes\": [" + shapes + "]}");
  const std::string some = run(words("info many.json")).out;
  EXPECT_THAT(some, HasSubstr("   20  many#20"));
  EXPECT_THAT(some, Not(HasSubstr("many#21")));
  EXPECT_THAT(some, HasSubstr("and 3 more; --all lists them\n"));
  EXPECT_THAT(run(words("info many.json --all")).out, HasSubstr("   23  many#23"));
}

}  // namespace
}  // namespace pulson
