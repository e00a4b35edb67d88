// Landmarks of CMTK, the Computational Morphometry Toolkit: lines `x y z name`.

#include <algorithm>
#include <string>
#include <vector>

#include "core/text.hpp"
#include "formats/annotated_shapes.hpp"
#include "formats/formats.hpp"
#include "text_lines.hpp"

namespace pulson::formats {
namespace {

bool is_cmtk_comment(std::string_view line) { return line.starts_with('#'); }

/// Three numbers and a name that is none.
bool is_landmark(std::string_view line) {
  const std::vector<std::string_view> words = text::split_words(line);
  return words.size() >= 4 && std::all_of(words.begin(), words.begin() + 3, text::is_number) &&
         !text::is_number(words[3]) && !text::is_missing(words[3]) &&
         line.find_first_of(",;|") == std::string_view::npos;
}

bool sniff_cmtk(std::string_view text) {
  constexpr std::size_t kTelling = 16;  // lines
  std::vector<std::string_view> lines = first_lines(text, kTelling);
  std::erase_if(lines, is_cmtk_comment);
  return !lines.empty() && std::all_of(lines.begin(), lines.end(), is_landmark);
}

LandmarkFile read_cmtk(const std::string& path, std::string_view text) {
  TextLines lines(path, text);
  PointList points(3);
  Landmarks shape;
  while (!lines.at_end()) {
    const text::TextLine line = lines.take("a landmark");
    if (is_cmtk_comment(line.text)) continue;
    const std::vector<std::string_view> words = text::split_words(line.text);
    if (words.size() < 4) text::fail(path, line.number, text::in_quotes(line.text) + " where x y z name is expected");
    shape.labels.emplace_back(words[3].data(), line.text.data() + line.text.size());
    points.add(std::span(words).first(3), {path, line.number, text::in_quotes(shape.labels.back()), "", 0});
  }
  if (shape.labels.empty()) text::fail(path, 1, "there are no landmarks in this file");
  shape.points = points.points();
  LandmarkFile file;
  file.shapes.push_back(std::move(shape));
  drop_repeated_labels(path, file);
  return file;
}

}  // namespace

LandmarkFormat cmtk_format() {
  return {.name = "cmtk",
          .extensions = {},
          .help = "landmarks of CMTK: lines x y z name",
          .sniff = sniff_cmtk,
          .read = read_cmtk};
}

}  // namespace pulson::formats
