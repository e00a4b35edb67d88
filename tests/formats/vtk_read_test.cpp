// VTK legacy polydata: each layout, as text and binary, and files that are cut or lie.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pulson/formats/landmark_files.hpp"
#include "temporary_folder.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

class VtkFile : public InTemporaryFolder {
 protected:
  static LandmarkFile read(const std::string& text) {
    write("t.vtk", text);
    return read_landmark_file("t.vtk");
  }

  static Landmarks read_shape(const std::string& text) { return read(text).shapes.at(0); }

  static std::string read_error(const std::string& text) {
    return error_of([&] { read(text); });
  }
};

std::string vtk_header(const std::string& version, const std::string& encoding = "ASCII") {
  return "# vtk DataFile Version " + version + "\na title\n" + encoding + "\nDATASET POLYDATA\n";
}

// The bytes of numbers as binary files have them.
template <class T>
std::string bytes(const std::vector<T>& numbers) {
  std::string all;
  for (const T number : numbers) {
    std::string one(sizeof(T), '\0');
    std::memcpy(one.data(), &number, sizeof(T));
    if constexpr (std::endian::native == std::endian::little) std::reverse(one.begin(), one.end());
    all += one;
  }
  return all;
}

const std::string kSquare = "POINTS 4 float\n0 0 0 1 0 0\n1 1 0 0 1 0\n";
const std::string kTwoLines = "LINES 2 6\n2 0 1\n2 2 3\n";
const std::string kTwoLinesWithOffsets =
    "LINES 3 4\nOFFSETS vtktypeint64\n0 2 4 \nCONNECTIVITY vtktypeint64\n0 1 2 3 \n";

// ---- what is read

TEST_F(VtkFile, TakesEveryVersion) {
  const Points square = points_2d({0, 0, 1, 0, 1, 1, 0, 1});
  for (const std::string version : {"1.0", "2.0", "3.0", "4.0", "4.1", "4.2", "5.0", "5.1"})
    for (const std::string& lines : {kTwoLines, kTwoLinesWithOffsets}) {
      const LandmarkFile file = read(vtk_header(version) + kSquare + lines);
      ASSERT_EQ(file.shapes.size(), 1U);
      EXPECT_EQ(file.format, "vtk");
      EXPECT_EQ(file.shapes[0].points, square) << version;
      EXPECT_THAT(file.shapes[0].groups, ElementsAre("1", "1", "2", "2"));
      EXPECT_THAT(file.shapes[0].labels, IsEmpty());
      EXPECT_EQ(file.shapes[0].name, "t");
      EXPECT_THAT(file.warnings, IsEmpty());
    }
}

TEST_F(VtkFile, TakesEveryTypeOfBinaryNumber) {
  const std::vector<int> numbers = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 7};
  const Points expected = (Points(3, 4) << 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 7).finished();
  const auto check = [&]<class T>(const std::string& type, T) {
    const std::vector<T> typed(numbers.begin(), numbers.end());
    EXPECT_EQ(read_shape(vtk_header("4.2", "BINARY") + "POINTS 4 " + type + "\n" + bytes(typed) + "\n").points,
              expected)
        << type;
  };
  check("float", float{});
  check("double", double{});
  check("int", std::int32_t{});
  check("vtkidtype", std::int32_t{});
  check("unsigned_int", std::uint32_t{});
  check("long", std::int64_t{});
  check("vtktypeint64", std::int64_t{});
  check("unsigned_long", std::uint64_t{});
  check("short", std::int16_t{});
  check("unsigned_char", std::uint8_t{});
}

TEST_F(VtkFile, TakesBinaryCellsOfBothLayouts) {
  const std::string points = "POINTS 4 double\n" + bytes<double>({0.1, 0, -2, 1, 0, 0, 1, 1, 0, 0, 1, 1e300}) + "\n";
  const std::vector<std::string> lines = {
      "LINES 2 6\n" + bytes<std::int32_t>({2, 0, 1, 2, 2, 3}),
      "LINES 3 4\nOFFSETS vtktypeint64\n" + bytes<std::int64_t>({0, 2, 4}) + "\nCONNECTIVITY vtktypeint64\n" +
          bytes<std::int64_t>({0, 1, 2, 3}) + "\n",
      "LINES 3 4\nOFFSETS int\n" + bytes<std::int32_t>({0, 2, 4}) + "\nCONNECTIVITY int\n" +
          bytes<std::int32_t>({0, 1, 2, 3}) + "\n",
  };
  for (const std::string& section : lines) {
    const Landmarks shape = read_shape(vtk_header("5.1", "BINARY") + points + section + "\nPOINT_DATA 4\nanything");
    EXPECT_EQ(shape.points.col(0), Eigen::Vector3d(0.1, 0, -2));
    EXPECT_EQ(shape.points(2, 3), 1e300);
    EXPECT_THAT(shape.groups, ElementsAre("1", "1", "2", "2"));
  }
  // The bytes of numbers may look like blanks and ends of lines.
  const std::string odd = "POINTS 1 int\n" + bytes<std::int32_t>({0x0A0A0A0A, 0x20202020, 0x0D0A0D0A});
  EXPECT_EQ(
      read_shape(vtk_header("3.0", "BINARY") + odd + "\nLINES 1 3\n" + bytes<std::int32_t>({2, 0, 0}) + "\n").points,
      Eigen::Vector2d(0x0A0A0A0A, 0x20202020));
}

TEST_F(VtkFile, TakesOtherEndsOfLinesAndLetters) {
  std::string text = vtk_header("3.0") + kSquare + kTwoLines;
  std::string lower =
      "# vtk DataFile Version 3.0\n\nascii\ndataset PolyData\npoints 4 Float\n0 0 0 1 0 0 1 1 0 0 1 0\n"
      "lines 2 6 2 0 1 2 2 3\n";
  std::string crlf;
  for (const char c : text) crlf += c == '\n' ? "\r\n" : std::string(1, c);
  const Landmarks expected = read_shape(text);
  for (const std::string& other : {crlf, lower}) {
    EXPECT_EQ(read_shape(other).points, expected.points);
    EXPECT_EQ(read_shape(other).groups, expected.groups);
  }
}

TEST_F(VtkFile, SkipsWhatIsNoGeometry) {
  const std::string metadata = "\nMETADATA\nINFORMATION 1\nNAME UNITS_LABEL LOCATION vtkDataArray\nDATA mm\n\n";
  const std::string field =
      "FIELD FieldData 3\nTIME 1 1 double\n0.5\n" + metadata + "NULL_ARRAY\nwho 1 2 string\nLINES\nme\n";
  const std::string attributes = "POINT_DATA 4\nSCALARS s float\nLOOKUP_TABLE default\n1 2 3 4\nLINES 1 x";
  const Landmarks shape = read_shape(vtk_header("5.1") + field + kSquare + metadata + "VERTICES 1 2\n1 0\n" +
                                     kTwoLinesWithOffsets + metadata + "TRIANGLE_STRIPS 1 5\n4 0 1 2 3\n" + attributes);
  EXPECT_EQ(shape.count(), 4);
  EXPECT_THAT(shape.groups, ElementsAre("1", "1", "2", "2"));
  const std::string binary = "FIELD FieldData 2\nTIME 1 1 double\n" + bytes<double>({0.5}) + "\ncode 2 2 int\n" +
                             bytes<std::int32_t>({1, 2, 3, 0x0A0A0A0A}) + metadata;
  EXPECT_EQ(read_shape(vtk_header("4.2", "BINARY") + binary + "POINTS 1 float\n" + bytes<float>({1, 2, 0}) + metadata +
                       "CELL_DATA 0\n")
                .points,
            Eigen::Vector2d(1, 2));
}

// As VTK writes them: the two highest bits of the first byte give the number of bytes of the length.
std::string binary_string(std::size_t length, int bytes_of_length) {
  const std::string all = bytes<std::uint64_t>({std::uint64_t{length}});
  std::string text = all.substr(static_cast<std::size_t>(8 - bytes_of_length)) + std::string(length, '\n');
  const int mark = bytes_of_length == 1 ? 3 : bytes_of_length == 2 ? 2 : bytes_of_length == 4 ? 1 : 0;
  text[0] = static_cast<char>(static_cast<unsigned char>(text[0]) | mark << 6);
  return text;
}

TEST_F(VtkFile, SkipsBinaryStrings) {
  const std::string start = vtk_header("4.2", "BINARY") + "FIELD FieldData 1\nnames 2 2 string\n";
  const std::string strings =
      binary_string(63, 1) + binary_string(0, 2) + binary_string(16383, 2) + binary_string(70000, 4);
  const std::string points = "\nPOINTS 1 float\n" + bytes<float>({1, 2, 0});
  EXPECT_EQ(read_shape(start + strings + points).points, Eigen::Vector2d(1, 2));
  EXPECT_EQ(read_shape(start + binary_string(5, 8) + strings.substr(0, 64) + binary_string(1, 4) + binary_string(1, 1) +
                       points)
                .points,
            Eigen::Vector2d(1, 2));
  for (std::size_t length = 0; length < strings.size(); length += length < 70 ? 1 : 997)
    EXPECT_THAT(read_error(start + strings.substr(0, length)), StartsWith("t.vtk: byte ")) << length;
  EXPECT_THAT(read_error(start + "\x3F\xFF\xFF\xFF\xFF\xFF\xFF\xFF"),
              EndsWith("a string of 'names' takes 4611686018427387903 bytes; the file has 0 more"));
  EXPECT_THAT(read_error(start + "\xC1"), EndsWith("a string of 'names' takes 1 byte; the file has 0 more"));
  for (const std::string encoding : {"ASCII", "BINARY"})
    EXPECT_THAT(
        read_error(vtk_header("4.2", encoding) + "FIELD f 1\na 18446744073709551615 18446744073709551615 string\n"),
        StartsWith("t.vtk"));
}

TEST_F(VtkFile, HasTheAxesOfItsTitle) {
  const auto axes = [](const std::string& title) {
    return read("# vtk DataFile Version 5.1\n" + title + "\nASCII\nDATASET POLYDATA\n" + kSquare).axes;
  };
  EXPECT_EQ(axes("3D Slicer output. SPACE=RAS"), "RAS");
  EXPECT_EQ(axes("3D Slicer output. SPACE=LPS"), "LPS");
  EXPECT_EQ(axes("SPACE=LPS SPACE=RAS"), "RAS") << "as 3D Slicer takes it";
  EXPECT_EQ(axes("RAS"), "");
  EXPECT_EQ(axes("SPACE=XYZ"), "");
}

TEST_F(VtkFile, MayBeginWithAByteOrderMark) {
  const LandmarkFile file = read("\xEF\xBB\xBF" + vtk_header("3.0") + kSquare);
  EXPECT_EQ(file.format, "vtk");
  EXPECT_EQ(file.shapes[0].count(), 4);
}

TEST_F(VtkFile, IsInThePlaneWhereAllZAreEqual) {
  EXPECT_EQ(read_shape(vtk_header("3.0") + "POINTS 2 float\n1 2 -0.0 3 4 0\n").points, points_2d({1, 2, 3, 4}));
  EXPECT_EQ(read_shape(vtk_header("3.0") + "POINTS 2 float\n1 2 0 3 4 1e-9\n").dimension(), 3);
  const LandmarkFile raised = read(vtk_header("3.0") + "POINTS 2 float\n1 2 5.5 3 4 5.5\n");
  EXPECT_EQ(raised.shapes[0].points, points_2d({1, 2, 3, 4}));
  EXPECT_THAT(raised.warnings, ElementsAre("t.vtk: all z are 5.5; the shape is read in the plane"));
  EXPECT_EQ(read_shape(vtk_header("3.0") + "POINTS 0 float\n").count(), 0);
}

TEST_F(VtkFile, MayMissCoordinates) {
  const Landmarks text = read_shape(vtk_header("3.0") + "POINTS 3 float\n1 2 0 nan nan nan 3 4 0\n");
  EXPECT_EQ(text.dimension(), 2);
  EXPECT_THAT(incomplete_points(text.points), ElementsAre(1));
  const double none = std::numeric_limits<double>::quiet_NaN();
  const Landmarks binary =
      read_shape(vtk_header("3.0", "BINARY") + "POINTS 2 double\n" + bytes<double>({1, none, 2, 3, 4, 5}));
  EXPECT_THAT(incomplete_points(binary.points), ElementsAre(0));
}

// ---- groups

TEST_F(VtkFile, GroupsPiecesOfLinesInTheOrderOfCells) {
  const auto groups = [](const std::string& cells) {
    return read_shape(vtk_header("3.0") + "POINTS 6 float\n0 0 0 1 0 0 2 0 0 3 0 0 4 0 0 5 0 0\n" + cells).groups;
  };
  EXPECT_THAT(groups(""), IsEmpty());
  EXPECT_THAT(groups("VERTICES 1 3\n2 0 1\n"), IsEmpty());
  EXPECT_THAT(groups("LINES 1 7\n6 0 1 2 3 4 5\n"), IsEmpty());
  EXPECT_THAT(groups("LINES 5 15\n2 0 1 2 1 2 2 2 3 2 3 4 2 4 5\n"), IsEmpty()) << "one piece of many segments";
  EXPECT_THAT(groups("LINES 2 8\n3 3 4 5\n3 0 1 2\n"), ElementsAre("2", "2", "2", "1", "1", "1"));
  EXPECT_THAT(groups("LINES 2 6\n2 1 2\n2 4 5\n"), ElementsAre("0", "1", "1", "0", "2", "2"));
  EXPECT_THAT(groups("LINES 1 4\n3 0 1 2\nPOLYGONS 1 4\n3 3 4 5\n"), ElementsAre("1", "1", "1", "2", "2", "2"));
  EXPECT_THAT(groups("POLYGONS 2 8\n3 0 1 2 3 2 1 3\n"), ElementsAre("1", "1", "1", "1", "0", "0"));
}

TEST_F(VtkFile, WarnsWhereLinesHaveAnotherOrder) {
  const auto warnings = [](const std::string& cells) {
    return read(vtk_header("3.0") + "POINTS 5 float\n0 0 0 1 0 0 2 0 0 3 0 0 4 0 0\n" + cells).warnings;
  };
  EXPECT_THAT(warnings("LINES 2 8\n3 0 2 4\n3 3 1 3\n"), IsEmpty()) << "each in its order, one backwards";
  EXPECT_THAT(warnings("LINES 1 7\n6 0 1 2 3 4 0\n"), IsEmpty()) << "closed";
  EXPECT_THAT(warnings("POLYGONS 1 4\n3 0 2 1\n"), IsEmpty());
  EXPECT_THAT(
      warnings("LINES 1 6\n5 0 2 1 3 4\n"),
      ElementsAre("t.vtk: the lines connect the points in a different order from that of the file, which is kept"));
}

// ---- what is refused

TEST_F(VtkFile, RefusesOtherHeaders) {
  EXPECT_EQ(read_error("# vtk DataFile Version 6.0\n\nASCII\n"),
            "t.vtk:1: version '6.0' of the format; 1.0 to 5.1 are read");
  EXPECT_EQ(read_error("# vtk DataFile Version nan\n\nASCII\n"),
            "t.vtk:1: version 'nan' of the format; 1.0 to 5.1 are read");
  EXPECT_EQ(read_error("<?xml version=\"1.0\"?>\n"),
            "t.vtk:1: the file begins with '<?xml version=\"1.0\"?>'; '# vtk DataFile Version' is expected");
  EXPECT_EQ(read_error("# vtk DataFile Version 3.0\ntitle\nASCI\n"),
            "t.vtk:3: 'ASCI' where ASCII or BINARY is expected");
  EXPECT_EQ(read_error("# vtk DataFile Version 3.0"), "t.vtk:1: '' where ASCII or BINARY is expected");
  EXPECT_EQ(read_error("# vtk DataFile Version 3.0\ntitle\nASCII\nPOINTS 1 float\n"),
            "t.vtk:4: a line DATASET POLYDATA is needed here");
  for (const std::string kind : {"STRUCTURED_GRID", "UNSTRUCTURED_GRID", "STRUCTURED_POINTS"})
    EXPECT_EQ(read_error("# vtk DataFile Version 3.0\ntitle\nBINARY\nDATASET " + kind + "\n"),
              "t.vtk:4: the dataset is '" + kind + "'; only POLYDATA is read");
}

TEST_F(VtkFile, RefusesCutText) {
  EXPECT_EQ(read_error(vtk_header("3.0")), "t.vtk has no section POINTS");
  EXPECT_EQ(read_error(vtk_header("3.0") + "POINTS\n"),
            "t.vtk:6: POINTS is followed by ''; a whole number, not negative, is needed");
  EXPECT_EQ(read_error(vtk_header("3.0") + "POINTS 2 float\n1.25 2.5 3.5\n4\n"),
            "t.vtk:5: 'POINTS 2 float' needs 6 numbers; the file ends after 4");
  EXPECT_EQ(read_error(vtk_header("3.0") + "POINTS 2 float\n1 2 3\n4 5\nLINES 1 2\n"),
            "t.vtk:8: landmark 2 of 'POINTS 2 float': z is 'LINES'; a number is needed");
  EXPECT_THAT(read_error(vtk_header("3.0") + "POINTS 1 float\n1 2 3\n4 5 6\n"),
              StartsWith("t.vtk:7: '4' where a section is expected: POINTS, VERTICES,"));
  EXPECT_EQ(read_error(vtk_header("3.0") + kSquare + "LINES 2 6\n2 0 1\n     2\n"),
            "t.vtk:8: 'LINES 2 6' needs 6 numbers; the file ends after 4");
  EXPECT_THAT(read_error(vtk_header("5.1") + kSquare + "LINES 3 4\nOFFSETS vtktypeint64\n0 2 4\n"),
              EndsWith("'' where CONNECTIVITY is expected"));
  EXPECT_EQ(read_error(vtk_header("5.1") + "FIELD FieldData 1\n"), "t.vtk:6: the file ends within FIELD");
}

TEST_F(VtkFile, RefusesCutBinary) {
  const std::string points = vtk_header("3.0", "BINARY") + "POINTS 2 float\n";
  const std::string whole = bytes<float>({1, 2, 3, 4, 5, 6});
  const std::string start = "t.vtk: byte " + std::to_string(vtk_header("3.0", "BINARY").size()) + ": ";
  EXPECT_EQ(read_error(points + whole.substr(0, 23)),
            start + "'POINTS 2 float' needs 2 numbers times 3; the file has 23 bytes more");
  EXPECT_EQ(read_error(points), start + "'POINTS 2 float' needs 2 numbers times 3; the file has 0 bytes more");
  const std::string lines_at = "t.vtk: byte " + std::to_string(points.size() + whole.size() + 1) + ": ";
  EXPECT_EQ(read_error(points + whole + "\nLINES 1 3\n" + bytes<std::int32_t>({2, 0})),
            lines_at + "'LINES 1 3' needs 3 numbers; the file has 8 bytes more");
  const float infinite = std::numeric_limits<float>::infinity();
  EXPECT_EQ(read_error(points + bytes<float>({1, 2, 3, 4, infinite, 6})),
            "t.vtk: byte " + std::to_string(points.size() + 16) +
                ": landmark 2 of 'POINTS 2 float': y is 'inf'; a coordinate must be finite");
  // Each cut of a good file is refused or, after the points, read.
  const std::string good = points + whole + "\nLINES 2 2\nOFFSETS int\n" + bytes<std::int32_t>({0, 2}) +
                           "\nCONNECTIVITY int\n" + bytes<std::int32_t>({0, 1}) + "\n";
  ASSERT_EQ(read_shape(good).count(), 2);
  for (std::size_t length = 30; length + 1 < good.size(); ++length) {
    const bool ends_after_points = length == points.size() + whole.size() || length == points.size() + whole.size() + 1;
    if (ends_after_points)
      EXPECT_EQ(read_shape(good.substr(0, length)).count(), 2);
    else
      EXPECT_THAT(read_error(good.substr(0, length)), StartsWith("t.vtk")) << length;
  }
}

// Counts beyond the data end in an error before memory is taken.
TEST_F(VtkFile, RefusesAbsurdCounts) {
  for (const std::string count : {"800000000", "10000000000", "6148914691236517206", "18446744073709551615"})
    for (const std::string encoding : {"ASCII", "BINARY"}) {
      const std::string start = vtk_header("3.0", encoding);
      EXPECT_THAT(read_error(start + "POINTS " + count + " double\n1 2 3\n"),
                  HasSubstr("needs " + count + " numbers times 3; the file has "));
      const std::string points = start + "POINTS 0 float\n";
      EXPECT_THAT(read_error(points + "LINES 1 " + count + "\n2 0 1\n"), HasSubstr("needs " + count + " numbers;"));
      EXPECT_THAT(read_error(points + "LINES " + count + " 0\n"), HasSubstr("cell 0 of 'LINES " + count + " 0'"));
      EXPECT_THAT(read_error(points + "LINES " + count + " 2\nOFFSETS vtktypeint64\n0 2\n"),
                  HasSubstr("'OFFSETS vtktypeint64' needs " + count + " numbers;"));
      EXPECT_THAT(read_error(points + "FIELD f 1\na 3 " + count + " double\n"), HasSubstr("numbers times 3; the file"));
      EXPECT_THAT(read_error(points + "FIELD f " + count + "\n"), EndsWith("the file ends within FIELD"));
    }
  EXPECT_EQ(read_error(vtk_header("3.0") + "POINTS 99999999999999999999999 float\n"),
            "t.vtk:5: POINTS is followed by '99999999999999999999999'; a whole number, not negative, is needed");
  EXPECT_EQ(read_error(vtk_header("3.0") + "POINTS -1 float\n"),
            "t.vtk:5: POINTS is followed by '-1'; a whole number, not negative, is needed");
}

TEST_F(VtkFile, RefusesCellsThatDoNotFit) {
  const auto error = [](const std::string& cells) { return read_error(vtk_header("5.1") + kSquare + cells); };
  EXPECT_EQ(error("LINES 1 3\n2 0 4\n"),
            "t.vtk:8: cell 0 of 'LINES 1 3' has the point 4; there are 4 points, counted from 0");
  EXPECT_THAT(error("LINES 2 6\n2 0 1 2 -1 2\n"), StartsWith("t.vtk:8: cell 1 of 'LINES 2 6' has the point -1;"));
  EXPECT_EQ(error("LINES 1 3\n3 0 1\n"), "t.vtk:8: cell 0 of 'LINES 1 3' does not fit into its numbers");
  EXPECT_EQ(error("LINES 1 3\n-2 0 1\n"), "t.vtk:8: cell 0 of 'LINES 1 3' does not fit into its numbers");
  EXPECT_EQ(error("LINES 1 4\n2 0 1 2\n"), "t.vtk:8: the cells of 'LINES 1 4' take 3 of its numbers");
  EXPECT_EQ(error("LINES 1 3\n2 0\n1.5\n"),
            "t.vtk:10: '1.5' is among the numbers of 'LINES 1 3'; a whole number is needed");
  EXPECT_EQ(error("LINES 3 4\nOFFSETS int\n0 3 2\nCONNECTIVITY int\n0 1 2 3\n"),
            "t.vtk:8: the offsets of 'LINES 3 4' do not rise from 0 to 4");
  EXPECT_EQ(error("LINES 3 4\nOFFSETS float\n0 2 4\n"), "t.vtk:9: 'OFFSETS float' needs a type of whole numbers");
}

TEST_F(VtkFile, RefusesWhatItDoesNotKnow) {
  EXPECT_EQ(read_error(vtk_header("3.0") + "POINTS 1 real\n1 2 3\n"),
            "t.vtk:5: the numbers of POINTS have the type 'real'; float, double or a type of whole numbers is needed");
  EXPECT_EQ(read_error(vtk_header("3.0") + kSquare + kSquare), "t.vtk:8: a second section POINTS");
  EXPECT_THAT(read_error(vtk_header("3.0") + kSquare + "CELLS 1 2\n"), StartsWith("t.vtk:8: 'CELLS' where a section"));
  EXPECT_EQ(read_error(vtk_header("3.0") + "POINTS 1 float\n1 inf 3\n"),
            "t.vtk:6: landmark 1 of 'POINTS 1 float': y is 'inf'; a coordinate must be finite");
}

}  // namespace
}  // namespace pulson::formats
