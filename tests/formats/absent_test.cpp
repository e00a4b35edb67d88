// Landmarks of structures that a specimen does not have.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "error_of.hpp"
#include "reading_files.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Absent = ReadingFiles;

TEST_F(Absent, IsACode) {
  write("a.csv", "name,x,y\na,1,2\nb,9999,9999\nc,9999,4\nd,NA,NA\n");
  EXPECT_THAT(read_landmark_file("a.csv").warnings, ElementsAre(HasSubstr("1 landmark with 9999 in each coordinate")));
  const Landmarks missing = read_landmarks("a.csv", nullptr, {.missing_codes = {9999}});
  EXPECT_THAT(incomplete_points(missing.points), ElementsAre(1, 3));
  EXPECT_THAT(missing.absent, IsEmpty());
  const Landmarks absent = read_landmarks("a.csv", nullptr, {.absent_codes = {9999}});
  EXPECT_THAT(absent.absent, ElementsAre(1));
  EXPECT_THAT(missing_landmarks(absent), ElementsAre(3));
  const double none = std::nan("");
  EXPECT_THAT(read_landmarks("a.csv", nullptr, {.missing_codes = {9999}, .absent_codes = {none}}).absent,
              ElementsAre(1, 3));
}

TEST_F(Absent, IsAColumn) {
  write("a.csv", "specimen,landmark,x,y,absent\ns,a,1,2,no\ns,b,NA,NA,yes\nt,a,NA,NA,0\nt,b,3,4,\n");
  const LandmarkFile file = read_landmark_file("a.csv");
  EXPECT_THAT(file.warnings, IsEmpty());
  EXPECT_THAT(file.shapes[0].absent, ElementsAre(1));
  EXPECT_THAT(file.shapes[1].absent, IsEmpty());
  EXPECT_THAT(read_landmarks("a.csv#1", nullptr, {.landmarks = "b,a"}).absent, ElementsAre(0));
  write("b.csv", "x,y,absent\n1,2,1\n");
  EXPECT_EQ(error_of([] { read_landmark_file("b.csv"); }),
            "b.csv:2: the landmark is absent, and has coordinates; write NA in place of these");
  write("c.csv", "x,y,absent\n1,2,perhaps\n");
  EXPECT_THAT(error_of([] { read_landmark_file("c.csv"); }), HasSubstr("c.csv:2: the column absent has 'perhaps'"));
}

TEST_F(Absent, IsWritten) {
  write("a.csv", "specimen,landmark,x,y,absent\ns,a,1,2,0\ns,b,NA,NA,1\nt,a,NA,NA,0\nt,b,3,4,0\n");
  const LandmarkFile file = read_landmark_file("a.csv");
  for (const std::string path : {"b.csv", "b.json"}) {
    EXPECT_THAT(write_landmark_file(path, file), IsEmpty());
    const LandmarkFile again = read_landmark_file(path);
    EXPECT_THAT(again.shapes[0].absent, ElementsAre(1)) << path;
    EXPECT_THAT(again.shapes[1].absent, IsEmpty()) << path;
  }
  write_landmarks_csv("c.csv", file.shapes[0]);
  EXPECT_THAT(read_landmarks("c.csv").absent, ElementsAre(1));
  EXPECT_THAT(
      write_landmark_file("b.tps", file),
      testing::Contains(HasSubstr("tps cannot hold which landmarks are absent and not missing (1 of 2 shapes)")));
  write("d.json", R"({"points": [[1, 2], [3, 4]], "absent": [2]})");
  EXPECT_THAT(error_of([] { read_landmark_file("d.json"); }), HasSubstr("is absent, and has coordinates"));
  write("e.json", R"({"points": [[1, 2], [null, null]], "absent": [3]})");
  EXPECT_THAT(error_of([] { read_landmark_file("e.json"); }), HasSubstr("is no landmark; they are 1 to 2"));
}

TEST_F(Absent, IsATable) {
  write("a.csv", "specimen,landmark,x,y\ns,a,NA,NA\ns,b,1,1\ns,c,NA,NA\nt,a,1,2\nt,b,3,4\nt,c,5,6\n");
  write("t.csv", "specimen,code,bone,other\ns,x7,a,\nt,x8,,\n");
  const LandmarkFile file = read_landmark_file("a.csv", {.absent_table = "t.csv:bone,other"});
  EXPECT_THAT(file.shapes[0].absent, ElementsAre(0));
  EXPECT_THAT(file.shapes[1].absent, IsEmpty());
  EXPECT_THAT(error_of([] { read_landmark_file("a.csv", {.absent_table = "t.csv"}); }),
              HasSubstr("t.csv:2: 'x7' in the column 'code' is no landmark of a.csv#1"));
  EXPECT_THAT(error_of([] { read_landmark_file("a.csv", {.absent_table = "t.csv:tail"}); }),
              HasSubstr("there is no column 'tail'"));
  write("u.csv", "name,bones\ns,a 3\nt,\n");
  EXPECT_THAT(read_landmark_file("a.csv", {.absent_table = "u.csv"}).shapes[0].absent, ElementsAre(0, 2));
  write("v.csv", "specimen,bone\ns,a\n");
  EXPECT_EQ(error_of([] { read_landmark_file("a.csv", {.absent_table = "v.csv"}); }),
            "v.csv: no row is of 't' (a.csv#2); each shape needs one, empty where it lacks nothing");
  write("w.csv", "specimen,bone\ns,a\nt,b\n");
  EXPECT_THAT(error_of([] { read_landmark_file("a.csv", {.absent_table = "w.csv"}); }),
              HasSubstr("w.csv:3: landmark 'b' is absent from a.csv#2, which has coordinates of it"));
}

}  // namespace
}  // namespace pulson::formats
