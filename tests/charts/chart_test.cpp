#include "charts/chart.hpp"

#include <array>
#include <random>

#include <gtest/gtest.h>

#include "chart_examples.hpp"
#include "draw/drawing.hpp"
#include "picture_files.hpp"
#include "png_pixels.hpp"
#include "svg_parts.hpp"

namespace pulson::charts {
namespace {

class ChartTest : public PictureTest {
 protected:
  /// Writes the chart, expects two whole files and returns the SVG's text.
  static std::string draw(const Chart& chart) {
    write_chart(chart, {"chart.png", "chart.svg"});
    return expect_whole_pictures("chart.png", "chart.svg");
  }

  static std::string draw(const ChartPanel& panel) { return draw(Chart{.rows = {{panel}}}); }
};

/// Pieces of lines in the SVG, each of which begins by a move, areas and discs.
std::size_t count_strokes(const std::string& svg) { return count_of(svg, "M") + count_of(svg, "<circle"); }

constexpr std::array kStyles = {SeriesStyle::kLine, SeriesStyle::kPoints, SeriesStyle::kLineAndPoints,
                                SeriesStyle::kSteps, SeriesStyle::kBars};

TEST_F(ChartTest, WritesBothFilesInEveryStyleAndGrid) {
  std::size_t panels = 0;
  for (const std::size_t rows : {1, 2, 3})
    for (const std::size_t columns : {1, 2, 3, 5}) {
      SCOPED_TRACE(testing::Message() << rows << " by " << columns);
      Chart chart{.rows = {rows, std::vector<ChartPanel>(columns)}};
      for (auto& row : chart.rows)
        for (ChartPanel& panel : row)
          panel = {.heading = "a heading",
                   .series = {with_band(with_error(wave("w", kStyles.at(panels++ % kStyles.size())), 0.1), 0.3)}};
      draw(chart);
    }
  EXPECT_EQ(files(), (std::set<std::string>{"chart.png", "chart.svg"}));
}

// What stands side by side stands one above the other on narrow screens, in the same picture as panels that do so
// anyway; titles are left out.
TEST_F(ChartTest, NarrowScreensHaveOneColumn) {
  const auto narrow_layout = [](const Chart& chart) {
    std::string narrow;
    write_chart(chart, {.png = "chart.png", .narrow = &narrow});
    return narrow;
  };
  Chart row{.title = "a title", .subtitle = "a subtitle", .rows = {{}}}, column;
  for (const std::string heading : {"one", "two", "three"}) {
    const ChartPanel panel{.heading = heading, .x_label = "x", .series = {wave("w")}};
    row.rows[0].push_back(panel);
    column.rows.push_back({panel});
  }
  const std::string narrow = narrow_layout(row);
  EXPECT_EQ(size_of_png(narrow).first, 600);
  EXPECT_TRUE(narrow == narrow_layout(column));
  // Panels of a row that share y keep its range, each with its numbers.
  for (double& y : row.rows[0][1].series[0].y) y *= 10;
  const std::string own_ranges = narrow_layout(row);
  row.rows_share_y = true;
  EXPECT_FALSE(own_ranges == narrow_layout(row));
}

TEST_F(ChartTest, NumbersCountedThingsByWholeNumbersAlone) {
  ChartPanel panel{.series = {{.name = "", .x = {1, 2, 3}, .y = {5, 6, 7}, .style = SeriesStyle::kPoints}}};
  EXPECT_TRUE(contains(draw(panel), ">1.2<") || contains(draw(panel), ">1.5<"));
  panel.counts_x = true;
  const std::string svg = draw(panel);
  for (const char* text : {">1<", ">2<", ">3<"}) EXPECT_TRUE(contains(svg, text)) << text;
  for (const char* text : {">1.5<", ">2.5<", ">1.0<"}) EXPECT_FALSE(contains(svg, text)) << text;
}

TEST_F(ChartTest, ShowsAllTexts) {
  const std::string svg = draw(Chart{.title = "the <title>",
                                     .subtitle = "the subtitle",
                                     .rows = {{{.heading = "a heading",
                                                .x_label = "below",
                                                .y_label = "above",
                                                .series = {wave("α & β")},
                                                .reference_lines = {{1, "one"}}}}}});
  for (const char* text :
       {">the &lt;title&gt;<", ">the subtitle<", ">a heading<", ">below<", ">above<", ">α &amp; β<", ">one<"})
    EXPECT_TRUE(contains(svg, text)) << text;
}

TEST_F(ChartTest, OneNameIsOneEntryAndOneColour) {
  Series dashed = wave("same", SeriesStyle::kLine);
  dashed.dashed = true;
  const std::string svg =
      draw(Chart{.rows = {{{.series = {wave("same")}}, {.series = {wave("other", SeriesStyle::kPoints), dashed}}},
                          {{.series = {wave("same", SeriesStyle::kSteps), wave("")}}, {.series = {wave("other")}}}}});
  EXPECT_EQ(count_of(svg, ">same<"), 1u);
  EXPECT_EQ(count_of(svg, ">other<"), 1u);
  EXPECT_TRUE(contains(svg, "#2169D2")) << "the first colour";
  EXPECT_TRUE(contains(svg, "#A93A56")) << "the second colour";
  EXPECT_FALSE(contains(svg, "#35A484")) << "a third colour";
}

// Lines on one another both stay visible, and no series is known by its colour alone.
TEST_F(ChartTest, LinesDifferByTheirDashesAndMarksByTheirShapes) {
  std::string svg = draw({.series = {wave("one", SeriesStyle::kLine), wave("two", SeriesStyle::kLine)}});
  const auto is_dashed = [&](const std::string& colour) {
    return count_of(svg, "stroke=\"" + colour +
                             "\" stroke-width=\"2.2\" stroke-linecap=\"round\" stroke-linejoin=\"round\" "
                             "stroke-dasharray=\"16 6\"");
  };
  EXPECT_EQ(is_dashed("#2169D2"), 0U) << "the first is whole";
  EXPECT_EQ(is_dashed("#A93A56"), 2U) << "the second is dashed, here and in the legend";
  svg = draw({.series = {wave("one", SeriesStyle::kPoints), wave("two", SeriesStyle::kPoints)}});
  EXPECT_EQ(svg_parts(svg, "#2169D2").discs.size(), 11U) << "one in the legend";
  EXPECT_TRUE(svg_parts(svg, "#2169D2").areas.empty());
  EXPECT_EQ(svg_parts(svg, "#A93A56").areas.size(), 11U) << "squares";
}

TEST_F(ChartTest, ASeriesWithoutValuesIsAnEntryOfTheLegend) {
  const std::string svg =
      draw({.series = {wave("curve"), {.name = "what dashes mean", .x = {}, .y = {}, .dashed = true}}});
  EXPECT_TRUE(contains(svg, ">what dashes mean<"));
}

TEST_F(ChartTest, WrapsALongLegend) {
  ChartPanel panel;
  for (int i = 0; i < 12; ++i) panel.series.push_back(wave("a rather long name of series " + std::to_string(i)));
  const std::string svg = draw(panel);
  for (const Series& series : panel.series) EXPECT_TRUE(contains(svg, ">" + series.name + "<")) << "it is cut";
}

TEST_F(ChartTest, AnErrorBarIsALineWithTwoEnds) {
  // The other styles have no margin at the sides but for their error bars.
  for (const SeriesStyle style : {SeriesStyle::kPoints, SeriesStyle::kLineAndPoints, SeriesStyle::kBars}) {
    ChartPanel panel{.series = {wave("", style)}, .y_range = std::pair(0, 3)};
    const std::size_t before = count_strokes(draw(panel));
    panel.series[0] = with_error(panel.series[0], 0.1);
    EXPECT_EQ(count_strokes(draw(panel)), before + 3 * 10);
  }
}

// Every pixel outside of the frame is that of the empty panel, but for the halves of dots on the frame.
TEST_F(ChartTest, WhatIsBeyondTheRangeIsCutOff) {
  const auto pixels = [](const ChartPanel& panel) {
    draw(panel);
    return png_pixels("chart.png");
  };
  ChartPanel panel{.series = {with_band(wave(""), 50)}, .y_range = std::pair(0, 3)};
  panel.series[0] = with_error(panel.series[0], 100);
  panel.series[0].y[5] = 1e300;
  panel.series[0].low[3] = -1e300;
  const draw::Raster full = pixels(panel);
  const std::string svg = contents("chart.svg");
  const Points frame = svg_parts(svg, "#C9CED6").lines.at(0);
  ChartPanel empty{.series = {{.name = "", .x = {0.5, 9.5}, .y = {-10, -10}, .error = {1, 1}}},
                   .y_range = std::pair(0, 3)};
  const draw::Raster bare = pixels(empty);
  ASSERT_EQ(full.rgba.size(), bare.rgba.size());
  std::size_t differences_within = 0;
  for (int y = 0; y < full.height; ++y)
    for (int x = 0; x < full.width; ++x) {
      const std::size_t i = 4 * (static_cast<std::size_t>(y) * full.width + x);
      if (full.rgba[i] == bare.rgba[i] && full.rgba[i + 1] == bare.rgba[i + 1]) continue;
      const bool within = x > frame(0, 0) - 3 && x < frame(0, 1) + 3 && y > frame(1, 2) - 3 && y < frame(1, 0) + 3;
      ASSERT_TRUE(within) << x << ' ' << y;
      ++differences_within;
    }
  EXPECT_GT(differences_within, 10000U);
}

TEST_F(ChartTest, HugeValuesAreDrawn) {
  ChartPanel panel{.series = {}, .y_range = std::pair(0, 3)};
  for (const SeriesStyle style : kStyles) {
    panel.series = {with_band(wave("", style), 50)};
    panel.series[0].y[3] = -1e300;
    panel.series[0].low[3] = -1e300;
    panel.series[0].high[4] = 1e300;
    draw(panel);
  }
}

// Names of any length and with any character, wherever a chart shows one.
TEST_F(ChartTest, NamesOfAnyKindLeaveRoomForThePanel) {
  const std::string name = "<&'\x01\xFF 🐟" + std::string(10000, 'w');
  const ChartPanel panel{.heading = name,
                         .x_label = name,
                         .y_label = name,
                         .series = {wave(name), wave("short", SeriesStyle::kPoints)},
                         .reference_lines = {{1, name}},
                         .x_names = {name, "two"}};
  const std::string svg = draw(Chart{.title = name, .subtitle = name, .rows = {{panel, panel}}});
  const Points frame = svg_parts(svg, "#C9CED6").lines.at(0);
  EXPECT_GT(frame.row(0).maxCoeff() - frame.row(0).minCoeff(), 300);
  for (const SvgText& text : svg_texts(svg)) {
    const double left = text.x - (text.anchor == "end" ? 1 : text.anchor == "middle" ? 0.5 : 0) * text.width;
    EXPECT_GE(left, -0.01) << text.text;
    EXPECT_LE(left + text.width, 1600.01) << text.text;
  }
}

TEST_F(ChartTest, NumbersOfASharedRangeStandOnce) {
  Chart chart{.rows = {{{.series = {wave("")}}, {.series = {wave("")}}}}};
  for (Series* series : {&chart.rows[0][0].series[0], &chart.rows[0][1].series[0]})
    for (double& value : series->y) value *= 1000;
  EXPECT_EQ(count_of(draw(chart), ">2000<"), 2u);
  chart.rows_share_y = true;
  EXPECT_EQ(count_of(draw(chart), ">2000<"), 1u);
}

TEST_F(ChartTest, ColumnsShareTheRangeOfX) {
  Chart chart{.rows = {{{.series = {wave("")}}}, {{.series = {wave("")}}}}};
  for (double& value : chart.rows[1][0].series[0].x) value += 100;
  EXPECT_EQ(count_of(draw(chart), ">100<"), 2u);
}

TEST_F(ChartTest, NamesStandInPlaceOfNumbersWhereTheyFit) {
  const std::string wide(200, 'w');
  const ChartPanel named{.series = {{.name = "s", .x = {1, 2}, .y = {3, 4}, .style = SeriesStyle::kPoints}},
                         .x_names = {"first", wide}};
  const std::string svg = draw(named);
  EXPECT_TRUE(contains(svg, ">first<"));
  EXPECT_FALSE(contains(svg, wide)) << "wider than its room";
  EXPECT_FALSE(contains(svg, ">1.5<") || contains(svg, ">2<")) << "a number in place of a name";
  EXPECT_TRUE(contains(draw(Chart{.rows = {{named}, {{.series = {wave("")}}}}}), ">8<"))
      << "the panel below has its own range";
}

TEST_F(ChartTest, LogarithmicAxesShowPowersOfTen) {
  ChartPanel panel{
      .series = {{.name = "error", .x = {10, 100, 1000}, .y = {1e-2, 1e-5, 1e-8}}}, .log_x = true, .log_y = true};
  std::string svg = draw(panel);
  EXPECT_TRUE(contains(svg, ">10⁻⁵<"));
  EXPECT_TRUE(contains(svg, ">100<") && contains(svg, ">200<")) << "wide decades are divided";
  panel.series[0] = with_band(with_error(panel.series[0], 1), 1);
  draw(panel);
  panel.series[0] = {.name = "within a decade", .x = {3, 4}, .y = {3.1, 3.2}, .style = SeriesStyle::kBars};
  EXPECT_TRUE(contains(draw(panel), ">3.15<"));
}

TEST_F(ChartTest, LogarithmicAndLinearPanelsOfAColumnHaveRangesOfTheirOwn) {
  const ChartPanel linear{.series = {{.name = "s", .x = {0, 40}, .y = {1, 2}}}};
  const ChartPanel logarithmic{.series = {{.name = "s", .x = {1, 1000}, .y = {1, 2}}}, .log_x = true};
  const std::string svg = draw(Chart{.rows = {{linear}, {logarithmic}}});
  EXPECT_TRUE(contains(svg, ">40<"));
  EXPECT_TRUE(contains(svg, ">1000<") || contains(svg, ">10³<"));
}

/// n times the same value, far from zero in x.
Series constant(SeriesStyle style, double value, std::size_t n) {
  Series series{.name = "s", .x = {}, .y = std::vector<double>(n, value), .style = style};
  for (std::size_t i = 0; i < n + (style == SeriesStyle::kSteps ? 1 : 0); ++i)
    series.x.push_back(1e9 + 1e7 * static_cast<double>(i));
  return series;
}

TEST_F(ChartTest, DrawsConstantFarAwayHugeAndLoneValues) {
  for (const std::size_t n : {1, 3}) {
    Chart plain{.rows = {}}, decorated{.rows = {}};
    for (const double value : {0.0, 5.2e6, -1e300, 1e-300}) {
      for (Chart* chart : {&plain, &decorated}) chart->rows.emplace_back();
      for (const SeriesStyle style : kStyles) {
        Series series = constant(style, value, n);
        plain.rows.back().push_back({.series = {series}});
        series = with_band(with_error(series, 0), 0);
        series.error[0] = 1e300;
        decorated.rows.back().push_back({.series = {series}});
      }
    }
    draw(plain);
    draw(decorated);
  }
  draw(ChartPanel{.heading = "nothing"});
}

TEST_F(ChartTest, LongPathsStaySmall) {
  std::mt19937 generator(42);
  std::normal_distribution<double> normal;
  Chart chart{.rows = {2, std::vector<ChartPanel>(3)}};
  for (auto& row : chart.rows)
    for (ChartPanel& panel : row)
      for (const char* name : {"q₁", "q₂"}) {
        Series path{.name = name, .x = {}, .y = {}};
        for (int k = 0; k <= 5000; ++k) {
          path.x.push_back(0.001 * k);
          path.y.push_back(normal(generator));
        }
        panel.series.push_back(with_band(path, 0.5));
      }
  draw(chart);
}

}  // namespace
}  // namespace pulson::charts
