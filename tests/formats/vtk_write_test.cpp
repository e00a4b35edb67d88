// VTK polydata that we write, by what our reader finds in it and by its text.

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "reading_files.hpp"
#include "written_landmarks.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class VtkWriter : public ReadingFiles {
 protected:
  static Landmarks written(const Landmarks& shape) {
    LandmarkFile file;
    file.shapes = {shape};
    losses_ = write_landmark_file("t.vtk", file);
    return read_landmarks("t.vtk");
  }

  static std::string write_error(const LandmarkFile& file) { return ReadingFiles::write_error("t.vtk", file); }

  static std::vector<std::string> losses_;
};

std::vector<std::string> VtkWriter::losses_;

TEST_F(VtkWriter, KeepsTheBits) {
  for (const int d : {2, 3}) {
    const Points points = hard_points(d, 50);
    EXPECT_TRUE(have_same_bits(written(one_shape(points).shapes[0]).points, points));
    EXPECT_THAT(losses_, IsEmpty());
  }
}

TEST_F(VtkWriter, WritesOldText) {
  LandmarkFile file = one_shape(points_2d({0.5, 1, 2, -0.0, 3, 4, 5, 6}));
  file.shapes[0].name = "a\nb";
  file.shapes[0].groups = {"2", "1", "2", "0"};
  write_landmark_file("t.vtk", file);
  EXPECT_EQ(contents("t.vtk"),
            "# vtk DataFile Version 3.0\na b\nASCII\nDATASET POLYDATA\nPOINTS 4 double\n0.5 1 0\n2 -0 0\n3 4 0\n5 6 0\n"
            "VERTICES 1 2\n1 3\nLINES 2 5\n1 1\n2 0 2\n");
  file.shapes[0].groups.clear();
  write_landmark_file("t.vtk", file);
  EXPECT_THAT(contents("t.vtk"), HasSubstr("5 6 0\nVERTICES 4 8\n1 0\n1 1\n1 2\n1 3\n"));
}

TEST_F(VtkWriter, KeepsAxesInTheTitle) {
  LandmarkFile file = one_shape(hard_points(3, 4));
  for (const std::string name : {"", "fish", "a SPACE=RAS SPACE=LPS"})
    for (const std::string axes : {"LPS", "RAS", ""}) {
      file.shapes[0].name = name;
      file.axes = axes;
      write_landmark_file("t.vtk", file);
      EXPECT_EQ(read_landmark_file("t.vtk").axes, axes) << name;
    }
  file.shapes[0].name = "fish";
  file.axes = "LPS";
  EXPECT_THAT(write_landmark_file("t.vtk", file), ElementsAre("t.vtk: vtk cannot hold names of shapes"));
  EXPECT_THAT(contents("t.vtk"), HasSubstr("\nfish SPACE=LPS\n"));
  file.axes = "up";
  EXPECT_THAT(write_landmark_file("t.vtk", file), testing::Contains("t.vtk: vtk cannot hold the axes 'up'"));
}

TEST_F(VtkWriter, KeepsGroupsWithTheNamesThatReadingGives) {
  Landmarks shape = one_shape(hard_points(2, 6)).shapes[0];
  const std::vector<std::vector<std::string>> kept = {
      {"1", "1", "1", "2", "2", "2"}, {"2", "1", "2", "1", "2", "1"}, {"0", "1", "1", "1", "2", "0"}, {}};
  for (const auto& groups : kept) {
    shape.groups = groups;
    EXPECT_EQ(written(shape).groups, groups);
    EXPECT_THAT(losses_, IsEmpty());
  }
}

TEST_F(VtkWriter, TellsWhereGroupsLoseTheirNames) {
  Landmarks shape = one_shape(hard_points(2, 4)).shapes[0];
  shape.groups = {"left", "left", "right", "right"};
  EXPECT_THAT(written(shape).groups, ElementsAre("1", "1", "2", "2"));
  EXPECT_THAT(losses_, ElementsAre("t.vtk: vtk cannot hold names of groups but 1, 2, ..."));
  shape.groups = {"1", "1", "1", "1"};
  EXPECT_THAT(written(shape).groups, IsEmpty());
  EXPECT_THAT(losses_, ElementsAre("t.vtk: vtk cannot hold a single group"));
}

TEST_F(VtkWriter, TellsWhatItCannotHold) {
  LandmarkFile file = one_shape(Points::Constant(3, 2, 7));
  Landmarks& shape = file.shapes[0];
  shape.labels = {"tip", "fin"};
  shape.name = "fish";
  shape.image = "fish.jpg";
  shape.scale = 2;
  shape.curves = {points_2d({1, 2})};
  file.units = "mm";
  EXPECT_THAT(
      write_landmark_file("t.vtk", file),
      ElementsAre("t.vtk: vtk cannot hold names of shapes", "t.vtk: vtk cannot hold labels",
                  "t.vtk: vtk cannot hold images", "t.vtk: vtk cannot hold scales", "t.vtk: vtk cannot hold curves",
                  "t.vtk: vtk cannot hold the units 'mm'", "t.vtk: all z are 7; the shape is read back in the plane"));
}

TEST_F(VtkWriter, RefusesWhatHasNoPlaceInIt) {
  LandmarkFile file = one_shape(Points::Ones(1, 3));
  EXPECT_EQ(write_error(file), "t.vtk: vtk holds shapes in 2D or 3D; the shape is in 1D");
  file = one_shape(points_2d({1, 2, 3, std::nan("")}));
  file.shapes[0].name = "fish";
  EXPECT_EQ(write_error(file), "t.vtk: vtk cannot hold missing coordinates; landmark 2 of the shape 'fish' misses one");
  file.shapes.emplace_back();
  EXPECT_EQ(write_error(file), "t.vtk: vtk holds one shape; there are 2");
  EXPECT_EQ(count_entries(), 0U);
}

}  // namespace
}  // namespace pulson::formats
