#pragma once

#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// What an SVG of ours shows in one colour, "#D4621A", faint or not; in its pixels, downwards.
struct SvgParts {
  std::vector<Points> lines;  // 2×M
  std::vector<Points> areas;
  std::vector<Points> rings;  // the centre, of one column
  std::vector<Points> discs;
};

inline Points svg_vertices(std::string line) {
  for (char& c : line)
    if (c == 'L' || c == 'Z') c = ' ';
  std::istringstream numbers(line);
  std::vector<double> values;
  for (double value = 0; numbers >> value;) values.push_back(value);
  return Eigen::Map<const Points>(values.data(), 2, static_cast<Eigen::Index>(values.size() / 2));
}

/// The value of an attribute of the element that begins at `at`; empty where it has none.
inline std::string svg_attribute(const std::string& svg, std::size_t at, const std::string& name) {
  const std::size_t found = svg.find(" " + name + "=\"", at), end = svg.find('>', at);
  if (found == std::string::npos || found > end) return {};
  const std::size_t begin = found + name.size() + 3;
  return svg.substr(begin, svg.find('"', begin) - begin);
}

inline SvgParts svg_parts(const std::string& svg, const std::string& colour) {
  SvgParts parts;
  for (std::size_t at = svg.find("<path "); at != std::string::npos; at = svg.find("<path ", at + 1)) {
    const bool is_area = svg_attribute(svg, at, "fill") == colour;
    if (!is_area && svg_attribute(svg, at, "stroke") != colour) continue;
    std::istringstream lines(svg_attribute(svg, at, "d"));
    for (std::string line; std::getline(lines, line, 'M');)
      if (Points points = svg_vertices(line); points.cols() > 0)
        (is_area ? parts.areas : parts.lines).push_back(std::move(points));
  }
  for (std::size_t at = svg.find("<g "); at != std::string::npos; at = svg.find("<g ", at + 1)) {
    const bool is_disc = svg_attribute(svg, at, "fill") == colour;
    if (!is_disc && svg_attribute(svg, at, "stroke") != colour) continue;
    const std::size_t end = svg.find("</g>", at);
    for (std::size_t i = svg.find("<circle ", at); i < end; i = svg.find("<circle ", i + 1))
      (is_disc ? parts.discs : parts.rings)
          .push_back((Points(2, 1) << std::stod(svg_attribute(svg, i, "cx")), std::stod(svg_attribute(svg, i, "cy")))
                         .finished());
  }
  return parts;
}

/// One text of the SVG, as it is shown.
struct SvgText {
  std::string text;
  double x, y, size, width;
  std::string anchor;
};

inline std::vector<SvgText> svg_texts(const std::string& svg) {
  std::vector<SvgText> texts;
  for (std::size_t at = svg.find("<text "); at != std::string::npos; at = svg.find("<text ", at + 1)) {
    const std::size_t begin = svg.find('>', at) + 1;
    std::string text = svg.substr(begin, svg.find("</text>", begin) - begin);
    for (const auto& [escape, character] : {std::pair("&lt;", "<"), std::pair("&gt;", ">"), std::pair("&amp;", "&")})
      text = std::regex_replace(text, std::regex(escape), character);
    const auto number = [&](const std::string& name) { return std::stod(svg_attribute(svg, at, name)); };
    texts.push_back({text, number("x"), number("y"), number("font-size"), number("textLength"),
                     svg_attribute(svg, at, "text-anchor")});
  }
  return texts;
}

}  // namespace pulson
