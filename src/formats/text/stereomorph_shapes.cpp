// The shape files of StereoMorph: elements like those of XML, `<name type=matrix ncol=2 ..>`, with a line for each row.
// Landmarks are those of landmarks.pixel or else of landmarks.scaled; elements of one line are kept as properties.

#include <algorithm>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "formats/formats.hpp"
#include "pulson/core/name_table.hpp"
#include "text_lines.hpp"

namespace pulson::formats {
namespace {

struct Element {
  std::string name;
  std::string attributes;  // lower case
  std::string parent;      // empty at the top
  std::size_t line;
  std::vector<text::TextLine> rows;
};

/// Where the name in a tag ends: before the first `attribute=`. The names of curves may hold blanks.
std::size_t name_end_of(std::string_view tag) {
  const std::size_t equals = tag.find('=');
  if (equals == std::string_view::npos) return tag.size();
  const std::size_t attribute_end = text::trim(tag.substr(0, equals)).size();
  const std::size_t blank = tag.substr(0, attribute_end).find_last_of(" \t");
  return blank == std::string_view::npos ? tag.size() : blank;
}

/// Attributes in lower case, without the blanks around `=`.
std::string attributes_of(std::string_view text) {
  std::string attributes;
  for (const char c : text::to_lower(text)) {
    if (c == '=') attributes.resize(text::trim(attributes).size());
    if ((c == ' ' || c == '\t') && (attributes.empty() || attributes.back() == '=')) continue;
    attributes += c;
  }
  return attributes;
}

/// The value of `key=`; nothing where it is not there.
std::optional<std::string> attribute_of(const Element& element, const std::string& key) {
  for (const std::string_view word : text::split_words(element.attributes))
    if (word.starts_with(key + "=")) return std::string(word.substr(key.size() + 1));
  return std::nullopt;
}

/// All elements, in the order in which they end.
class Elements {
 public:
  Elements(const std::string& path, std::string_view text) : lines_(path, text) {}

  std::vector<Element> read() {
    while (!lines_.at_end()) {
      const text::TextLine line = lines_.take("an element");
      std::string_view rest = line.text;
      while (!rest.empty()) rest = text::trim(read_part(line.number, rest));
    }
    if (!open_.empty())
      text::fail(lines_.path(), open_.back().line,
                 fmt::format("<{}> has no end in this file", text::as_one_line(open_.back().name)));
    return std::move(closed_);
  }

 private:
  /// Reads a tag, or text up to one. @return what follows in the line
  std::string_view read_part(std::size_t number, std::string_view rest) {
    if (!rest.starts_with('<')) {
      const std::string_view row = text::trim(rest.substr(0, rest.find("</")));
      if (open_.empty()) text::fail(lines_.path(), number, text::in_quotes(row) + " is outside of all elements");
      open_.back().rows.push_back({number, row});
      return rest.substr(std::min(rest.find("</"), rest.size()));
    }
    const std::size_t end = rest.find('>');
    if (end == std::string_view::npos) text::fail(lines_.path(), number, text::in_quotes(rest) + " has no '>'");
    read_tag(number, text::trim(rest.substr(1, end - 1)));
    return rest.substr(end + 1);
  }

  void read_tag(std::size_t number, std::string_view tag) {
    if (!tag.starts_with('/')) {
      const std::string parent = open_.empty() ? "" : open_.back().name;
      const std::size_t name_end = name_end_of(tag);
      open_.push_back(
          {std::string(text::trim(tag.substr(0, name_end))), attributes_of(tag.substr(name_end)), parent, number, {}});
      return;
    }
    const std::string_view name = text::trim(tag.substr(1));
    if (open_.empty() || open_.back().name != name)
      text::fail(lines_.path(), number,
                 fmt::format("</{}> where {} is expected", text::as_one_line(name),
                             open_.empty() ? "nothing" : "</" + text::as_one_line(open_.back().name) + ">"));
    closed_.push_back(std::move(open_.back()));
    open_.pop_back();
  }

  TextLines lines_;
  std::vector<Element> open_;
  std::vector<Element> closed_;
};

void require_announced_rows(const std::string& path, const Element& element) {
  const std::optional<std::string> announced = attribute_of(element, "nrow");
  if (announced && parse_count(*announced) != element.rows.size())
    text::fail(path, element.line,
               fmt::format("<{}> has {}, but says nrow={}", text::as_one_line(element.name),
                           text::counted(element.rows.size(), "row"), text::as_one_line(*announced)));
}

std::size_t dimension_of(const std::string& path, const Element& element) {
  const auto names_of_rows = attribute_of(element, "rownames");
  const auto is_named = names_of_rows ? names_of_rows : attribute_of(element, "names");  // the latter in older files
  const std::size_t names = is_named == "true" ? 1 : 0;
  const std::size_t columns = text::split_words(element.rows.front().text).size() - names;
  const std::optional<std::string> announced = attribute_of(element, "ncol");
  const std::size_t d = announced ? parse_count(*announced).value_or(0) : columns;
  if (d != 2 && d != 3)
    text::fail(path, element.line,
               fmt::format("<{}> has {} columns; 2 or 3 are expected", text::as_one_line(element.name), d));
  return d;
}

/// The points of a matrix, and what stands before the coordinates of each: its label, which may hold blanks.
std::pair<Points, std::vector<std::string>> points_of(const std::string& path, const Element& element) {
  require_announced_rows(path, element);
  if (element.rows.empty()) return {};
  const std::size_t d = dimension_of(path, element);
  PointList list(d);
  std::vector<std::string> labels;
  for (const text::TextLine& row : element.rows) {
    const std::vector<std::string_view> words = text::split_words(row.text);
    const std::size_t names = words.size() - std::min(d, words.size());
    const std::string_view label =
        names == 0 ? std::string_view()
                   : row.text.substr(0, static_cast<std::size_t>(words[names].data() - row.text.data()));
    labels.emplace_back(text::trim(label));
    const std::string called = labels.back().empty() ? std::to_string(labels.size()) : text::in_quotes(labels.back());
    list.add(std::span(words).subspan(names), {path, row.number, called, "", 0});
  }
  return {list.points(), text::unless_all_empty(std::move(labels))};
}

const Element* find(const std::vector<Element>& elements, std::string_view name) {
  const auto found =
      std::find_if(elements.begin(), elements.end(), [&](const Element& element) { return element.name == name; });
  return found == elements.end() || found->rows.empty() ? nullptr : &*found;
}

std::string text_of(const Element* element) {
  if (element == nullptr || text::is_missing(element->rows.front().text)) return {};
  return std::string(element->rows.front().text);
}

void keep_properties(const std::vector<Element>& elements, Landmarks& shape) {
  for (const Element& element : elements) {
    if (element.rows.size() != 1 || element.rows.front().number != element.line || element.name == "image.name")
      continue;
    if (element.name == "scaling" && shape.scale) continue;
    shape.properties.emplace_back(element.name, element.rows.front().text);
  }
}

bool sniff_stereomorph(std::string_view text) {
  const std::vector<std::string_view> lines = first_lines(text, 1);
  return !lines.empty() && (lines.front().starts_with("<shapes") || lines.front().starts_with("<landmarks."));
}

LandmarkFile read_stereomorph(const std::string& path, std::string_view text) {
  const std::vector<Element> elements = Elements(path, text).read();
  const Element* const pixels = find(elements, "landmarks.pixel");
  const Element* const landmarks = pixels != nullptr ? pixels : find(elements, "landmarks.scaled");
  if (landmarks == nullptr)
    text::fail(path, 1, "there are no landmarks: neither <landmarks.pixel> nor <landmarks.scaled> has rows");
  const bool is_scaled = pixels == nullptr;
  LandmarkFile file;
  Landmarks& shape = file.shapes.emplace_back();
  std::tie(shape.points, shape.labels) = points_of(path, *landmarks);
  shape.image = text_of(find(elements, "image.name"));
  if (is_scaled) {
    file.units = text_of(find(elements, "scaling.units"));
    file.warnings.push_back(path + ": the landmarks are those of <landmarks.scaled>; there are none in pixels");
  } else if (const std::string scale = text_of(find(elements, "scaling")); text::is_number(scale)) {
    shape.scale = parse_number(scale, "");
  }
  for (const Element& element : elements)
    if (element.parent == (is_scaled ? "curves.scaled" : "curves.pixel") && !element.rows.empty())
      shape.curves.push_back(points_of(path, element).first);
  keep_properties(elements, shape);
  return file;
}

}  // namespace

LandmarkFormat stereomorph_format() {
  return {.name = "stereomorph",
          .extensions = {"txt"},
          .help = "StereoMorph shape: <landmarks.pixel> or else <landmarks.scaled>; <curves.pixel>",
          .sniff = sniff_stereomorph,
          .read = read_stereomorph,
          .y_down = true};
}

}  // namespace pulson::formats
