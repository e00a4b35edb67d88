// EDMA .xyz: a title, `XYZ` or `XY`, `10L 2 5` (landmarks, whether labels follow, dimensions, specimens), the labels, a
// line for each landmark of each specimen, and at the end perhaps the names of the specimens.

#include <utility>

#include <fmt/format.h>

#include "formats/formats.hpp"
#include "text_lines.hpp"

namespace pulson::io {
namespace {

struct EdmaHeader {
  std::size_t landmarks;
  bool has_labels;
  std::size_t dimension;
  std::size_t specimens;
};

/// @return nothing unless `line` is such a header, with counts from 1 and 1, 2 or 3 dimensions
std::optional<EdmaHeader> parse_header(std::string_view line) {
  const std::vector<std::string_view> words = split_words(line);
  if (words.size() != 3) return std::nullopt;
  const bool has_labels = words[0].ends_with('L') || words[0].ends_with('l');
  const auto landmarks = parse_count(words[0].substr(0, words[0].size() - (has_labels ? 1 : 0)));
  const auto dimension = parse_count(words[1]);
  const auto specimens = parse_count(words[2]);
  if (!landmarks || !dimension || !specimens) return std::nullopt;
  if (*landmarks == 0 || *specimens == 0 || *dimension < 1 || *dimension > 3) return std::nullopt;
  return EdmaHeader{*landmarks, has_labels, *dimension, *specimens};
}

bool is_mark(std::string_view line) {
  const std::string lower = to_lower(line);
  return lower == "xyz" || lower == "xy";
}

std::vector<std::string> take_labels(TextLines& lines, std::size_t count) {
  std::vector<std::string> labels;
  TextLine line = lines.peek();
  while (labels.size() < count) {
    line = lines.take(fmt::format("label {} of {}", labels.size() + 1, count));
    for (const std::string_view word : split_words(line.text)) labels.emplace_back(word);
  }
  if (labels.size() > count)
    fail(lines.path(), line.number,
         fmt::format("{} where {} are announced", counted(labels.size(), "label"), counted(count, "landmark")));
  return labels;
}

bool holds_numbers(std::string_view line, std::size_t count) {
  const std::vector<std::string_view> words = split_words(line);
  if (words.size() != count || count == 1) return false;
  for (const std::string_view word : words)
    if (!is_number(word)) return false;
  return true;
}

void take_names(TextLines& lines, LandmarkFile& file, const EdmaHeader& header) {
  if (lines.at_end()) return;
  if (holds_numbers(lines.peek().text, header.dimension))
    lines.require_end(counted(header.specimens, "specimen") + " of " + counted(header.landmarks, "landmark"));
  if (lines.left() != header.specimens) {
    file.warnings.push_back(fmt::format("{}: {} after the landmarks, which are no names of {}, are not used",
                                        lines.path(), counted(lines.left(), "line"),
                                        counted(header.specimens, "specimen")));
    return;
  }
  for (Landmarks& shape : file.shapes) shape.name = lines.take("a name").text;
}

}  // namespace

bool sniff_edma(std::string_view text) {
  const std::vector<std::string_view> lines = first_lines(text, 3);
  for (std::size_t i = 0; i + 1 < lines.size(); ++i)
    if (is_mark(lines[i]) && parse_header(lines[i + 1])) return true;
  return false;
}

LandmarkFile read_edma(const std::string& path, std::string_view text) {
  TextLines lines(path, text);
  std::string title;
  TextLine line = lines.take("a title");
  if (!is_mark(line.text)) {
    title = line.text;
    line = lines.take("XYZ");
    if (!is_mark(line.text)) fail(path, line.number, in_quotes(line.text) + " where XYZ is expected");
  }
  line = lines.take("a header such as 10L 2 5");
  const std::optional<EdmaHeader> header = parse_header(line.text);
  if (!header)
    fail(path, line.number,
         in_quotes(line.text) + " where the landmarks, dimensions and specimens are expected, such as 10L 2 5");
  std::vector<std::string> labels;
  if (header->has_labels) labels = take_labels(lines, header->landmarks);
  LandmarkFile file;
  for (std::size_t i = 1; i <= header->specimens; ++i) {
    Points points = take_points(lines, header->landmarks, PointList(header->dimension), fmt::format("specimen {}", i));
    Landmarks& shape = file.shapes.emplace_back();
    shape.points = std::move(points);
    shape.labels = labels;
    if (!title.empty()) shape.properties.emplace_back("title", title);
  }
  take_names(lines, file, *header);
  return file;
}

}  // namespace pulson::io
