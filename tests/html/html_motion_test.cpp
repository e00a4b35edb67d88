#include <gtest/gtest.h>

#include "error_of.hpp"
#include "html/html_report.hpp"
#include "picture_files.hpp"

namespace pulson::html {
namespace {

ReportMotion two_points() {
  ReportMotion motion;
  motion.source.points = (Points(2, 2) << 0, 1, 0, 0).finished();
  motion.target.points = (Points(2, 2) << 0, 1, 1, 1).finished();
  motion.times = {0, 0.5};
  motion.frames = {motion.source.points, motion.target.points};
  return motion;
}

std::string page_of(const ReportMotion& motion) { return html_report({.title = "t", .sections = {{"s", {motion}}}}); }

std::string numbers_in(const std::string& page) {
  const std::string begin = "<script type=\"application/json\">";
  const std::size_t from = page.find(begin) + begin.size();
  return page.substr(from, page.find("</script>", from) - from);
}

std::string motion_error(const ReportMotion& motion) {
  return error_of([&] { page_of(motion); });
}

TEST(HtmlMotion, HoldsPlacesAsPartsOfTheBox) {
  ReportMotion motion = two_points();
  motion.source.groups = {"a", "b"};
  motion.outliers = {1};
  motion.source.numbers = {4, 9};
  const std::string numbers = numbers_in(page_of(motion));
  for (const char* text :
       {"\"d\":2,", "\"times\":[0,0.5]", "\"low\":[0,0]", "\"unit\":1e-05", "\"size\":[100000,100000]",
        R"("groups":[0,1])", R"("outliers":[1])", R"("numbers":[4,9])",
        "\"frames\":[[0,0,100000,0],[0,100000,100000,100000]]", "\"target\":[0,100000,100000,100000]", "\"grid\":[]"})
    EXPECT_TRUE(contains(numbers, text)) << text << '\n' << numbers;
}

TEST(HtmlMotion, HasASliderAButtonAndWordsForTheCanvas) {
  const std::string page = page_of(two_points());
  for (const char* text :
       {R"(data-layer="landmarks" checked="")", R"(data-layer="numbers" />)", R"(data-zoom="1.5")", R"(tabindex="0")",
        "<kbd>space</kbd>", R"(<canvas role="img" aria-label="2 landmarks in 2D)", R"(<input type="range")",
        R"(aria-label="time")", R"(<button type="button">Play</button>)", "prefers-reduced-motion"})
    EXPECT_TRUE(contains(page, text)) << text;
}

ReportShapeSpace space_of_two_points() {
  ReportShapeSpace space;
  space.shapes = two_points();
  space.axes = {"mode 1 <&>"};
  space.range = 2;
  space.powers = {{0}, {1}};
  space.terms = {space.shapes.frames[0], 0.25 * Points::Ones(2, 2)};
  space.specimens = {{"a</script>", "g", {0.5}, {}}, {"b", "", {-1}, {}}};
  return space;
}

// The constant term is from the corner of the box, in units of a hundred thousandth; others are differences.
TEST(HtmlMotion, HoldsShapesAsAPolynomialInTheirScores) {
  const std::string page = html_report({.title = "t", .sections = {{"s", {space_of_two_points()}}}});
  const std::string numbers = numbers_in(page);
  for (const char* text :
       {R"("powers":[[0],[1]])", R"("terms":[[0.0,0.0,100000.0,0.0],[25000.0,25000.0,25000.0,25000.0]])",
        R"("gridTerms":[])", R"("range":2,)", R"("groupNames":["g"])", R"("frames":[[0,0,100000,0]])",
        R"({"name":"a\u003c/script>","group":0,"scores":[0.5]})", R"("name":"b","group":1,"scores":[-1])"})
    EXPECT_TRUE(contains(numbers, text)) << text << '\n' << numbers;
  EXPECT_TRUE(contains(page, R"(min="-200" max="200" value="0" data-score="0")"));
  EXPECT_TRUE(contains(page, "<option value=\"1\">b</option>"));
  EXPECT_TRUE(contains(page, "class ShapeSpace extends Motion"));
  EXPECT_FALSE(contains(page_of(two_points()), "ShapeSpace"));
}

TEST(HtmlMotion, RefusesShapesWhoseSizesDisagree) {
  const auto error = [](const ReportShapeSpace& space) {
    return error_of([&] { html_report({.title = "t", .sections = {{"s", {space}}}}); });
  };
  ReportShapeSpace space = space_of_two_points();
  space.specimens[1].scores = {1, 2};
  EXPECT_EQ(error(space), "report: a specimen of a space of shapes has other scores");
  space = space_of_two_points();
  space.terms[1] = Points::Ones(2, 3);
  EXPECT_EQ(error(space), "report: a term of a space of shapes is not of its template");
  space = space_of_two_points();
  space.powers.pop_back();
  EXPECT_EQ(error(space), "report: a space of shapes has other powers than terms");
}

TEST(HtmlMotion, PlayerIsOnlyInPagesThatPlay) {
  EXPECT_TRUE(contains(page_of(two_points()), "requestAnimationFrame"));
  const std::string page = html_report({.title = "t", .sections = {{"s", {ReportParagraph{"p"}}}}});
  EXPECT_FALSE(contains(page, "requestAnimationFrame"));
  EXPECT_FALSE(contains(page, ".player"));
}

TEST(HtmlMotion, EscapesItsCaptionAndNeedsNothingBesideItself) {
  ReportMotion motion = two_points();
  motion.caption = "<b>&";
  motion.source.labels = {"</script><b>", "\"\\\xFFß"};
  motion.source.groups = {"</script><b>", "\"http"};
  const std::string page = page_of(motion);
  EXPECT_TRUE(contains(page, "\"names\":[\"\\u003c/script>\\u003cb>\",\"\\u0022\\u005c\uFFFDß\"]}"))
      << numbers_in(page);
  EXPECT_TRUE(contains(page, "<figcaption>&lt;b&gt;&amp;</figcaption>"));
  for (const char* bad : {"<b>", "http", "//www", "@import", "url(", "nan", "inf]"})
    EXPECT_FALSE(contains(page, bad)) << bad;
}

TEST(HtmlMotion, CountsYDownwardsInImages) {
  ReportMotion motion = two_points();
  EXPECT_TRUE(contains(numbers_in(page_of(motion)), R"("down":false)"));
  motion.target.frame.y_down = true;
  EXPECT_TRUE(contains(numbers_in(page_of(motion)), R"("down":true)"));
}

TEST(HtmlMotion, RefusesAPictureWhoseMeshIsNotInTheGrid) {
  ReportMotion motion = two_points();
  motion.image = MotionImage{"missing.png", {0, 0}, {1, 1}, 2, 1};
  const std::string error = "report: the mesh of a motion's picture is not in its grid";
  EXPECT_EQ(motion_error(motion), error) << "there is no grid";
  motion.lines = {2, 2};
  motion.grid.assign(2, (Points(2, 4) << 0, 0, 1, 1, 0, 1, 0, 1).finished());
  EXPECT_TRUE(contains(motion_error(motion), "cannot read the picture 'missing.png'"));
  motion.image->columns = 3;
  EXPECT_EQ(motion_error(motion), error);
  motion.image->columns = 2;
  motion.image->step = 0;
  EXPECT_EQ(motion_error(motion), error);
}

TEST(HtmlMotion, TargetMayMissCoordinates) {
  ReportMotion motion = two_points();
  motion.target.points(0, 1) = std::nan("");
  EXPECT_TRUE(contains(numbers_in(page_of(motion)), "\"target\":[0,100000,null,100000]"));
}

TEST(HtmlMotion, StandsStillWhereNothingMoves) {
  ReportMotion motion;
  motion.source.points = Points::Constant(1, 1, 3);
  motion.times = {0, 1};
  motion.frames = {motion.source.points, motion.source.points};
  EXPECT_TRUE(contains(numbers_in(page_of(motion)), "\"frames\":[[0],[0]]"));
}

TEST(HtmlMotion, SwitchesWhatItHas) {
  ReportMotion motion = two_points();
  EXPECT_FALSE(contains(page_of(motion), "data-layer=\"others\""));
  motion.target = {};
  motion.others_name = "2 other paths";
  motion.others.assign(2, motion.frames);
  motion.extra = {"ellipses", {Points::Zero(2, 5)}};
  const std::string page = page_of(motion);
  for (const char* text : {"/>2 other paths</label>", "/>ellipses</label>", "/>start</label>"})
    EXPECT_TRUE(contains(page, text)) << text;
  EXPECT_FALSE(contains(page, "data-layer=\"target\""));
  EXPECT_TRUE(contains(numbers_in(page), "\"extra\":[[0,0,0,0,0,0,0,0,0,0]]"));
  motion.others[1].pop_back();
  EXPECT_EQ(motion_error(motion), "report: another path of a motion has 1 frames at 2 times");
}

TEST(HtmlMotion, StaysSmall) {
  ReportMotion motion;
  motion.source.points = Points::Random(2, 500);
  for (int k = 0; k <= 20; ++k) {
    motion.times.push_back(k);
    motion.frames.emplace_back(motion.source.points * (1 + 0.01 * k));
    motion.grid.emplace_back(Points::Random(2, 2600));
  }
  motion.lines.assign(40, 65);
  EXPECT_LT(page_of(motion).size(), 1'200'000u);
}

TEST(HtmlMotion, RefusesSizesThatDisagree) {
  const auto changed = [](auto change) {
    ReportMotion motion = two_points();
    change(motion);
    return motion_error(motion);
  };
  EXPECT_EQ(changed([](auto& m) { m.frames.pop_back(); }), "report: a motion has 1 frames at 2 times");
  EXPECT_EQ(changed([](auto& m) { m.frames[1] = Points::Zero(2, 3); }),
            "report: frame 2 of the landmarks of a motion is 2×3; it must be 2×2");
  EXPECT_EQ(changed([](auto& m) { m.frames[0](0, 0) = std::nan(""); }),
            "report: frame 1 of the landmarks of a motion is not finite");
  EXPECT_EQ(changed([](auto& m) { m.grid = {Points::Zero(2, 2)}; }), "report: a motion has 1 grids at 2 times");
  EXPECT_EQ(changed([](auto& m) {
              m.lines = {3};
              m.grid = {Points::Zero(2, 3), Points::Zero(2, 2)};
            }),
            "report: frame 2 of the grid of a motion is 2×2; it must be 2×3");
  EXPECT_EQ(changed([](auto& m) { m.times = {1, 1}; }), "report: the times of a motion must grow");
  EXPECT_EQ(changed([](auto& m) { m.times = {1}; }), "report: a motion needs two times or more");
  EXPECT_EQ(changed([](auto& m) { m.target.points = Points::Zero(2, 3); }),
            "report: the target of a motion has 3 landmarks of 2");
  EXPECT_EQ(changed([](auto& m) { m.target.points = Points::Zero(3, 2); }),
            "report: the target of a motion has another dimension");
  EXPECT_EQ(changed([](auto& m) { m.outliers = {2}; }), "report: a motion has no landmark 2");
  EXPECT_EQ(changed([](auto& m) { m.source = {}; }), "report: a motion of 0 landmarks in 0D cannot be shown");
}

}  // namespace
}  // namespace pulson::html
