// Files that are none of landmarks, copies that went through a spreadsheet, and landmarks that were not digitised.

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "binary_files.hpp"
#include "core/file_kinds.hpp"
#include "reading_files.hpp"
#include "written_landmarks.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using OtherKinds = ReadingFiles;
using SpreadsheetFcsv = ReadingFiles;
using MixedMarkups = ReadingFiles;
using Undigitised = ReadingFiles;

TEST_F(OtherKinds, AreNamedWithTheWayOut) {
  const std::string nifti = std::string("\x5C\1\0\0", 4) + std::string(400, '\0');
  const std::vector<std::array<std::string, 4>> kinds = {
      {"a.xlsx", zip_bytes({{"[Content_Types].xml", "<x/>"}, {"xl/worksheets/sheet1.xml", "<x/>"}}),
       "an Excel workbook", "save the sheet as csv"},
      {"a.docx", zip_bytes({{"word/document.xml", "<x/>"}}), "a Word document", "csv"},
      {"a.ods", zip_bytes({{"mimetype", "application/vnd.oasis.opendocument.spreadsheet"}}, false),
       "an OpenDocument spreadsheet", "save the sheet as csv"},
      {"a.zip", zip_bytes({{"a.tps", "LM=0"}}), "a zip archive", "unpack it"},
      {"a.xls", std::string("\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1\0", 9), "Office 97", "csv"},
      {"a.rds", gzipped(std::string("X\n\0\0\0\3rest", 10)), "R data, compressed by gzip", "write.csv"},
      {"a.RData", gzipped("RDX3\nX\nrest"), "R data", "write.csv"},
      {"a.xz",
       "\xFD"
       "7zXZ" +
           std::string(9, '\0'),
       "xz", "write.csv"},
      {"a.mat", "MATLAB 5.0 MAT-file, Platform: GLNXA64" + std::string(9, '\0'), "a MATLAB file", "writematrix"},
      {"a.h5", std::string("\x89HDF\r\n\x1A\n\0", 9), "an HDF5 file", "numpy.save"},
      {"a.nii", nifti, "a volume (NIfTI)", "3D Slicer"},
      {"a.nii.gz", gzipped(nifti), "a volume (NIfTI), compressed by gzip", "3D Slicer"},
      {"a.csv.gz", gzipped("x,y\n1,2\n"), "compressed by gzip", "gunzip"},
      {"a.pdf", "%PDF-1.4\n%\xE2\xE3\n", "a PDF document", "csv"},
      {"a.webp", std::string("RIFF\1\0\0\0WEBPVP8 ", 16), "an image (webp)", "landmarks are needed"},
      {"a.jp2", std::string("\0\0\0\x0CjP  \r\n\x87\n", 12), "an image (JPEG 2000)", "landmarks are needed"},
      {"a.heic",
       std::string("\0\0\0\x18"
                   "ftypheic\0\0",
                   14),
       "an image (heic)", "landmarks are needed"},
      {"a.png", std::string("\x89PNG\r\n\x1A\n\0", 9), "an image (png)", "docs/photographs.md"},
      {"a.jpg", std::string("\xFF\xD8\xFF\xE0\0", 5), "an image (jpg)", "docs/photographs.md"},
      {"a.tif", std::string("II*\0\0", 5), "an image (tif)", "docs/photographs.md"},
  };
  for (const auto& [name, bytes, kind, remedy] : kinds) {
    const std::string message = read_error(name, bytes);
    EXPECT_THAT(message, HasSubstr(name + " is ")) << name;
    EXPECT_THAT(message, HasSubstr(kind)) << name;
    EXPECT_THAT(message, HasSubstr(remedy)) << name;
    EXPECT_EQ(error_of([&, file = name] { read_landmark_file(file, {.format = "csv"}); }), message);
  }
  EXPECT_FALSE(kind_of_bytes("BM,x,y\n1,2,3\n")) << "text";
}

// ---- fcsv

TEST_F(SpreadsheetFcsv, IsReadAsItWasWritten) {
  const std::string head = "# Markups fiducial file version = 4.10",
                    columns = "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID";
  for (const std::string& text :
       {head + ",,,\n# CoordinateSystem = 0,,,\n\"# columns = " + columns + "\",,,\n1,1.5,2,-3,0,0,0,1,1,1,0,A,,\n",
        head + ";;;\n# CoordinateSystem = 0;;;\n# columns = id;x;y;z;ow;ox;oy;oz;vis;sel;lock;label;desc;x2;\n"
               "1;1,5;2;-3;0;0;0;1;1;1;0;A;;\n",
        head + ";;;\n# CoordinateSystem = 0;;;\n# columns = " + columns + ";;;\n1;1,5;2,0;-3;0;0;0;1;1;1;0;A;;\n",
        head + "\n# CoordinateSystem = 0\n# columns = " + columns + "\n1,\"1,5\",\"2,0\",-3,0,0,0,1,1,1,0,A,,\n",
        head + "\t\t\n# CoordinateSystem = 0\t\n# columns = " + columns +
            "\t\n1\t1.5\t2\t-3\t0\t0\t0\t1\t1\t1\t0\tA\t\t\n"}) {
    const LandmarkFile file = read("a.fcsv", text);
    EXPECT_EQ(file.shapes.at(0).points, Eigen::Vector3d(1.5, 2, -3)) << text;
    EXPECT_THAT(file.shapes.at(0).labels, ElementsAre("A")) << text;
    EXPECT_EQ(file.axes, "RAS") << text;
  }
}

TEST_F(SpreadsheetFcsv, WithDatesIsRefused) {
  for (const std::string date : {"01. Mai", "May-01", "1/5/2019", "01.05.2019"})
    EXPECT_THAT(
        read_error("a.fcsv", "# Markups fiducial file version = 4.10\n1," + date + ",2,3,0,0,0,1,1,1,0,A,,\n"),
        HasSubstr("a.fcsv:2: landmark 1: x is '" + date + "', as a spreadsheet writes a number that it took for a"))
        << date;
  EXPECT_THAT(read_error("a.fcsv", "# Markups fiducial file version = 4.10\n1,two,2,3,0,0,0,1,1,1,0,A,,\n"),
              HasSubstr("x is 'two'; a number is needed"));
}

TEST_F(SpreadsheetFcsv, OfSlicer5SaysWhichPositionsAreMissing) {
  const std::string row = ",0,0,0,1,1,1,0,";
  const LandmarkFile file =
      read("a.fcsv",
           "# Markups fiducial file version = 5.6\n# CoordinateSystem = LPS\n"
           "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
           "1,1,2,3" +
               row + "a,,,2,0\n2,0,0,0" + row + "b,,,0,0\n3,0,0,0" + row + "c,,,3,0\n4,0,0,0" + row + "d,,,2,0\n");
  EXPECT_TRUE(have_same_bits(file.shapes.at(0).points,
                             (Points(3, 4) << 1, kNone, kNone, 0, 2, kNone, kNone, 0, 3, kNone, kNone, 0).finished()));
}

// ---- markups

TEST_F(MixedMarkups, AreConvertedToTheAxesOfTheFirst) {
  const LandmarkFile file =
      read("a.mrk.json",
           R"({"markups": [{"type": "Curve", "coordinateSystem": "LPS", "controlPoints": [{"position": [1, 2, 3]}]},
{"type": "Line", "coordinateSystem": "RAS", "controlPoints": [{"position": [1, 2, 3]}]}]})");
  EXPECT_EQ(file.axes, "LPS");
  EXPECT_EQ(file.shapes.at(0).points, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(file.shapes.at(1).points, Eigen::Vector3d(-1, -2, 3));
  EXPECT_THAT(file.warnings, ElementsAre("a.mrk.json: markup 2 is in RAS, and converted to LPS as the first is"));
}

// ---- landmarks at zero

TEST_F(Undigitised, LandmarksAreAtZero) {
  write("a.tps", "LM=3\n1 2\n0 0\n0 5\nID=s1\nLM=3\n0 0\n0 0\n0 0\nID=s2\n");
  const LandmarkFile plain = read_landmark_file("a.tps");
  EXPECT_THAT(plain.warnings, ElementsAre(HasSubstr("a.tps: 3 landmarks at 0 in each coordinate, the first of them in "
                                                    "'s2', often those that were not digitised")));
  EXPECT_EQ(plain.shapes[1].points, Points::Zero(2, 3));
  const LandmarkFile read = read_landmark_file("a.tps", {.zero_is_missing = true});
  EXPECT_THAT(read.warnings, IsEmpty());
  EXPECT_TRUE(have_same_bits(read.shapes[0].points, points_2d({1, 2, kNone, kNone, 0, 5})));
  EXPECT_EQ(incomplete_points(read.shapes[1].points).size(), 3U);
  write("b.csv", "x,y\n0,0\n1,0\n");
  EXPECT_THAT(read_landmark_file("b.csv").warnings, IsEmpty()) << "one landmark may be the origin";
  write("d.csv", "x,y\n0,0\n1,-4\n0,0\n");
  EXPECT_THAT(read_landmark_file("d.csv").warnings, IsEmpty()) << "among negative coordinates";
  write("c.csv", "x,y,z\n0,0,0\n1,0,0\n-1,0,5\n");
  const Landmarks both = read_landmarks("c.csv", nullptr, {.negative_is_missing = true, .zero_is_missing = true});
  EXPECT_EQ(incomplete_points(both.points), (std::vector<int>{0, 2}));
}

}  // namespace
}  // namespace pulson::formats
