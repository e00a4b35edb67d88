// morphologika: sections under their names in brackets, in any order; [rawpoints] has a line for each landmark of each
// individual, with a line `'name` before each individual.

// EDMA .xyz: a title, `XYZ` or `XY`, `10L 2 5` (landmarks, whether labels follow, dimensions, specimens), the labels, a
// line for each landmark of each specimen, and at the end perhaps the names of the specimens.

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "formats/formats.hpp"
#include "text_lines.hpp"

namespace pulson::formats {

namespace {

constexpr double kMorphologikaMissing = 9999;
constexpr std::array<std::string_view, 10> kSections = {"individuals", "landmarks", "dimensions", "names",
                                                        "labels",      "groups",    "rawpoints",  "labelvalues",
                                                        "wireframe",   "polygons"};

/// The name between brackets, in lower case; empty where `line` is no head of a section.
std::string section_of(std::string_view line) {
  if (!line.starts_with('[') || !line.ends_with(']')) return {};
  return text::to_lower(text::trim(line.substr(1, line.size() - 2)));
}

struct Section {
  text::TextLine head;
  std::vector<text::TextLine> lines;
};

class MorphologikaReader {
 public:
  MorphologikaReader(const std::string& path, std::string_view text) : path_(path), lines_(path, text) {}

  LandmarkFile read() {
    split_sections();
    individuals_ = count_in("individuals");
    landmarks_ = count_in("landmarks");
    dimension_ = count_in("dimensions");
    if (dimension_ > 3)
      text::fail(path_, find("dimensions").head.number,
                 fmt::format("{} dimensions; 1, 2 or 3 are expected", dimension_));
    read_points();
    read_names();
    read_labels();
    note_unused();
    return std::move(file_);
  }

 private:
  void split_sections() {
    while (!lines_.at_end()) {
      const text::TextLine head = lines_.take("a section");
      const std::string name = section_of(head.text);
      if (name.empty())
        text::fail(path_, head.number, text::in_quotes(head.text) + " where a section such as [names] is expected");
      const auto [section, is_new] = sections_.try_emplace(name, Section{head, {}});
      if (!is_new)
        text::fail(path_, head.number,
                   fmt::format("the section [{}] is already on line {}", text::as_one_line(name),
                               section->second.head.number));
      while (!lines_.at_end() && section_of(lines_.peek().text).empty())
        section->second.lines.push_back(lines_.take("a line"));
    }
  }

  const Section& find(const std::string& name) const {
    const auto section = sections_.find(name);
    if (section == sections_.end()) text::fail(path_, lines_.peek().number, "there is no section [" + name + "]");
    return section->second;
  }

  std::size_t count_in(const std::string& name) const {
    const Section& section = find(name);
    if (section.lines.size() != 1)
      text::fail(path_, section.head.number, "[" + name + "] has not just one line, a count");
    return require_count(path_, section.lines.front(), section.lines.front().text, "the number of " + name);
  }

  void read_points() {
    const Section& section = find("rawpoints");
    auto line = section.lines.begin();
    for (std::size_t i = 1; i <= individuals_; ++i) {
      std::string name;
      while (line != section.lines.end() && line->text.starts_with('\'')) name = text::trim((line++)->text.substr(1));
      const std::string individual = fmt::format("individual {}", i);
      PointList list(dimension_, kMorphologikaMissing);
      for (std::size_t k = 1; k <= landmarks_; ++k, ++line) {
        if (line == section.lines.end() || line->text.starts_with('\''))
          text::fail(path_, line == section.lines.end() ? section.head.number : line->number,
                     fmt::format("individual {} of {} has {}; {} are announced", i, individuals_,
                                 text::counted(k - 1, "landmark"), landmarks_));
        list.add(text::split_words(line->text), {path_, line->number, std::to_string(k), individual, 0});
      }
      Landmarks& shape = file_.shapes.emplace_back();
      shape.points = list.points();
      shape.name = std::move(name);
    }
    if (line != section.lines.end())
      text::fail(path_, line->number,
                 fmt::format("{} after the {} of {} each that are announced", text::in_quotes(line->text),
                             text::counted(individuals_, "individual"), text::counted(landmarks_, "landmark")));
  }

  void read_names() {
    if (!sections_.contains("names")) return;
    const Section& section = lines_for_individuals("names");
    for (std::size_t i = 0; i < file_.shapes.size(); ++i) file_.shapes[i].name = section.lines[i].text;
  }

  const Section& lines_for_individuals(const std::string& name) const {
    const Section& section = find(name);
    if (section.lines.size() != individuals_)
      text::fail(path_, section.head.number,
                 fmt::format("[{}] has {} for {}", name, text::counted(section.lines.size(), "line"),
                             text::counted(individuals_, "individual")));
    return section;
  }

  /// By tabs where there are any, for then there may be blanks within.
  static std::vector<std::string_view> split_values(std::string_view line) {
    if (line.find('\t') == std::string_view::npos) return text::split_words(line);
    std::vector<std::string_view> values;
    for (std::size_t begin = 0; begin <= line.size();) {
      const std::size_t end = std::min(line.find('\t', begin), line.size());
      values.push_back(text::trim(line.substr(begin, end - begin)));
      begin = end + 1;
    }
    return values;
  }

  /// Keeps [labelvalues] under the names of [labels].
  void read_labels() {
    if (!sections_.contains("labelvalues")) return;
    std::vector<std::string> labels;
    if (sections_.contains("labels"))
      for (const text::TextLine& line : find("labels").lines)
        for (const std::string_view word : split_values(line.text)) labels.emplace_back(word);
    const Section& section = lines_for_individuals("labelvalues");
    for (std::size_t i = 0; i < file_.shapes.size(); ++i) {
      auto& properties = file_.shapes[i].properties;
      const std::vector<std::string_view> values = split_values(section.lines[i].text);
      if (labels.size() != values.size() || labels.size() == 1) {
        properties.emplace_back(labels.size() == 1 ? labels.front() : "labelvalues", section.lines[i].text);
        continue;
      }
      for (std::size_t k = 0; k < labels.size(); ++k) properties.emplace_back(labels[k], values[k]);
    }
  }

  void note_unused() {
    for (const auto& [name, section] : sections_) {
      const bool is_read = name != "groups" && name != "wireframe" && name != "polygons" &&
                           std::find(kSections.begin(), kSections.end(), name) != kSections.end();
      if (!is_read && !section.lines.empty())
        file_.warnings.push_back(fmt::format("{}: the section [{}] ({}) is not used", path_, text::as_one_line(name),
                                             text::counted(section.lines.size(), "line")));
    }
  }

  const std::string& path_;
  TextLines lines_;
  std::map<std::string, Section> sections_;
  std::size_t individuals_ = 0;
  std::size_t landmarks_ = 0;
  std::size_t dimension_ = 0;
  LandmarkFile file_;
};

bool sniff_morphologika(std::string_view text) {
  const std::vector<std::string_view> lines = first_lines(text, 1);
  return !lines.empty() && std::find(kSections.begin(), kSections.end(), section_of(lines.front())) != kSections.end();
}

LandmarkFile read_morphologika(const std::string& path, std::string_view text) {
  return MorphologikaReader(path, text).read();
}

struct EdmaHeader {
  std::size_t landmarks;
  bool has_labels;
  std::size_t dimension;
  std::size_t specimens;
};

/// @return nothing unless `line` is such a header, with counts from 1 and 1, 2 or 3 dimensions
std::optional<EdmaHeader> parse_header(std::string_view line) {
  const std::vector<std::string_view> words = text::split_words(line);
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
  const std::string lower = text::to_lower(line);
  return lower == "xyz" || lower == "xy";
}

std::vector<std::string> take_labels(TextLines& lines, std::size_t count) {
  std::vector<std::string> labels;
  text::TextLine line = lines.peek();
  while (labels.size() < count) {
    line = lines.take(fmt::format("label {} of {}", labels.size() + 1, count));
    for (const std::string_view word : text::split_words(line.text)) labels.emplace_back(word);
  }
  if (labels.size() > count)
    text::fail(lines.path(), line.number,
               fmt::format("{} where {} are announced", text::counted(labels.size(), "label"),
                           text::counted(count, "landmark")));
  return labels;
}

bool holds_numbers(std::string_view line, std::size_t count) {
  const std::vector<std::string_view> words = text::split_words(line);
  if (words.size() != count || count == 1) return false;
  for (const std::string_view word : words)
    if (!text::is_number(word)) return false;
  return true;
}

void take_names(TextLines& lines, LandmarkFile& file, const EdmaHeader& header) {
  if (lines.at_end()) return;
  if (holds_numbers(lines.peek().text, header.dimension))
    lines.require_end(text::counted(header.specimens, "specimen") + " of " +
                      text::counted(header.landmarks, "landmark"));
  if (lines.left() != header.specimens) {
    file.warnings.push_back(fmt::format("{}: {} after the landmarks, which are no names of {}, are not used",
                                        lines.path(), text::counted(lines.left(), "line"),
                                        text::counted(header.specimens, "specimen")));
    return;
  }
  for (Landmarks& shape : file.shapes) shape.name = lines.take("a name").text;
}

bool sniff_edma(std::string_view text) {
  const std::vector<std::string_view> lines = first_lines(text, 3);
  for (std::size_t i = 0; i + 1 < lines.size(); ++i)
    if (is_mark(lines[i]) && parse_header(lines[i + 1])) return true;
  return false;
}

LandmarkFile read_edma(const std::string& path, std::string_view text) {
  TextLines lines(path, text);
  std::string title;
  text::TextLine line = lines.take("a title");
  if (!is_mark(line.text)) {
    title = line.text;
    line = lines.take("XYZ");
    if (!is_mark(line.text)) text::fail(path, line.number, text::in_quotes(line.text) + " where XYZ is expected");
  }
  line = lines.take("a header such as 10L 2 5");
  const std::optional<EdmaHeader> header = parse_header(line.text);
  if (!header)
    text::fail(
        path, line.number,
        text::in_quotes(line.text) + " where the landmarks, dimensions and specimens are expected, such as 10L 2 5");
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

}  // namespace

LandmarkFormat morphologika_format() {
  return {.name = "morphologika",
          .extensions = {"txt"},
          .help = "morphologika text: [individuals], [landmarks], [dimensions], [names], [rawpoints]; several shapes",
          .sniff = sniff_morphologika,
          .read = read_morphologika};
}

LandmarkFormat edma_format() {
  return {.name = "edma",
          .extensions = {"xyz"},
          .help = "EDMA text: title, XYZ, 10L 2 5, labels, coordinates; several shapes",
          .sniff = sniff_edma,
          .read = read_edma};
}

}  // namespace pulson::formats
