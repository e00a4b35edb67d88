// Addresses of shapes, and files that cannot be read.

#include "pulson/formats/landmark_files.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "reading_files.hpp"

namespace pulson::formats {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

using Address = ReadingFiles;
using Unreadable = ReadingFiles;

// ---- addresses

constexpr const char* kThreeShapes = "LM=1\n1 2\nID=apis\nLM=1\n3 4\nID=bombus\nLM=0\nID=empty\n";

TEST_F(Address, NamesOneShape) {
  write("set.tps", kThreeShapes);
  EXPECT_EQ(read_landmarks("set.tps#1").points, Eigen::Vector2d(1, 2));
  const Landmarks shape = read_landmarks("set.tps#id=bombus");
  EXPECT_EQ(shape.points, Eigen::Vector2d(3, 4));
  EXPECT_EQ(shape.name, "bombus");
  EXPECT_EQ(shape.source, "set.tps#id=bombus");
}

TEST_F(Address, MayHoldMoreSigns) {
  write("a#1.tps", "LM=1\n1 2\nID=apis#7\nLM=1\n3 4\n");
  write("b#2.csv", "5,6\n");
  EXPECT_EQ(read_landmarks("a#1.tps#id=apis#7").points, Eigen::Vector2d(1, 2));
  EXPECT_EQ(read_landmarks("a#1.tps#2").points, Eigen::Vector2d(3, 4));
  EXPECT_EQ(read_landmarks("b#2.csv").points, Eigen::Vector2d(5, 6));
  EXPECT_EQ(read_landmarks("b#2.csv#1").points, Eigen::Vector2d(5, 6));
}

TEST_F(Address, PassesWarningsOn) {
  write("a.tps", "LM=1\n1 2\nSCALE=1\n");
  std::vector<std::string> warnings = {"before"};
  read_landmarks("a.tps", &warnings);
  EXPECT_THAT(warnings, ElementsAre("before", HasSubstr("SCALE (")));
}

TEST_F(Address, WarnsOfWhatMayMarkMissingLandmarks) {
  const auto warnings = [](const std::string& path) { return read_landmark_file(path).warnings; };
  write("a.tps", "LM=3\n-1 -1\n4 5\n-1.0 -1.0\n");
  EXPECT_THAT(warnings("a.tps"),
              ElementsAre("a.tps: 2 landmarks with -1 in each coordinate, often the mark of a missing "
                          "one, read as a point like any other: `negative_is_missing` distinguishes them"));
  EXPECT_TRUE(read_landmark_file("a.tps", {.negative_is_missing = true}).warnings.empty());
  write("b.csv", "0,5\n-1,-1\n0,1\n");
  EXPECT_THAT(warnings("b.csv"), ElementsAre(HasSubstr("1 landmark with -1")));
  write("c.tps", "LM=3\n-1 -1\n1 -1\n0 1\n");
  EXPECT_TRUE(warnings("c.tps").empty()) << "other coordinates are negative too";
  write("d.tps", "LM=3\n-1 -1\nNA 5\n0 1\n");
  EXPECT_THAT(warnings("d.tps"), ElementsAre(HasSubstr("1 landmark with -1")));
  write("e.csv", "x\n-1\n3\n");
  EXPECT_TRUE(warnings("e.csv").empty()) << "-1 is a usual place on a line";
}

TEST_F(Address, ThatNamesNoShapeIsRefused) {
  write("set.tps", kThreeShapes);
  EXPECT_EQ(address_error("set.tps"), "set.tps has 3 shapes; choose one as set.tps#1 or set.tps#id=apis");
  EXPECT_EQ(address_error("set.tps#0"), "set.tps has 3 shapes, counted from 1; there is no #0");
  EXPECT_EQ(address_error("set.tps#7"), "set.tps has 3 shapes, counted from 1; there is no #7");
  EXPECT_THAT(address_error("set.tps#99999999999999999999999"), StartsWith("set.tps has 3 shapes, counted from 1;"));
  EXPECT_EQ(address_error("set.tps#3"), "set.tps#3: this shape has no landmarks");
  EXPECT_EQ(address_error("set.tps#id=bombux"), "set.tps has no shape named 'bombux'; did you mean 'bombus'?");
  EXPECT_EQ(address_error("set.tps#id=Xylocopa"), "set.tps has no shape named 'Xylocopa'; it has apis, bombus, empty");
  for (const std::string selector : {"", "-1", "two", "1x", "name=apis"})
    EXPECT_EQ(
        address_error("set.tps#" + selector),
        "'" + selector + "' follows '#' in the address of a shape in set.tps; a number from 1 or id=NAME is needed");
}

TEST_F(Address, ThatNamesSeveralShapesIsRefused) {
  std::string text;
  for (int i = 0; i < 12; ++i) text += "LM=1\n1 2\nID=same\n";
  write("set.tps", text);
  EXPECT_EQ(
      address_error("set.tps#id=same"),
      "set.tps has 12 shapes named 'same': #1, #2, #3, #4, #5, #6, #7, #8, #9, #10, ... (12 in all); choose one by "
      "its number");
}

// ---- names

TEST_F(Address, NamesShapesByTheFileWithoutItsExtension) {
  const auto name = [](const std::string& file, const std::string& text) {
    write(file, text);
    return read_landmarks(file).name;
  };
  const std::string markups = R"({"markups": [{"controlPoints": [{"position": [1, 2, 3]}]}]})";
  EXPECT_EQ(name("skull.mrk.json", markups), "skull");
  EXPECT_EQ(name("Skull.v2.MRK.JSON", markups), "Skull.v2");
  EXPECT_EQ(name("skull.a.json", markups), "skull.a");
  EXPECT_EQ(name("skull.old.dat", markups), "skull.old");
  EXPECT_EQ(name(".json", markups), ".json");
}

// ---- files that cannot be read

TEST_F(Unreadable, IsRefused) {
  EXPECT_EQ(address_error("none.csv"), "cannot read 'none.csv': No such file or directory");
  EXPECT_EQ(address_error("none.csv#2"), "cannot read 'none.csv': No such file or directory");
  fs::create_directory("folder.csv");
  EXPECT_EQ(address_error("folder.csv"), "cannot read 'folder.csv': it is a folder; a file is needed");
  EXPECT_EQ(read_error("empty.csv", ""), "empty.csv is empty");
  EXPECT_EQ(read_error("blank.tps", "\r\n \n"), "blank.tps is empty");
  EXPECT_EQ(read_error("marks.txt", "\xEF\xBB\xBF\xEF\xBB\xBF"), "marks.txt is empty");
  EXPECT_EQ(read_error("utf16.csv", std::string("x\0,\0y\0", 6)),
            "utf16.csv is not a text file (it holds a zero byte); text must be in UTF-8");
  EXPECT_EQ(
      read_error("notes.txt", "Landmark 1 is the tip\n"),
      "notes.txt is not in any of the landmark formats (npy, npz, roi, vtk, fcsv, mrk.json, labelme, menpo, coco, "
      "openpose, via, geojson, dlib, cvat, fiji, meshlab, json, tps, ibug, elastix, transformix, idav, nts, "
      "morphologika, "
      "edma, stereomorph, amira, via.csv, deeplabcut, bigwarp, cmtk, csv); it begins with "
      "'Landmark 1 is the tip'");
}

}  // namespace
}  // namespace pulson::formats
