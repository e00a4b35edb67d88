// Landmarks in arrays of numpy: what is read, what is written, what is refused.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
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
using testing::StartsWith;

using NpyFile = ReadingTexts;

std::string little_endian(std::size_t value, int size) {
  std::string bytes;
  for (int i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xFFU);
  return bytes;
}

std::string npy(const std::string& header, const std::string& data, int version = 1) {
  return "\x93NUMPY" + std::string(1, static_cast<char>(version)) + std::string(1, '\0') +
         little_endian(header.size(), version == 1 ? 2 : 4) + header + data;
}

std::string npy_header(const std::string& type, const std::string& shape, bool is_fortran = false) {
  return "{'descr': '" + type + "', 'fortran_order': " + (is_fortran ? "True" : "False") + ", 'shape': " + shape +
         ", }\n";
}

template <class Number>
std::string bytes_of(const std::vector<double>& numbers, bool is_big = false) {
  std::string all;
  for (const double number : numbers) {
    const auto typed = static_cast<Number>(number);
    std::string one(sizeof(Number), '\0');
    std::memcpy(one.data(), &typed, sizeof(Number));
    if (is_big) std::reverse(one.begin(), one.end());
    all += one;
  }
  return all;
}

const std::vector<double> kSix = {1, 2, 3, 4, 5, 6};

TEST_F(NpyFile, MayHaveAnOuterAxisOfLengthOne) {
  for (const bool is_fortran : {false, true}) {
    const LandmarkFile file =
        read(npy(npy_header("<f8", "(1, 2, 2, 2)", is_fortran), bytes_of<double>({1, 2, 3, 4, 5, 6, 7, 8})));
    ASSERT_EQ(file.shapes.size(), 2U);
    EXPECT_EQ(file.shapes[0].points, is_fortran ? points_2d({1, 5, 3, 7}) : points_2d({1, 2, 3, 4}));
    EXPECT_EQ(file.shapes[1].points, is_fortran ? points_2d({2, 6, 4, 8}) : points_2d({5, 6, 7, 8}));
    EXPECT_THAT(file.warnings, ElementsAre("t.txt: the array (1, 2, 2, 2) is read as (2, 2, 2)"));
  }
  const LandmarkFile single = read(npy(npy_header("<f8", "(1, 3, 1, 2)"), bytes_of<double>(kSix)));
  EXPECT_EQ(single.shapes.size(), 3U) << "shapes of one landmark, and no contour";
}

TEST_F(NpyFile, TakesEveryTypeAndVersion) {
  const auto check = [&]<class Number>(const std::string& type, Number) {
    for (int version = 1; version <= 3; ++version)
      for (const std::string order : {"<", ">"}) {
        const LandmarkFile file =
            read(npy(npy_header(order + type, "(3, 2)"), bytes_of<Number>(kSix, order == ">"), version));
        EXPECT_EQ(file.format, "npy");
        ASSERT_EQ(file.shapes.size(), 1U);
        EXPECT_EQ(file.shapes[0].points, points_2d(kSix)) << order << type;
        EXPECT_THAT(file.warnings, IsEmpty());
      }
  };
  check("f4", float{});
  check("f8", double{});
  check("i1", std::int8_t{});
  check("i2", std::int16_t{});
  check("i4", std::int32_t{});
  check("i8", std::int64_t{});
  check("u1", std::uint8_t{});
  check("u2", std::uint16_t{});
  check("u4", std::uint32_t{});
  check("u8", std::uint64_t{});
  EXPECT_EQ(read(npy(npy_header("|i1", "(2L, 1L)"), bytes_of<std::int8_t>({-1, 2}))).shapes[0].points,
            (Points(1, 2) << -1, 2).finished());
}

TEST_F(NpyFile, TakesEveryLayout) {
  const auto shapes = [](const std::string& shape, const std::vector<double>& numbers, bool is_fortran = false) {
    return read(npy(npy_header("<f8", shape, is_fortran), bytes_of<double>(numbers))).shapes;
  };
  EXPECT_EQ(shapes("(3,)", {1, 2, 3})[0].points, (Points(1, 3) << 1, 2, 3).finished());
  EXPECT_EQ(shapes("(3, 2)", {1, 3, 5, 2, 4, 6}, true)[0].points, points_2d(kSix));
  EXPECT_EQ(shapes("(2, 4)", {1, 2, 3, 4, 5, 6, 7, 8})[0].points, points_2d({1, 5, 2, 6, 3, 7, 4, 8}));
  const auto pair = shapes("(2, 3, 1)", kSix);
  ASSERT_EQ(pair.size(), 2U);
  EXPECT_EQ(pair[1].points, (Points(1, 3) << 4, 5, 6).finished());
  EXPECT_EQ(pair[1].name, "t#2");
  EXPECT_EQ(shapes("(2, 2, 2)", {1, 5, 3, 7, 2, 6, 4, 8}, true)[1].points, points_2d({5, 6, 7, 8}));
  EXPECT_EQ(shapes("(1, 1, 2)", {1, 2})[0].points, points_2d({1, 2}));
  const auto turned = shapes("(1, 2, 4)", {1, 2, 3, 4, 5, 6, 7, 8});
  EXPECT_EQ(turned[0].points, points_2d({1, 5, 2, 6, 3, 7, 4, 8}));
}

TEST_F(NpyFile, TakesContoursOfOpenCv) {
  for (const bool is_fortran : {false, true}) {
    const std::vector<double> numbers = is_fortran ? std::vector<double>{1, 3, 5, 2, 4, 6} : kSix;
    const LandmarkFile file = read(npy(npy_header("<i4", "(3, 1, 2)", is_fortran), bytes_of<std::int32_t>(numbers)));
    ASSERT_EQ(file.shapes.size(), 1U);
    EXPECT_EQ(file.shapes[0].points, points_2d(kSix));
    EXPECT_THAT(file.warnings,
                ElementsAre("t.txt: the array (3, 1, 2) is read as one shape of 3 landmarks, as OpenCV writes them"));
  }
  EXPECT_EQ(read(npy(npy_header("<f8", "(2, 1, 3)"), bytes_of<double>(kSix))).shapes[0].points,
            (Points(3, 2) << 1, 4, 2, 5, 3, 6).finished());
}

TEST_F(NpyFile, TellsWhatItDoubts) {
  EXPECT_THAT(read(npy(npy_header("<f8", "(1, 4)"), bytes_of<double>({1, 2, 3, 4}))).warnings,
              ElementsAre("t.txt: of the array (1, 4) the axis before the last is read as that of the coordinates"));
  EXPECT_THAT(read(npy(npy_header("<f8", "(1, 2)"), bytes_of<double>({1, 2, 3}))).warnings,
              ElementsAre("t.txt: 8 bytes after the array are not used"));
  EXPECT_THAT(
      incomplete_points(read(npy(npy_header("<f8", "(1, 2)"), bytes_of<double>({1, std::nan("")}))).shapes[0].points),
      ElementsAre(0));
}

TEST_F(NpyFile, IsRefusedInALine) {
  const auto error = [](const std::string& type, const std::string& shape) {
    return read_error(npy(npy_header(type, shape), bytes_of<double>(kSix)));
  };
  EXPECT_EQ(error("<f8", "(4, 132)"), "t.txt: the header says (4, 132) numbers of 8 bytes; the file has 48 bytes more");
  EXPECT_THAT(read_error(npy(npy_header("<u1", "(4, 8)"), std::string(32, '\1'))),
              StartsWith("t.txt: the array has the shape (4, 8), which does not say what is x and y; (N,d) or"));
  EXPECT_THAT(error("<f8", "(2, 1, 1, 3)"), StartsWith("t.txt: the array has 4 axes, (2, 1, 1, 3);"));
  EXPECT_THAT(error("<f8", "()"), HasSubstr("holds no landmarks"));
  EXPECT_THAT(error("<f8", "(1000000000000, 0, 2)"), HasSubstr("holds no landmarks"));
  for (const std::string shape : {"(10000000000, 2)", "(4294967296, 4294967296, 2)", "(18446744073709551615,)"})
    EXPECT_EQ(error("<f8", shape),
              "t.txt: the header says " + shape + " numbers of 8 bytes; the file has 48 bytes more");
  EXPECT_THAT(error("<f8", "(99999999999999999999, 2)"), HasSubstr("a whole number is needed"));
  EXPECT_THAT(error("<f8", "(-1, 2)"), HasSubstr("'-1' is in the shape"));
  EXPECT_THAT(error("|O", "(3, 2)"), HasSubstr("objects of Python (pickled), which are not read"));
  EXPECT_THAT(error("<c16", "(3, 1)"), HasSubstr("have the type '<c16'; f4, f8,"));
  EXPECT_THAT(error("|b1", "(3, 1)"), HasSubstr("have the type '|b1'"));
  EXPECT_THAT(read_error(npy(npy_header("<f8", "(1,)"), bytes_of<double>({HUGE_VAL}))),
              HasSubstr("number 0 of the array is inf; a coordinate must be finite"));
  EXPECT_EQ(read_error(npy("{}", "")), "t.txt: the header has no key 'descr'");
  EXPECT_THAT(read_error(npy("{'descr': [('x', '<f8')], }", "")), HasSubstr("holds records"));
  EXPECT_EQ(read_error(npy("", "", 9)), "t.txt: version 9.0 of the format; 1.0, 2.0 and 3.0 are read");
}

TEST_F(NpyFile, IsRefusedWhereItIsCut) {
  const std::string whole = npy(npy_header("<f8", "(3, 2)"), bytes_of<double>(kSix), 2);
  for (std::size_t length = 6; length < whole.size(); ++length)
    EXPECT_THAT(read_error(whole.substr(0, length)), StartsWith("t.txt: the ")) << length;
  EXPECT_EQ(read_error("\x93NUMPY" + std::string("\2\0\xFF\xFF\xFF\xFF", 6)),
            "t.txt: the header takes 4294967295 bytes; the file has 0 more");
}

TEST_F(NpyFile, IsWrittenToTheBits) {
  for (int d = 1; d <= 3; ++d) {
    LandmarkFile file = one_shape(hard_points(d, 20));
    EXPECT_THAT(write_landmark_file("t.npy", file), IsEmpty());
    EXPECT_TRUE(have_same_bits(read_landmarks("t.npy").points, file.shapes[0].points));
    file.shapes.push_back(one_shape(hard_points(d, 20, 2)).shapes[0]);
    file.shapes[1].points(0, 3) = std::nan("");
    EXPECT_THAT(write_landmark_file("t.npy", file), IsEmpty());
    const LandmarkFile back = read_landmark_file("t.npy");
    ASSERT_EQ(back.shapes.size(), 2U);
    for (std::size_t s = 0; s < 2; ++s) EXPECT_TRUE(have_same_bits(back.shapes[s].points, file.shapes[s].points));
  }
}

TEST_F(NpyFile, NeedsShapesOfOneSize) {
  LandmarkFile file = one_shape(points_2d(kSix));
  file.shapes[0].labels = {"a", "b", "c"};
  EXPECT_THAT(write_landmark_file("t.npy", file), ElementsAre("t.npy: npy cannot hold labels"));
  file.shapes.push_back(one_shape(points_2d({1, 2})).shapes[0]);
  EXPECT_EQ(write_error("t.npy", file),
            "t.npy: npy holds shapes of one size; shape 1 has 3 landmarks in 2D, shape 2 has 1 landmark in 2D");
  file.shapes.erase(file.shapes.begin());
  EXPECT_THAT(write_landmark_file("t.npy", file), IsEmpty());
  file.shapes.push_back(file.shapes[0]);
  EXPECT_EQ(write_error("t.npy", file),
            "t.npy: npy holds no shapes of one landmark each; an array (2, 1, 2) is read as one shape");
  EXPECT_EQ(write_error("t.npy", {}), "t.npy: there are no shapes to write");
}

}  // namespace
}  // namespace pulson::formats
