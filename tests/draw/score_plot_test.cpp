// Plots of scores, and shapes in panels.
#include <regex>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "draw/shape_panels.hpp"
#include "picture_files.hpp"

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

/// Where a text begins in the svg.
std::vector<std::pair<double, double>> places_of_labels(const std::string& svg) {
  static const std::regex kLabel(R"(translate\(([0-9.]+),([0-9.]+)\)[^>]*>\s*<text>s[0-9]+<)");
  std::vector<std::pair<double, double>> places;
  for (std::sregex_iterator match(svg.begin(), svg.end(), kLabel), none; match != none; ++match)
    places.emplace_back(std::stod(match->str(1)), std::stod(match->str(2)));
  return places;
}

TEST_F(ScorePlotTest, LabelsEveryDotWhereThereIsRoom) {
  EXPECT_EQ(
      places_of_labels(draw({.groups = {grid_of(5)}, .x_label = "x", .y_label = "y", .title = {}, .subtitle = {}}))
          .size(),
      25U);
}

// Of dots that are crowded some have labels, which do not run into one another; the outermost first.
TEST_F(ScorePlotTest, LabelsOfCrowdedDotsDoNotOverlap) {
  ScorePlot plot{.groups = {grid_of(25)}, .x_label = "x", .y_label = "y", .title = {}, .subtitle = {}};
  plot.groups[0].scores.col(624) << 60, 30;
  const std::string svg = draw(plot);
  EXPECT_TRUE(contains(svg, ">s624<"));
  const auto places = places_of_labels(svg);
  EXPECT_GE(places.size(), 5U);
  EXPECT_LT(places.size(), 300U);
  constexpr double kNarrowest = 14, kLetterHeight = 14;  // of a label, pixels
  for (std::size_t i = 0; i < places.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_TRUE(std::abs(places[i].first - places[j].first) > kNarrowest ||
                  std::abs(places[i].second - places[j].second) > kLetterHeight)
          << i << ' ' << j;
}

// Colour alone does not distinguish groups: the first has discs, which are strokes, the others polygons.
TEST_F(ScorePlotTest, GroupsDifferInTheShapesOfTheirMarks) {
  ScorePlot plot{.groups = {}, .x_label = "x", .y_label = "y", .title = {}, .subtitle = {}};
  for (const std::string name : {"a", "b", "c"}) {
    plot.groups.push_back({name, Points(2, 2)});
    plot.groups.back().scores << 0, 1, static_cast<double>(plot.groups.size()), 0;
  }
  const std::string svg = draw(plot);
  const std::size_t paths = count_of(svg, "fill = 'rgb( 33, 105, 210)'"), squares = count_of(svg, "rgb(169,  58,  86)");
  EXPECT_EQ(paths, 0U) << "discs are no areas";
  EXPECT_GE(squares, 1U);
  for (const std::string name : {">a<", ">b<", ">c<"}) EXPECT_TRUE(contains(svg, name));
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
