// Plots of scores, and shapes in panels.
#include <regex>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "draw/shape_panels.hpp"
#include "picture_files.hpp"
#include "svg_parts.hpp"

namespace pulson::draw {
namespace {

class ScorePlotTest : public PictureTest {
 protected:
  static std::string draw(const ScorePlot& plot) {
    write_score_plot(plot, {"scores.png", "scores.svg"});
    return expect_whole_pictures("scores.png", "scores.svg");
  }

  static std::string draw(const ShapePanels& picture) {
    write_shape_panels(picture, {"shapes.png", "shapes.svg"});
    return expect_whole_pictures("shapes.png", "shapes.svg");
  }
};

/// A grid of side × side dots, labelled s0, s1, …
ScorePlot::Group grid_of(int side) {
  ScorePlot::Group group{"", Points(2, side * side)};
  for (int i = 0; i < side * side; ++i) {
    group.scores.col(i) << i % side, i / side;
    group.labels.push_back("s" + std::to_string(i));
  }
  return group;
}

/// The labels of dots.
std::vector<SvgText> labels_in(const std::string& svg) {
  std::vector<SvgText> labels = svg_texts(svg);
  std::erase_if(labels, [](const SvgText& text) { return !std::regex_match(text.text, std::regex("s[0-9]+")); });
  return labels;
}

TEST_F(ScorePlotTest, LabelsEveryDotWhereThereIsRoom) {
  EXPECT_EQ(
      labels_in(draw({.groups = {grid_of(5)}, .x_label = "x", .y_label = "y", .title = {}, .subtitle = {}})).size(),
      25U);
}

// Of dots that are crowded some have labels, which do not run into one another; the outermost first.
TEST_F(ScorePlotTest, LabelsOfCrowdedDotsDoNotOverlap) {
  ScorePlot plot{.groups = {grid_of(25)}, .x_label = "x", .y_label = "y", .title = {}, .subtitle = {}};
  plot.groups[0].scores.col(624) << 60, 30;
  const std::string svg = draw(plot);
  EXPECT_TRUE(contains(svg, ">s624<"));
  const std::vector<SvgText> labels = labels_in(svg);
  EXPECT_GE(labels.size(), 5U);
  EXPECT_LT(labels.size(), 300U);
  for (const SvgText& one : labels)
    for (const SvgText& other : labels)
      EXPECT_TRUE(&one == &other || one.x + one.width <= other.x || other.x + other.width <= one.x ||
                  std::abs(one.y - other.y) >= one.size)
          << one.text << ' ' << other.text;
}

// Colour alone does not distinguish groups: the first has discs, the others polygons.
TEST_F(ScorePlotTest, GroupsDifferInTheShapesOfTheirMarks) {
  ScorePlot plot{.groups = {}, .x_label = "x", .y_label = "y", .title = {}, .subtitle = {}};
  for (const std::string name : {"a", "b", "c"}) {
    plot.groups.push_back({name, Points(2, 2)});
    plot.groups.back().scores << 0, 1, static_cast<double>(plot.groups.size()), 0;
  }
  const std::string svg = draw(plot);
  const SvgParts first = svg_parts(svg, "#2169D2"), second = svg_parts(svg, "#A93A56");
  EXPECT_EQ(first.discs.size(), 3U) << "one in the legend";
  EXPECT_TRUE(first.areas.empty());
  EXPECT_EQ(second.areas.size(), 3U) << "one in the legend";
  EXPECT_TRUE(second.discs.empty());
  for (const std::string name : {">a<", ">b<", ">c<"}) EXPECT_TRUE(contains(svg, name));
}

TEST_F(ScorePlotTest, NarrowScreensHaveALayoutOfTheirOwn) {
  std::string narrow;
  write_score_plot({.groups = {grid_of(5)}, .x_label = "x", .y_label = "y", .title = "t", .subtitle = {}},
                   {.png = "scores.png", .narrow = &narrow});
  EXPECT_EQ(size_of_png(narrow).first, 600);
  // Shapes side by side become a column, which has no titles.
  ShapePanels row, column;
  row.reference.points = (Points(2, 3) << 0, 10, 5, 0, 0, 8).finished();
  row.reference_name = "template";
  row.shape_name = "shape";
  column = row;
  row.title = "a title";
  for (const std::string name : {"one", "two"}) {
    const ShapePanel panel{name, row.reference.points.array() + 1};
    if (row.rows.empty()) row.rows.emplace_back();
    row.rows[0].push_back(panel);
    column.rows.push_back({panel});
  }
  std::string of_row, of_column;
  write_shape_panels(row, {.png = "shapes.png", .narrow = &of_row});
  write_shape_panels(column, {.png = "shapes.png", .narrow = &of_column});
  EXPECT_EQ(size_of_png(of_row).first, 600);
  EXPECT_TRUE(of_row == of_column);
}

TEST_F(ScorePlotTest, TemplatesHaveNumbersAndModesNameTheirDisplacements) {
  ShapePanels picture;
  picture.reference.points = (Points(2, 3) << 0, 10, 5, 0, 0, 8).finished();
  picture.reference_name = "template";
  picture.rows = {{{"all", {}}}};
  const std::string alone = draw(picture);
  for (const std::string number : {">1<", ">2<", ">3<"}) EXPECT_TRUE(contains(alone, number)) << number;
  EXPECT_FALSE(contains(alone, ">displacement<"));
  picture.shape_name = "2 standard deviations along a mode";
  picture.rows = {{{"mode 1", picture.reference.points.array() + 1}}};
  EXPECT_TRUE(contains(draw(picture), ">displacement<"));
}

}  // namespace
}  // namespace pulson::draw
