// Drawings as png, svg and pdf: exact widths, any text, the same files every time and from any thread.
#include "draw/canvas.hpp"

#include <array>
#include <thread>

#include <gmock/gmock.h>

#include "core/text.hpp"
#include "picture_files.hpp"
#include "png_pixels.hpp"
#include "pulson/core/errors.hpp"
#include "svg_parts.hpp"

namespace pulson::draw {
namespace {

using testing::StartsWith;

class CanvasTest : public PictureTest {
 protected:
  static constexpr double kWidth = 300, kHeight = 200;

  /// The picture's pixels as the png has them.
  static Raster pixels_of(const Canvas& canvas, double dpi = 96) {
    canvas.write({.png = "pixels.png", .dpi = dpi});
    return png_pixels("pixels.png");
  }

  static std::string svg_of(const Canvas& canvas) {
    canvas.write({.svg = "picture.svg"});
    return contents("picture.svg");
  }
};

/// The first and last columns and rows (from the top) of pixels that are not white.
struct Ink {
  int left = 1 << 20, right = -1, top = 1 << 20, bottom = -1;

  explicit Ink(const Raster& raster) {
    for (int y = 0; y < raster.height; ++y)
      for (int x = 0; x < raster.width; ++x)
        if (raster.rgba[4 * (static_cast<std::size_t>(y) * raster.width + x)] < 200) {
          left = std::min(left, x);
          right = std::max(right, x);
          top = std::min(top, y);
          bottom = std::max(bottom, y);
        }
  }
};

Rgb pixel(const Raster& raster, int x, int y) {
  const std::uint8_t* const rgba = &raster.rgba[4 * (static_cast<std::size_t>(y) * raster.width + x)];
  return {rgba[0], rgba[1], rgba[2]};
}

TEST_F(CanvasTest, WidthsAreThoseOfTheFont) {
  ASSERT_EQ(font_note(), "");
  // From the table hmtx of DejaVuSans.ttf, 2048 units to the font size.
  EXPECT_NEAR(text_width("A", 2048), 1401, 0.5);
  EXPECT_NEAR(text_width("i", 2048), 569, 0.5);
  EXPECT_NEAR(text_width(" ", 2048), 651, 0.5);
  EXPECT_NEAR(text_width("Ai 0", 20.48), 14.01 + 5.69 + 6.51 + 13.03, 0.01);
  EXPECT_EQ(text_width("", 20), 0);
  EXPECT_EQ(text_width("\xFF\n", 20), text_width("? ", 20));
}

TEST_F(CanvasTest, TextLiesWhereItsWidthSays) {
  const std::string text = "Hamburgefonstiv 0123456789 MWM";
  for (const Align align : {Align::kLeft, Align::kCentre, Align::kRight}) {
    Canvas canvas(800, 100);
    canvas.text(400, 50, text, 20, colour::kTitle, align);
    const double width = text_width(text, 20);
    const double left = align == Align::kLeft ? 400 : align == Align::kCentre ? 400 - width / 2 : 400 - width;
    const Ink ink(pixels_of(canvas));
    EXPECT_NEAR(ink.left, left + 2, 2.5) << "the bearing of H";
    EXPECT_NEAR(ink.right, left + width - 2, 2.5);
    const std::vector<SvgText> texts = svg_texts(svg_of(canvas));
    ASSERT_EQ(texts.size(), 1U);
    EXPECT_EQ(texts[0].text, text);
    EXPECT_NEAR(texts[0].width, width, 0.01);
    EXPECT_EQ(texts[0].anchor, align == Align::kLeft ? "" : align == Align::kCentre ? "middle" : "end");
  }
}

TEST_F(CanvasTest, TextIsCentredAtItsHeight) {
  Canvas canvas(200, 100);
  canvas.text(20, 40, "H0", 40, colour::kTitle);
  const Ink ink(pixels_of(canvas));
  EXPECT_NEAR((ink.top + ink.bottom + 1) / 2.0, 60, 1);
}

TEST_F(CanvasTest, TextThatDoesNotFitIsShrunkAndThenCut) {
  const std::string text = "a text of some length";
  for (const double part : {1.0, 0.8, 0.3, 0.1}) {
    Canvas canvas(kWidth, kHeight);
    canvas.text(10, 50, text, 20, colour::kTitle, Align::kLeft, part * text_width(text, 20));
    const std::vector<SvgText> texts = svg_texts(svg_of(canvas));
    ASSERT_EQ(texts.size(), 1U);
    EXPECT_LE(texts[0].width, part * text_width(text, 20) + 0.01);
    EXPECT_EQ(texts[0].text == text, part > 0.5) << texts[0].text;
    EXPECT_NEAR(texts[0].size, part > 0.99 ? 20 : part > 0.7 ? 16 : 11, 0.01);
  }
}

TEST_F(CanvasTest, DrawsAnyTextInEveryFormat) {
  std::string long_text;
  for (int i = 0; i < 2500; ++i) long_text += "ä b<";
  const std::vector<std::string> texts = {"it's",
                                          "\"quoted\"",
                                          "<tag attribute=\"x\">&amp;</tag>",
                                          "]]>",
                                          "a & b",
                                          std::string("zero\0byte", 9),
                                          "control \x01\x02\x1B[31m\x7F\t\n",
                                          "C1 \xC2\x85 and separators \xE2\x80\xA8\xE2\x80\xA9",
                                          "not UTF-8 \xFF\xFE\x80 cut \xE2\x82",
                                          "surrogate \xED\xA0\x80",
                                          "no character \xEF\xBF\xBE\xEF\xBF\xBF",
                                          "emoji 🐟🧬",
                                          "שלום עולם",
                                          "مرحبا",
                                          "right-to-left override \xE2\x80\xAE gnp.",
                                          "日本語 魚",
                                          "e\xCC\x81 combining",
                                          "|touch x;# `touch y` $(touch z) %s %d \\n {x}_1^2",
                                          "",
                                          long_text};
  for (const std::string& text : texts) {
    SCOPED_TRACE(text.substr(0, 60));
    Canvas canvas(kWidth, kHeight);
    canvas.text(10, 100, text, 20, colour::kTitle);
    canvas.text_on_image(150, 50, text, 20, colour::kText);
    canvas.write({"a.png", "a.svg", "a.pdf"});
    EXPECT_THAT(contents("a.png"), StartsWith("\x89PNG"));
    EXPECT_THAT(contents("a.pdf"), StartsWith("%PDF-"));
    const std::string svg = contents("a.svg");
    EXPECT_TRUE(is_balanced_xml(svg));
    EXPECT_EQ(svg_texts(svg).size(), text.empty() ? 0U : 2U);
    for (const SvgText& shown : svg_texts(svg)) EXPECT_LE(shown.width, kWidth + 0.01);
  }
  EXPECT_EQ(files(), (std::set<std::string>{"a.pdf", "a.png", "a.svg"}));
}

TEST_F(CanvasTest, PrintableTextKeepsAllThatIsText) {
  EXPECT_EQ(printable("it's <b> & é→日🐟"), "it's <b> & é→日🐟");
  EXPECT_EQ(printable("a\tb\x80"), "a b?");
  EXPECT_EQ(printable(std::string("\0", 1)), " ");
  EXPECT_EQ(printable("\xC2\x85"), " ");
  EXPECT_EQ(printable("\xEF\xBF\xBE"), "?");
}

TEST_F(CanvasTest, WritesFilesOfAnyName) {
  Canvas canvas(kWidth, kHeight);
  canvas.text(10, 100, "text", 20, colour::kTitle);
  for (const std::string name :
       {"<touch X;#", "|touch X;#", "it''s", "-o", "~", "%d", "a\nb", "\xFF", "file:x", "`touch X`"}) {
    canvas.write({name + ".png", name + ".svg", name + ".pdf"});
    for (const char* const extension : {".png", ".svg", ".pdf"}) {
      ASSERT_TRUE(std::filesystem::exists(name + extension)) << name;
      std::filesystem::remove(name + extension);
    }
  }
  EXPECT_TRUE(files().empty());
}

/// All that a canvas can hold.
Canvas with_everything() {
  Canvas canvas(300, 200);
  const Points zigzag{{20, 60, 100, NAN, 140, 180}, {20, 60, 20, 0, 60, 20}};
  canvas.lines({zigzag, zigzag.array() + 20}, {colour::kGrid, 3});
  canvas.areas({Points{{200, 280, 240}, {20, 20, 80}}}, faded(colour::kSource, 0.5));
  canvas.dots(zigzag, 5, colour::kTarget);
  canvas.rings(zigzag.array() + 40, 8, {colour::kResult, 2});
  canvas.arrows(zigzag.leftCols(2), zigzag.rightCols(2), {colour::kMomentum, 1.5});
  canvas.raster({2, 1, {255, 0, 0, 255, 0, 0, 255, 128}}, {150, 120, 100, 60});
  canvas.text(20, 180, "names of α & β, 魚", 18, colour::kText);
  canvas.text_on_image(160, 150, "on it", 18, colour::kTitle);
  return canvas;
}

TEST_F(CanvasTest, DrawsTheSameEveryTimeAndFromEveryThread) {
  constexpr int kThreads = 8, kRounds = 5;
  const auto write = [](const std::string& name) {
    with_everything().write({name + ".png", name + ".svg", name + ".pdf"});
  };
  write("first");
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // a file that holds the time would differ
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t)
    threads.emplace_back([&, t] {
      for (int k = 0; k < kRounds; ++k) write(std::to_string(t));
    });
  for (std::thread& thread : threads) thread.join();
  for (const std::string extension : {".png", ".svg", ".pdf"})
    for (int t = 0; t < kThreads; ++t)
      EXPECT_TRUE(contents(std::to_string(t) + extension) == contents("first" + extension)) << t << extension;
}

TEST_F(CanvasTest, PdfsHoldTextThatCanBeSearchedAndNoTime) {
  with_everything().write({.pdf = "a.pdf"});
  const std::string pdf = contents("a.pdf");
  EXPECT_TRUE(contains(pdf, "/FontFile") || contains(pdf, "DejaVuSans"));
  EXPECT_FALSE(contains(pdf, "CreationDate"));
}

TEST_F(CanvasTest, DiscsAndRingsAreCentred) {
  Canvas canvas(100, 60);
  canvas.dots(Points{{30}, {20}}, 8, colour::kTitle);
  Ink ink(pixels_of(canvas));
  EXPECT_EQ(ink.left + ink.right + 1, 60);
  EXPECT_EQ(ink.top + ink.bottom + 1, 80) << "heights are counted upwards";
  EXPECT_NEAR(ink.right - ink.left + 1, 16, 1);
  Canvas ring(100, 60);
  ring.rings(Points{{30}, {20}}, 8, {colour::kTitle, 2});
  const Raster raster = pixels_of(ring);
  ink = Ink(raster);
  EXPECT_EQ(ink.left + ink.right + 1, 60);
  EXPECT_NEAR(ink.right - ink.left + 1, 18, 1);
  EXPECT_EQ(pixel(raster, 30, 40), (Rgb{255, 255, 255})) << "it is open";
}

TEST_F(CanvasTest, WhatOneLayerHoldsDoesNotDarkenItself) {
  const Colour faint = faded(Colour("#000000"), 0.5);
  Canvas canvas(100, 60);
  canvas.dots(Points{{30, 34}, {30, 30}}, 10, faint);
  canvas.lines({Points{{60, 90}, {20, 40}}, Points{{60, 90}, {40, 20}}}, {faint, 8});
  const Raster raster = pixels_of(canvas);
  EXPECT_EQ(pixel(raster, 25, 30), pixel(raster, 32, 30));
  EXPECT_EQ(pixel(raster, 66, 34), pixel(raster, 75, 30));
  canvas.dots(Points{{32}, {30}}, 4, faint);
  const Raster darker = pixels_of(canvas);
  EXPECT_LT(pixel(darker, 32, 30)[0], pixel(darker, 25, 30)[0]) << "another layer does";
}

TEST_F(CanvasTest, PixelsFillTheirBoxInTheirOrder) {
  Canvas canvas(100, 60);
  canvas.raster({2, 2, {255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 9, 9, 9, 0}}, {10, 10, 80, 40});
  const Raster raster = pixels_of(canvas);
  EXPECT_EQ(pixel(raster, 11, 11), (Rgb{255, 0, 0}));
  EXPECT_EQ(pixel(raster, 88, 11), (Rgb{0, 255, 0}));
  EXPECT_EQ(pixel(raster, 11, 48), (Rgb{0, 0, 255}));
  EXPECT_EQ(pixel(raster, 88, 48), (Rgb{255, 255, 255})) << "transparent";
  EXPECT_EQ(pixel(raster, 5, 30), (Rgb{255, 255, 255}));
  const std::string svg = svg_of(canvas);
  EXPECT_TRUE(contains(svg, "<image x=\"10\" y=\"10\" width=\"80\" height=\"40\""));
  EXPECT_TRUE(contains(svg, "base64,iVBORw0KGgo"));
}

TEST_F(CanvasTest, LinesBreakAtMissingPlacesAndSurviveFarOnes) {
  Canvas canvas(100, 60);
  canvas.lines({Points{{10, 40, NAN, 60, 90}, {30, 30, 30, 30, 30}}}, {colour::kTitle, 4});
  canvas.lines({Points{{-1e300, 1e300}, {10, 10}}, Points{{50, 50}, {-INFINITY, 30}}}, {colour::kTitle, 2});
  const Raster raster = pixels_of(canvas);
  EXPECT_LT(pixel(raster, 25, 30)[0], 100);
  EXPECT_LT(pixel(raster, 75, 30)[0], 100);
  EXPECT_EQ(pixel(raster, 50, 20)[0], 255) << "the gap";
  EXPECT_LT(pixel(raster, 50, 50)[0], 100) << "from far away to far away";
  const std::string svg = svg_of(canvas);
  EXPECT_FALSE(contains(svg, "nan") || contains(svg, "inf") || contains(svg, "e+"));
}

TEST_F(CanvasTest, RefusesWhatIsTooLargeAndWritesNone) {
  const Canvas canvas(kWidth, kHeight);
  EXPECT_EQ(error_of([&] { canvas.write({.png = "a.png", .svg = "a.svg", .dpi = 96 * 200}); }),
            "a png of 60000 × 40000 pixels cannot be drawn; 32767 are the most: lower its resolution");
  EXPECT_TRUE(files().empty());
}

TEST_F(CanvasTest, EncodesPixelsAsTheyAre) {
  const std::vector<std::uint8_t> pixels = {1, 2, 3, 4, 5, 6, 7, 8};
  write("some.png", encode_png(2, 1, 4, pixels));
  EXPECT_EQ(png_pixels("some.png").rgba, pixels);
}

}  // namespace
}  // namespace pulson::draw
