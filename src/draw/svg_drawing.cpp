// Drawings as SVG that can be edited: texts are texts, circles circles.
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "core/base64.hpp"
#include "drawing.hpp"
#include "typeface.hpp"

namespace pulson::draw {
namespace {

/// A number to a hundredth, without zeros at its end.
std::string number(double value) {
  const auto hundredths = std::lround(100 * std::clamp(value, -kFarAway, kFarAway));
  const auto whole = std::abs(hundredths) / 100, part = std::abs(hundredths) % 100;
  const char* const sign = hundredths < 0 ? "-" : "";
  if (part == 0) return fmt::format("{}{}", sign, whole);
  return part % 10 == 0 ? fmt::format("{}{}.{}", sign, whole, part / 10) : fmt::format("{}{}.{:02}", sign, whole, part);
}

std::string rgb(const Colour& colour) {
  return fmt::format("#{:02X}{:02X}{:02X}", colour.rgb[0], colour.rgb[1], colour.rgb[2]);
}

/// ` fill="#RRGGBB"`, and how opaque it is.
std::string paint(std::string_view property, const Colour& colour) {
  std::string text = fmt::format(" {}=\"{}\"", property, rgb(colour));
  if (colour.opacity < 1) text += fmt::format(" {}-opacity=\"{}\"", property, number(colour.opacity));
  return text;
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) result += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  return result;
}

class SvgWriter {
 public:
  SvgWriter(const Drawing& drawing, double scale) : top_(drawing.top) {
    add(R"(<?xml version="1.0" encoding="UTF-8"?>)"
        "\n"
        R"(<svg xmlns="http://www.w3.org/2000/svg" width="{}" height="{}" viewBox="0 0 {} {}" )"
        R"(font-family="'{}', Verdana, sans-serif" xml:space="preserve">)"
        "\n<rect width=\"100%\" height=\"100%\"{}/>\n",
        number(drawing.width * scale), number(drawing.height() * scale), number(drawing.width),
        number(drawing.height()), kFontFamily, paint("fill", colour::kPaper));
    for (const Layer& layer : drawing.layers) {
      look_through(layer.window);
      std::visit(*this, layer.shape);
    }
    look_through({});
    for (const Text& text : drawing.texts) draw(text);
    add("</svg>\n");
  }

  void operator()(const Lines& layer) {
    add(R"(<path fill="none"{} stroke-width="{}" stroke-linecap="round" stroke-linejoin="round")",
        paint("stroke", layer.stroke.colour), number(layer.stroke.width));
    for (std::size_t i = 0; i < layer.stroke.dashes.size(); ++i)
      add("{}{}", i == 0 ? " stroke-dasharray=\"" : " ", number(layer.stroke.dashes[i]));
    add("{} d=\"", layer.stroke.dashes.empty() ? "" : "\"");
    for (const Points& line : layer.lines) trace(line);
    add("\"/>\n");
  }

  void operator()(const Areas& layer) {
    add("<path{} d=\"", paint("fill", layer.colour));
    for (const Points& outline : layer.outlines) {
      trace(outline);
      if (outline.cols() > 0) add("Z");
    }
    add("\"/>\n");
  }

  /// The opacity is that of the group, so that overlapping ones do not darken one another.
  void operator()(const Circles& layer) {
    const std::string colour = rgb(layer.colour);
    add("<g{}", layer.ring > 0
                    ? fmt::format(R"( fill="none" stroke="{}" stroke-width="{}")", colour, number(layer.ring))
                    : fmt::format(" fill=\"{}\"", colour));
    if (layer.colour.opacity < 1) add(" opacity=\"{}\"", number(layer.colour.opacity));
    add(">\n");
    for (const auto& centre : layer.centres.colwise())
      if (centre.allFinite())
        add("<circle cx=\"{}\" cy=\"{}\" r=\"{}\"/>\n", number(centre.x()), number(top_ - centre.y()),
            number(layer.radius));
    add("</g>\n");
  }

  void operator()(const Picture& layer) {
    const auto& [raster, box] = layer;
    add(R"(<image x="{}" y="{}" width="{}" height="{}" preserveAspectRatio="none" href="data:image/png;base64,{}"/>)"
        "\n",
        number(box.left), number(top_ - box.top()), number(box.width), number(box.height),
        base64(encode_png(raster.width, raster.height, 4, raster.rgba)));
  }

  std::string take() && { return std::move(svg_); }

 private:
  template <class... Values>
  void add(fmt::format_string<Values...> text, Values&&... values) {
    fmt::format_to(std::back_inserter(svg_), text, std::forward<Values>(values)...);
  }

  /// Layers of one window that follow one another are a group.
  void look_through(const std::optional<Box>& window) {
    if (window == window_) return;
    if (window_) add("</g>\n");
    window_ = window;
    if (!window) return;
    add("<clipPath id=\"window{}\"><rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/></clipPath>\n", ++windows_,
        number(window->left), number(top_ - window->top()), number(window->width), number(window->height));
    add("<g clip-path=\"url(#window{})\">\n", windows_);
  }

  void trace(const Points& line) {
    char command = 'M';
    for (const auto& vertex : line.colwise()) {
      if (!vertex.allFinite()) {
        command = 'M';
        continue;
      }
      svg_ += command;
      svg_ += number(vertex.x());
      svg_ += ' ';
      svg_ += number(top_ - vertex.y());
      command = command == 'M' ? 'L' : ' ';
    }
  }

  void draw(const Text& text) {
    if (text.text.empty()) return;
    add(R"(<text x="{}" y="{}" font-size="{}"{})", number(text.x), number(top_ - text.y + kTextMiddle * text.size),
        number(text.size), paint("fill", text.colour));
    if (text.align != Align::kLeft) add(" text-anchor=\"{}\"", text.align == Align::kCentre ? "middle" : "end");
    if (text.margin > 0)
      add(R"({} stroke-width="{}" stroke-linejoin="round" paint-order="stroke")", paint("stroke", colour::kPaper),
          number(2 * text.margin));
    add(R"( textLength="{}" lengthAdjust="spacingAndGlyphs">{}</text>)"
        "\n",
        number(text.width), escaped(text.text));
  }

  double top_;
  std::optional<Box> window_;
  int windows_ = 0;  // so far
  std::string svg_;
};

}  // namespace

std::string svg_of(const Drawing& drawing, double scale) { return SvgWriter(drawing, scale).take(); }

}  // namespace pulson::draw
