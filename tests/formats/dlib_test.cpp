// Landmarks of dlib in XML: boxes as shapes, parts as landmarks.

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "reading_files.hpp"
#include "written_landmarks.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

using DlibFile = ReadingFiles;

const std::string kHead =
    "<?xml version='1.0' encoding='UTF-8'?>\n<?xml-stylesheet type='text/xsl' href='a.xsl'?>\n<!-- a <box> of "
    "imglab -->\n<dataset>\n<name>wings</name>\n<images>\n";
const std::string kTail = "</images>\n</dataset>\n";

std::string images(const std::string& text) { return kHead + text + kTail; }

TEST_F(DlibFile, HasAShapeForEachBox) {
  const LandmarkFile file =
      read("wings.xml", images("  <image file='photos/a 1.jpg' width='9' height=\"9\">\n"
                               "    <box top='1' left='2' width='30' height='40'>\n      <label>wing</label>\n"
                               "      <part name='00' x='1' y='2'/>\n      <part name=\"01\" x = '3.5' y='-4' />\n"
                               "    </box>\n    <box top='5' left='6' width='7' height='8' ignore='1'>\n"
                               "      <part x='5' y='6' name='tip &amp; &lt;a&gt;'></part>\n"
                               "      <part name='eye' x='NA' y=''/>\n    </box>\n  </image>\n"
                               "  <image file='b.jpg'><box><part name='tip' x='7' y='8'/></box></image>\n"));
  EXPECT_EQ(file.format, "dlib");
  ASSERT_EQ(file.shapes.size(), 3U);
  EXPECT_EQ(file.shapes[0].points, points_2d({1, 2, 3.5, -4}));
  EXPECT_THAT(file.shapes[0].labels, ElementsAre("00", "01"));
  EXPECT_EQ(file.shapes[0].image, "photos/a 1.jpg");
  EXPECT_EQ(file.shapes[0].name, "a 1_1");
  EXPECT_THAT(file.shapes[0].properties,
              ElementsAre(Pair("box.left", "2"), Pair("box.top", "1"), Pair("box.width", "30"),
                          Pair("box.height", "40"), Pair("label", "wing")));
  EXPECT_TRUE(have_same_bits(file.shapes[1].points, points_2d({5, 6, kNone, kNone})));
  EXPECT_THAT(file.shapes[1].labels, ElementsAre("tip & <a>", "eye"));
  EXPECT_EQ(file.shapes[1].name, "a 1_2");
  EXPECT_EQ(file.shapes[2].name, "b");
  EXPECT_THAT(file.warnings, IsEmpty());
  EXPECT_EQ(read_landmarks("wings.xml#3").points, Eigen::Vector2d(7, 8));
  EXPECT_EQ(read_landmarks("wings.xml#id=a 1_2").labels.front(), "tip & <a>");
  EXPECT_EQ(address_error("wings.xml"), "wings.xml has 3 shapes; choose one as wings.xml#1 or wings.xml#id=a 1_1");
}

TEST_F(DlibFile, OrdersPartsByTheirNumbers) {
  const Landmarks shape =
      read_one("a.xml", images("<image file='a.jpg'><box><part name='0' x='0' y='0'/><part name='10' x='10' y='0'/>"
                               "<part name='2' x='2' y='0'/></box></image>"));
  EXPECT_EQ(shape.points, points_2d({0, 0, 2, 0, 10, 0}));
  EXPECT_THAT(shape.labels, ElementsAre("0", "2", "10"));
}

TEST_F(DlibFile, LeavesBoxesWithoutPartsOut) {
  const LandmarkFile file = read("a.xml", images("<image file='a.jpg'><box top='1'/><box><part x='1' y='2'/></box>"
                                                 "</image>"));
  ASSERT_EQ(file.shapes.size(), 1U);
  EXPECT_THAT(file.shapes[0].labels, IsEmpty());
  EXPECT_THAT(file.warnings, ElementsAre("a.xml: 1 box without a <part> is left out"));
}

TEST_F(DlibFile, RefusesWhatDoesNotFit) {
  const auto error = [](const std::string& text) { return read_error("a.xml", images(text)); };
  EXPECT_EQ(error(""), "a.xml:8: there is no <box> with landmarks in this file");
  EXPECT_EQ(error("<image file='a.jpg'>\n<box>\n<part name='a' x='1'/>\n</box></image>\n"),
            "a.xml:9: the part 'a' has no y='...'");
  EXPECT_EQ(error("<image><box>\n<part name='a' x='1' y='two'/></box></image>\n"),
            "a.xml:8: landmark 'a' of box 1: y is 'two'; a number is needed");
  EXPECT_EQ(error("<image><box><part name='a' x='1' y='2'/>\n<part name='a' x='1' y='2'/></box></image>"),
            "a.xml:8: the part 'a' is in this box twice");
  EXPECT_EQ(error("<image>\n<part name='a' x='1' y='2'/></image>"),
            "a.xml:8: a <part> outside of all boxes; it must be between <box> and </box>");
  EXPECT_EQ(error("<image><box><part name='a' x=1 y='2'/></box></image>"),
            "a.xml:7: 'x=1 y='2'/></box></image></images>' in the tag <part>; name='value' is expected");
  EXPECT_EQ(error("<image><box>\n</image>"), "a.xml:8: </image> where </box> is expected");
  EXPECT_EQ(error("<image><box>\n<box/></box></image>"),
            "a.xml:8: a <box> within another; </box> is expected before it");
  EXPECT_EQ(read_error("a.xml", kHead + "<image>\n"), "a.xml:7: <image> has no end in this file");
  EXPECT_EQ(read_error("a.xml", kHead + "<image"), "a.xml:7: the tag <image> has no '>'");
  EXPECT_EQ(read_error("a.xml", kHead + "<image <!-- "),
            "a.xml:7: '<!-- ' in the tag <image>; name='value' is expected");
}

}  // namespace
}  // namespace pulson::formats
