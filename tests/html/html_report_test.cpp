#include "html/html_report.hpp"

#include <gtest/gtest.h>

#include "picture_files.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::html {
namespace {

using HtmlReportTest = PictureTest;

const std::string kPng = "\x89PNG\r\n\x1a\n and so on";

HtmlReport report_of(ReportBlock block) { return {.title = "t", .sections = {{"s", {std::move(block)}}}}; }

/// The page without its style and script, whose texts are not escaped.
std::string body_of(const std::string& page) {
  const std::size_t begin = page.find("<body>"), end = page.find("<script>");
  return page.substr(begin, end - begin);
}

/// Every element of the page is closed in order; those are left out that HTML never closes.
bool is_balanced_html(std::string page) {
  page = "<svg>" + body_of(page) + "</body></svg>";
  for (std::size_t i = page.find("<img "); i != std::string::npos; i = page.find("<img ", i + 1))
    page.insert(page.find('>', i), "/");
  return is_balanced_xml(page);
}

TEST_F(HtmlReportTest, IsOnePageOfHtml5WithAllItsTexts) {
  write("a.png", kPng);
  const std::string page =
      html_report({.title = "the title",
                   .lead = "the lead",
                   .sections = {{"first", {ReportParagraph{"a paragraph"}, ReportPicture{"a.png", "a caption"}}},
                                {"second",
                                 {ReportTable{{"name", "order"}, {{{"ch-sd"}, {"0.5", Verdict::kHolds}}}, "a table"},
                                  ReportClaims{{"a claim", Verdict::kDoesNotHold, "0.3 ± 0.1"},
                                               {"another", Verdict::kNotTested}}}}},
                   .command = "pulson reproduce --seed 42",
                   .version = "pulson 1.0"});
  EXPECT_TRUE(page.starts_with("<!DOCTYPE html>\n<html lang=\"en\">"));
  EXPECT_TRUE(page.ends_with("</body>\n</html>\n"));
  EXPECT_TRUE(is_balanced_html(page));
  for (const char* text :
       {"<meta charset=\"utf-8\">", "<title>the title</title>", "<h1>the title</h1>", ">the lead<", "<h2>first</h2>",
        "<p>a paragraph</p>", ">a caption<", ">name<", ">ch-sd<", ">a table<", ">✗ does not hold<", ">a claim<",
        ">0.3 ± 0.1<", ">– not tested<", ">pulson reproduce --seed 42<", ">pulson 1.0<", "prefers-color-scheme: dark"})
    EXPECT_TRUE(contains(page, text)) << text;
}

TEST_F(HtmlReportTest, LeavesOutWhatIsEmpty) {
  const std::string page = html_report({.title = "t", .sections = {{"", {ReportClaims{}}}}});
  EXPECT_TRUE(is_balanced_html(page));
  for (const char* tag : {"<h2", "<ul", "<footer", "class=\"lead\"", "<figcaption"})
    EXPECT_FALSE(contains(body_of(page), tag)) << tag;
}

TEST_F(HtmlReportTest, EscapesEveryText) {
  write("a.png", kPng);
  const std::string text = "<b>&\"'", escaped = "&lt;b&gt;&amp;&quot;'";
  const std::string page = html_report({.title = text,
                                        .lead = text,
                                        .sections = {{text,
                                                      {ReportParagraph{text}, ReportPicture{"a.png", text},
                                                       ReportTable{{text}, {{{text, Verdict::kHolds}}}, text},
                                                       ReportClaims{{text, Verdict::kHolds, text}}}}},
                                        .command = text,
                                        .version = text});
  EXPECT_FALSE(contains(page, "<b>"));
  EXPECT_EQ(count_of(page, escaped), 15u);
  EXPECT_TRUE(is_balanced_html(page));
}

TEST_F(HtmlReportTest, MendsTextThatIsNotUtf8) {
  const std::string page = html_report(report_of(ReportParagraph{"a\xE9 b\xED\xA0\x80 \x01\n→"}));
  EXPECT_TRUE(contains(page, "<p>a\uFFFD b\uFFFD\uFFFD\uFFFD   →</p>"));
}

TEST_F(HtmlReportTest, EmbedsPicturesByTheirContents) {
  write("picture.any", "<?xml version=\"1.0\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\"></svg>");
  EXPECT_TRUE(contains(html_report(report_of(ReportPicture{"picture.any"})),
                       "<img src=\"data:image/svg+xml;base64,PD94bWwgdmVyc2lvbj0iMS4wIj8+"));
  // Each length modulo 3 ends in its own way.
  write("a.png", kPng);
  EXPECT_TRUE(
      contains(html_report(report_of(ReportPicture{"a.png"})), "\"data:image/png;base64,iVBORw0KGgogYW5kIHNvIG9u\""));
  write("a.png", kPng + "!");
  EXPECT_TRUE(contains(html_report(report_of(ReportPicture{"a.png"})), "IG9uIQ==\""));
  write("a.png", kPng + "!!");
  EXPECT_TRUE(contains(html_report(report_of(ReportPicture{"a.png"})), "IG9uISE=\""));
}

TEST_F(HtmlReportTest, EmbedsPicturesFromMemory) {
  const auto page_with = [](MediaType type) {
    return html_report(report_of(ReportPicture{EncodedPicture{type, "some bytes"}}));
  };
  EXPECT_TRUE(contains(page_with(MediaType::kPng), "<img src=\"data:image/png;base64,c29tZSBieXRlcw==\""));
  EXPECT_TRUE(contains(page_with(MediaType::kJpeg), "<img src=\"data:image/jpeg;base64,c29tZSBieXRlcw==\""));
  EXPECT_TRUE(contains(page_with(MediaType::kSvg), "<img src=\"data:image/svg+xml;base64,c29tZSBieXRlcw==\""));
}

TEST_F(HtmlReportTest, HasAnotherPictureForNarrowScreens) {
  ReportPicture picture{EncodedPicture{MediaType::kSvg, "some bytes"}, "c"};
  EXPECT_FALSE(contains(html_report(report_of(picture)), "<picture>"));
  picture.narrow = EncodedPicture{MediaType::kPng, "some bytes"};
  const std::string page = html_report(report_of(picture));
  EXPECT_TRUE(contains(page,
                       "<picture><source media=\"(max-width: 44rem)\" "
                       "srcset=\"data:image/png;base64,c29tZSBieXRlcw==\">\n<img src=\"data:image/svg+xml"));
  EXPECT_EQ(count_of(page, "</picture>"), 1U);
}

TEST_F(HtmlReportTest, NeedsNothingBesideItself) {
  write("a.svg", "<svg xmlns=\"http://www.w3.org/2000/svg\"></svg>");
  const std::string page = html_report(report_of(ReportPicture{"a.svg", "c"}));
  for (const char* reference : {"http", "//www", "<link", "@import", "url(", " src=\"a"})
    EXPECT_FALSE(contains(page, reference)) << reference;
}

TEST_F(HtmlReportTest, MarksOutliersBySignAndWord) {
  const ReportTable table{{"value"}, {{{"1"}}, {{.text = "9", .outlier = true}}}};
  const std::string page = html_report(report_of(table));
  EXPECT_EQ(count_of(body_of(page), "▲"), 1u);
  EXPECT_TRUE(contains(page, R"(<span class="outlier" role="img" aria-label="outlier">▲</span>9</td>)"));
}

TEST_F(HtmlReportTest, DrawsSketchesInCells) {
  Landmarks source;
  source.points.resize(2, 3);
  source.points << 0, 1, 0, 0, 0, 1;
  Points target = source.points;
  target(0, 1) = std::numeric_limits<double>::quiet_NaN();
  const Points result = 2 * source.points;
  const auto page = [&](const Points& end) {
    return html_report(
        report_of(ReportTable{{"shape"}, {{{.text = "a", .sketch = ReportSketch{source, target, end}}}}}));
  };
  const std::string drawn = page(result);
  EXPECT_NE(drawn.find("<svg class=\"sketch\""), std::string::npos);
  EXPECT_EQ(body_of(drawn).find("nan"), std::string::npos);
  EXPECT_TRUE(is_balanced_html(drawn));
  const std::string rings = drawn.substr(drawn.find("class=\"target\""), 200);
  EXPECT_EQ(std::count(rings.begin(), rings.begin() + static_cast<long>(rings.find("/>")), 'M'), 2) << "of those known";
  EXPECT_THROW(page(Points::Zero(2, 4)), InputError);
  source.frame.y_down = true;
  EXPECT_NE(page(result), drawn);
}

TEST_F(HtmlReportTest, AlignsColumnsOfNumbers) {
  const ReportTable table{{"name", "value"}, {{{"a"}, {"−1.5 ± 0.1"}}, {{"2"}, {"3"}}, {{"b"}, {""}}}};
  const std::string page = html_report(report_of(table));
  EXPECT_EQ(count_of(page, "<td class=\"number\">"), 3u);
  EXPECT_EQ(count_of(page, "<th scope=\"col\" class=\"number\">"), 1u);
}

TEST_F(HtmlReportTest, AValueThatIsNotThereLeavesAColumnOneOfNumbers) {
  const std::string page = html_report(report_of(ReportTable{{"value"}, {{{"1"}}, {{"–"}}}}));
  EXPECT_EQ(count_of(page, "<td class=\"number\">"), 2u);
}

// Neither names of options nor short heads of columns are broken into two lines.
TEST_F(HtmlReportTest, KeepsShortNamesWhole) {
  const std::string page = html_report(report_of(ReportParagraph{"take more --draws and --max-iterations; a -- b"}));
  EXPECT_NE(page.find("more <span class=\"option\">--draws</span> and <span class=\"option\">--max-iterations</span>; "
                      "a -- b</p>"),
            std::string::npos);
  const std::string table = html_report(report_of(ReportTable{{"R-hat", "50 %"}, {{{"1"}, {"2"}}}}));
  EXPECT_NE(table.find(">R&#8209;hat<"), std::string::npos);
  EXPECT_NE(table.find(">50&nbsp;%<"), std::string::npos);
}

TEST_F(HtmlReportTest, RefusesPicturesThatCannotBeEmbedded) {
  const auto error = [](const char* file) { return error_of([&] { html_report(report_of(ReportPicture{file})); }); };
  EXPECT_EQ(error("absent.svg"), "cannot read the picture 'absent.svg': No such file or directory");
  EXPECT_EQ(error("."), "cannot read the picture '.': it is a folder");
  write("text.svg", "no picture");
  EXPECT_EQ(error("text.svg"), "the picture 'text.svg' is not SVG, PNG or JPEG");
}

TEST_F(HtmlReportTest, LaysTwoPicturesOverOneAnother) {
  write("a.svg", "<svg xmlns='x'/>");
  const ReportStack stack{"a.svg", "a.svg", "target", "<result>", "caption"};
  const std::string page = html_report({.title = "t", .sections = {{"s", {stack}}}});
  for (const char* text : {"class=\"over\"", "value=\"wipe\"", "value=\"difference\"", "&lt;result&gt; over target",
                           "class Stack", "class Zoom", ">caption</figcaption>"})
    EXPECT_TRUE(contains(page, text)) << text;
  EXPECT_FALSE(contains(page, "class Motion"));
}

TEST_F(HtmlReportTest, RefusesTablesThatAreNotRectangular) {
  EXPECT_EQ(error_of([] {
              html_report(report_of(ReportTable{{"a", "b"}, {{{"1"}, {"2"}}, {{"3"}}}}));
            }),
            "report: row 2 of a table has 1 cells for 2 heads");
}

}  // namespace
}  // namespace pulson::html
