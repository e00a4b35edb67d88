#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pulson/formats/landmark_files.hpp"
#include "reading_files.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

using CsvWriter = ReadingFiles;

class WritingCsv : public ReadingFiles {
 protected:
  static Landmarks shape_of(const std::string& name, const Points& points) {
    Landmarks shape;
    shape.name = name;
    shape.points = points;
    return shape;
  }

  static LandmarkFile file_of(std::vector<Landmarks> shapes) {
    LandmarkFile file;
    file.shapes = std::move(shapes);
    return file;
  }

  static std::string write_error(std::vector<Landmarks> shapes) {
    return ReadingFiles::write_error("out.csv", file_of(std::move(shapes)));
  }

  static std::string written(std::vector<Landmarks> shapes) {
    write_landmark_file("out.csv", file_of(std::move(shapes)));
    return contents("out.csv");
  }
};

// ---- one shape as text

TEST_F(CsvWriter, WritesTheFewestDigits) {
  Landmarks shape;
  shape.points = points_2d({0.1, -2, 1e300, 1.0 / 3});
  EXPECT_EQ(landmarks_csv(shape), "x,y\n0.1,-2\n1e+300,0.3333333333333333\n");
  shape.points = (Points(1, 2) << 0, 1).finished();
  EXPECT_EQ(landmarks_csv(shape), "x\n0\n1\n");
  shape.points = Eigen::Vector3d(1, 2, 3);
  EXPECT_EQ(landmarks_csv(shape), "x,y,z\n1,2,3\n");
}

TEST_F(CsvWriter, IsReadBackToTheSameBits) {
  Landmarks shape;
  shape.points = 1e-3 * Points::Random(3, 40);
  shape.points(0, 0) = std::numeric_limits<double>::denorm_min();
  shape.points(1, 0) = std::numeric_limits<double>::max();
  for (int i = 0; i < shape.count(); ++i) {
    shape.labels.push_back("tip \"" + std::to_string(i) + "\", left");
    shape.groups.emplace_back(i % 2 == 0 ? "#even" : "odd");
  }
  write_landmarks_csv("out.csv", shape);
  const Landmarks back = read_landmarks("out.csv");
  EXPECT_EQ(back.points, shape.points);
  EXPECT_EQ(back.labels, shape.labels);
  EXPECT_EQ(back.groups, shape.groups);
}

TEST_F(CsvWriter, KeepsMissingCoordinates) {
  Landmarks shape;
  shape.points = points_2d({1, std::numeric_limits<double>::quiet_NaN(), 3, 4});
  write_landmarks_csv("out.csv", shape);
  const Points back = read_landmarks("out.csv").points;
  EXPECT_EQ(back(0, 0), 1);
  EXPECT_TRUE(std::isnan(back(1, 0)));
  EXPECT_EQ(back.col(1), shape.points.col(1));
}

// ---- files

TEST_F(WritingCsv, MakesATableOfOneShape) {
  Landmarks shape = shape_of("out", points_2d({0.1, kNone, 1, -0.0}));
  EXPECT_EQ(written({shape}), "x,y\n0.1,NA\n1,-0\n");
  shape.labels = {"left, \"eye\"", "nose"};
  EXPECT_EQ(written({shape}), landmarks_csv(shape));
  EXPECT_EQ(contents("out.csv"), "label,x,y\n\"left, \"\"eye\"\"\",0.1,NA\nnose,1,-0\n");
}

TEST_F(WritingCsv, MakesALongTableOfSeveral) {
  Landmarks first = shape_of("A", (Points(1, 2) << 1, 2).finished());
  const Landmarks second = shape_of("B", (Points(1, 1) << 3).finished());
  EXPECT_EQ(written({first, second}), "specimen,x\nA,1\nA,2\nB,3\n");
  first.labels = {"tip", "base"};
  first.groups = {"a", "b"};
  EXPECT_EQ(written({first, second}), "specimen,landmark,x,group\nA,tip,1,a\nA,base,2,b\nB,1,3,\n");
  const LandmarkFile back = read_landmark_file("out.csv");
  EXPECT_EQ(back.shapes[0].labels, first.labels);
  EXPECT_EQ(back.shapes[0].groups, first.groups);
  EXPECT_THAT(back.shapes[1].labels, IsEmpty());
  EXPECT_THAT(back.shapes[1].groups, IsEmpty());
}

TEST_F(WritingCsv, IsReadBackToTheSameBits) {
  std::vector<Landmarks> shapes;
  const std::vector<std::string> odd = {"a, b",
                                        "\"quoted\"",
                                        "#sign",
                                        "semi;colon",
                                        "tab\there",
                                        "two  blanks",
                                        "NA",
                                        "1,5",
                                        "é",
                                        "x",
                                        "-1",
                                        "//sign",
                                        " before",
                                        "behind ",
                                        "\t",
                                        "  ",
                                        "007",
                                        "#3",
                                        "id=a",
                                        "=1+1",
                                        "a\nb",
                                        "a\r\nb",
                                        "a\rb",
                                        "\n",
                                        "\"\n#",
                                        "a\n\n# b,\"c\"",
                                        "sep=;",
                                        "specimen",
                                        "\"",
                                        "'",
                                        "\"x\",1,2\n1",
                                        "none"};
  for (const std::string& name : odd) {
    Landmarks& shape = shapes.emplace_back(shape_of(name, 1e-3 * Points::Random(3, std::ssize(odd))));
    shape.points(0, 0) = std::numeric_limits<double>::denorm_min();
    shape.points(1, 0) = -std::numeric_limits<double>::max();
    shape.points.col(2).setConstant(kNone);
    shape.labels = odd;
    shape.groups = odd;
  }
  EXPECT_THAT(write_landmark_file("out.csv", file_of(shapes)), IsEmpty());
  const LandmarkFile back = read_landmark_file("out.csv");
  ASSERT_EQ(back.shapes.size(), shapes.size());
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    EXPECT_EQ(back.shapes[i].name, shapes[i].name);
    EXPECT_EQ(back.shapes[i].labels, shapes[i].labels);
    EXPECT_EQ(back.shapes[i].groups, shapes[i].groups);
    EXPECT_THAT(incomplete_points(back.shapes[i].points), ElementsAre(2));
    EXPECT_EQ(back.shapes[i].points.leftCols(2), shapes[i].points.leftCols(2));
    EXPECT_EQ(back.shapes[i].points.rightCols(29), shapes[i].points.rightCols(29));
  }
}

TEST_F(WritingCsv, TellsWhatATableCannotHold) {
  Landmarks shape = shape_of("fish", Eigen::Vector2d(1, 2));
  shape.image = "fish.jpg";
  shape.scale = 0.5;
  shape.properties = {{"COMMENT", "wet"}};
  shape.curves = {Eigen::Vector2d(1, 2)};
  shape.outlines = shape.curves;
  LandmarkFile file = file_of({shape});
  file.units = "mm";
  file.axes = "LPS";
  EXPECT_THAT(write_landmark_file("out.csv", file),
              ElementsAre("out.csv: csv cannot hold names of shapes", "out.csv: csv cannot hold images",
                          "out.csv: csv cannot hold scales", "out.csv: csv cannot hold properties",
                          "out.csv: csv cannot hold curves", "out.csv: csv cannot hold outlines",
                          "out.csv: csv cannot hold the units 'mm'", "out.csv: csv cannot hold the axes 'LPS'"));
}

TEST_F(WritingCsv, GivesEachShapeANameOfItsOwn) {
  const Points points = Eigen::Vector2d(1, 2);
  const LandmarkFile file = file_of({shape_of("A", points), shape_of("A", points), shape_of("", points),
                                     shape_of("A#2", points), shape_of("none", Points(2, 0))});
  EXPECT_THAT(write_landmark_file("out.csv", file),
              ElementsAre("out.csv: csv cannot hold shapes without landmarks (1 of 5 shapes)",
                          "out.csv: csv cannot hold names that are empty or repeat, which end in #number (2 of 5 "
                          "shapes)"));
  std::vector<std::string> names;
  for (const Landmarks& shape : read_landmark_file("out.csv").shapes) names.push_back(shape.name);
  EXPECT_THAT(names, ElementsAre("A", "A#2#2", "#3", "A#2"));
}

TEST_F(WritingCsv, LeavesLabelsOutThatRepeat) {
  Landmarks shape = shape_of("out", points_2d({1, 2, 3, 4}));
  shape.labels = {"tip", "tip"};
  EXPECT_THAT(write_landmark_file("out.csv", file_of({shape})),
              ElementsAre("out.csv: csv cannot hold labels that repeat"));
  EXPECT_EQ(contents("out.csv"), "x,y\n1,2\n3,4\n");
  shape.groups = {"a", "b"};
  EXPECT_EQ(written({shape}), "label,x,y,group\ntip,1,2,a\ntip,3,4,b\n");
}

TEST_F(WritingCsv, MakesTextOfBytes) {
  Landmarks shape = shape_of("out", Eigen::Vector2d(1, 2));
  shape.labels = {std::string("a\0b", 3)};
  shape.groups = {"gr\xFCn"};
  EXPECT_THAT(write_landmark_file("out.csv", file_of({shape})),
              ElementsAre("out.csv: csv cannot hold texts that are not UTF-8 or hold zero bytes"));
  EXPECT_EQ(contents("out.csv"), "label,x,y,group\n\"a b\",1,2,grün\n");
}

TEST_F(WritingCsv, RefusesWhatNoTableHolds) {
  EXPECT_EQ(write_error({shape_of("A", Points(2, 0))}), "out.csv: there are no landmarks to write");
  EXPECT_EQ(write_error({}), "out.csv: there are no shapes to write");
  EXPECT_EQ(write_error({shape_of("A", Eigen::Vector2d(1, 2)), shape_of("B", Eigen::Vector3d(1, 2, 3))}),
            "out.csv: 'A' is in 2D and 'B' in 3D; the shapes of a table need the same dimension");
  EXPECT_EQ(count_entries(), 0U);
}

}  // namespace
}  // namespace pulson::formats
