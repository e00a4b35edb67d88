// What programs and editors make of text files: comments, decimal commas, the end mark of DOS, other encodings.

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/text.hpp"
#include "reading_files.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

using TextHabits = ReadingFiles;

TEST_F(TextHabits, TpsMayHoldComments) {
  const LandmarkFile file =
      read("a.tps", "# made by R\n\"digitised\" 'in 2020'\nLM=2\n# the first\n1 2\n3 4\n'end\nID=a\n");
  ASSERT_EQ(file.shapes.size(), 1U);
  EXPECT_EQ(file.format, "tps");
  EXPECT_EQ(file.shapes[0].points, points_2d({1, 2, 3, 4}));
  EXPECT_EQ(file.shapes[0].name, "a");
}

TEST_F(TextHabits, DosEndsFilesWithAMark) {
  EXPECT_EQ(read_one("a.tps", "LM=1\r\n1 2\r\nID=a\r\n\x1A").name, "a");
  EXPECT_EQ(read_one("b.nts", "1 1 2 0 dim=2\r\n1 2\r\n\x1A").points, points_2d({1, 2}));
}

TEST_F(TextHabits, ALoneCarriageReturnIsABlankWhereLinesEndOtherwise) {
  const LandmarkFile file = read("a.fcsv",
                                 "# Markups fiducial file version = 4.11\r\n# CoordinateSystem = LPS\n"
                                 "1,1.5,-2\r,3,0,0,0,1,1,1,0,tip\r,,\r\r\n\r2,4,5,6,0,0,0,1,1,1,0,left\rfin,,\n");
  EXPECT_EQ(file.format, "fcsv");
  EXPECT_EQ(file.shapes[0].points, (Points(3, 2) << 1.5, 4, -2, 5, 3, 6).finished());
  EXPECT_EQ(file.shapes[0].labels[0], "tip");
  EXPECT_EQ(read_one("b.tps", "LM=2\n1\r2\r\n\r3 4\n").points, points_2d({1, 2, 3, 4}));
  EXPECT_EQ(read_one("c.csv", "x,y\n1\r,2\n3,\r4\n").points, points_2d({1, 2, 3, 4}));
  EXPECT_EQ(read_one("d.csv", "x,y\r1,2\r3,4\r\n").points, points_2d({1, 2, 3, 4})) << "an old Mac's, but for its end";
  EXPECT_EQ(read_error("e.tps", "LM=2\n1 2\r\n3 4 5\n"),
            "e.tps:3: landmark 2 of shape 1 has 3 columns ('3 4 5'); LM= takes 2");
}

TEST_F(TextHabits, GeomorphNamesTheColumnsOfTemplates) {
  EXPECT_EQ(read_one("template.txt", "\"xpts\" \"ypts\" \"zpts\"\n1 2 3\n4 5 6\n").points,
            (Points(3, 2) << 1, 4, 2, 5, 3, 6).finished());
  EXPECT_EQ(read_one("template.txt", "\"\" \"xpts\" \"ypts\"\n\"1\" 1 2\n\"2\" 4 5\n").points, points_2d({1, 2, 4, 5}));
}

TEST_F(TextHabits, CommasMayBeDecimal) {
  const Points wanted = points_2d({1.5, 2, -3, 0.25});
  EXPECT_EQ(read_one("a.nts", "1 2L 2 0 dim=2\na b\n1,5 2\n-3 0,25\n").points, wanted);
  EXPECT_EQ(read_one("b.pts", "version: 1\nn_points: 2\n{\n1,5 2,0\n-3 0,25\n}\n").points, wanted);
  EXPECT_EQ(
      read_one("c.txt", "[individuals]\n1\n[landmarks]\n2\n[dimensions]\n2\n[rawpoints]\n1,5 2\n-3 0,25\n").points,
      wanted);
  EXPECT_EQ(read_one("d.xyz", "title\nXYZ\n2 2 1\n1,5 2\n-3 0,25\n").points, wanted);
  EXPECT_EQ(read_error("e.pts", "version: 1\nn_points: 1\n{\n1,234,5 2\n}\n"),
            "e.pts:4: landmark 1: x is '1,234,5'; a number is needed");
}

TEST_F(TextHabits, EdmaMayBePlane) {
  const Landmarks shape = read_one("a.xyz", "wing\nXY\n2L 2 1\ntip base\n1 2\n3 4\n");
  EXPECT_EQ(shape.points, points_2d({1, 2, 3, 4}));
  EXPECT_THAT(shape.labels, ElementsAre("tip", "base"));
}

TEST_F(TextHabits, MorphologikaMaySeparateLabelsByTabs) {
  const Landmarks shape = read_one("a.txt",
                                   "[individuals]\n1\n[landmarks]\n1\n[dimensions]\n2\n[labels]\nsex\tspecies\n"
                                   "[labelvalues]\nM\tHomo sapiens\n[rawpoints]\n1 2\n");
  EXPECT_THAT(shape.properties, ElementsAre(Pair("sex", "M"), Pair("species", "Homo sapiens")));
}

TEST_F(TextHabits, WhatIsNotUtf8IsWindows1252) {
  const LandmarkFile file = read("a.tps", "LM=1\n1 2\nID=M\xFCller\nIMAGE=\x80uro.jpg\n");
  EXPECT_EQ(file.shapes[0].name, "Müller");
  EXPECT_EQ(file.shapes[0].image, "€uro.jpg");
  EXPECT_THAT(file.warnings, ElementsAre("a.tps: it is not in UTF-8, and read as Windows-1252"));
  EXPECT_THAT(read("b.tps", "LM=1\n1 2\nID=Müller\n").warnings, IsEmpty());
  EXPECT_EQ(read_error("c.csv", std::string("\xFF\xFEx\0,\0y\0\n\0", 10)), "c.csv is text in UTF-16; save it in UTF-8");
}

TEST(Utf8, HoldsEachLetterOfWindows1252) {
  EXPECT_EQ(utf8_of_windows_1252("a\x7F\x80\x8D\x9F\xA0\xE9\xFF"), "a\x7F€\uFFFDŸ\u00A0éÿ");
  for (int c = 1; c < 256; ++c) EXPECT_TRUE(is_utf8(utf8_of_windows_1252(std::string(1, static_cast<char>(c))))) << c;
  EXPECT_TRUE(is_utf8("") && is_utf8("€ \U0001F98B"));
  for (const char* text : {"\xFC", "\xC3", "\xC0\x80", "\xED\xA0\x80", "\xE2\x82"}) EXPECT_FALSE(is_utf8(text));
}

}  // namespace
}  // namespace pulson::formats
