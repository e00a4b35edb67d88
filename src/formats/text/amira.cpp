// Landmark sets of Amira and Avizo as text (.landmarkAscii): a header with `define Markers N`, then for each set a line
// `@1` and N lines x y z. Each set is a shape.

#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "formats/formats.hpp"
#include "pulson/core/errors.hpp"
#include "text_lines.hpp"

namespace pulson::formats {
namespace {

bool is_amira(std::string_view line) {
  return line.starts_with("# AmiraMesh") || line.starts_with("# Avizo") || line.starts_with("# HyperMesh");
}

bool sniff_amira(std::string_view text) {
  const std::vector<std::string_view> lines = first_lines(text, 1);
  return !lines.empty() && is_amira(lines.front()) && text.find("Markers") != text.npos;
}

/// What the header says.
struct AmiraHeader {
  std::size_t count = 0;
  std::vector<std::string> sets;  ///< `@1`, where the coordinates of each stand
};

/// `Markers { float[3] Coordinates } @1`, also as `Markers { float[3] Coordinates } = @1`
void read_section(const text::TextLine& line, const std::vector<std::string_view>& words, AmiraHeader& header) {
  const bool are_coordinates =
      line.text.find("[3]") != std::string_view::npos && line.text.find("Coordinates") != std::string_view::npos;
  if (are_coordinates && words.back().starts_with('@')) header.sets.emplace_back(words.back());
}

AmiraHeader take_header(TextLines& lines) {
  const text::TextLine first = lines.take("# AmiraMesh");
  if (!is_amira(first.text))
    text::fail(lines.path(), first.number, text::in_quotes(first.text) + " where # AmiraMesh is expected");
  if (first.text.find("ASCII") == std::string_view::npos)
    text::fail(lines.path(), first.number,
               "numbers of Amira as bytes, which are not read; save the landmarks as .landmarkAscii");
  AmiraHeader header;
  while (!lines.at_end() && !lines.peek().text.starts_with('@')) {
    const text::TextLine line = lines.take("the header");
    const std::vector<std::string_view> words = text::split_words(line.text);
    if (words.size() == 3 && words[0] == "define" && words[1] == "Markers")
      header.count = require_count(lines.path(), line, words[2], "the number of landmarks");
    if (words.front() == "Markers") read_section(line, words, header);
  }
  if (header.count == 0 || header.sets.empty())
    text::fail(lines.path(), lines.peek().number,
               "the header has no 'define Markers N' or no 'Markers { float[3] Coordinates } @1'");
  return header;
}

LandmarkFile read_amira(const std::string& path, std::string_view text) {
  TextLines lines(path, text);
  const AmiraHeader header = take_header(lines);
  std::map<std::string, Points, std::less<>> sections;
  while (!lines.at_end()) {
    const text::TextLine mark = lines.take("a section @1");
    const bool is_set = std::find(header.sets.begin(), header.sets.end(), mark.text) != header.sets.end();
    if (is_set) sections[std::string(mark.text)] = take_points(lines, header.count, PointList(3));
    while (!lines.at_end() && !lines.peek().text.starts_with('@')) {
      const text::TextLine other = lines.take("a section");
      if (is_set)
        text::fail(path, other.number,
                   fmt::format("{} after the {} announced", text::in_quotes(other.text),
                               text::counted(header.count, "landmark")));
    }
  }
  LandmarkFile file;
  for (const std::string& set : header.sets) {
    const auto found = sections.find(set);
    if (found == sections.end())
      throw InputError(fmt::format("{}: the section {} is not there", path, text::in_quotes(set)));
    file.shapes.emplace_back().points = found->second;
  }
  return file;
}

}  // namespace

LandmarkFormat amira_format() {
  return {.name = "amira",
          .extensions = {"landmarkascii"},
          .help = "landmark sets of Amira and Avizo as text; each set is a shape",
          .sniff = sniff_amira,
          .read = read_amira};
}

}  // namespace pulson::formats
