// morphologika: sections under their names in brackets, in any order; [rawpoints] has a line for each landmark of each
// individual, with a line `'name` before each individual.

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "formats/formats.hpp"
#include "text_lines.hpp"

namespace pulson::io {
namespace {

constexpr double kMorphologikaMissing = 9999;
constexpr std::array<std::string_view, 10> kSections = {"individuals", "landmarks", "dimensions", "names",
                                                        "labels",      "groups",    "rawpoints",  "labelvalues",
                                                        "wireframe",   "polygons"};

/// The name between brackets, in lower case; empty where `line` is no head of a section.
std::string section_of(std::string_view line) {
  if (!line.starts_with('[') || !line.ends_with(']')) return {};
  return to_lower(trim(line.substr(1, line.size() - 2)));
}

struct Section {
  TextLine head;
  std::vector<TextLine> lines;
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
      fail(path_, find("dimensions").head.number, fmt::format("{} dimensions; 1, 2 or 3 are expected", dimension_));
    read_points();
    read_names();
    read_labels();
    note_unused();
    return std::move(file_);
  }

 private:
  void split_sections() {
    while (!lines_.at_end()) {
      const TextLine head = lines_.take("a section");
      const std::string name = section_of(head.text);
      if (name.empty()) fail(path_, head.number, in_quotes(head.text) + " where a section such as [names] is expected");
      const auto [section, is_new] = sections_.try_emplace(name, Section{head, {}});
      if (!is_new)
        fail(path_, head.number,
             fmt::format("the section [{}] is already on line {}", as_one_line(name), section->second.head.number));
      while (!lines_.at_end() && section_of(lines_.peek().text).empty())
        section->second.lines.push_back(lines_.take("a line"));
    }
  }

  const Section& find(const std::string& name) const {
    const auto section = sections_.find(name);
    if (section == sections_.end()) fail(path_, lines_.peek().number, "there is no section [" + name + "]");
    return section->second;
  }

  std::size_t count_in(const std::string& name) const {
    const Section& section = find(name);
    if (section.lines.size() != 1) fail(path_, section.head.number, "[" + name + "] has not just one line, a count");
    return require_count(path_, section.lines.front(), section.lines.front().text, "the number of " + name);
  }

  void read_points() {
    const Section& section = find("rawpoints");
    auto line = section.lines.begin();
    for (std::size_t i = 1; i <= individuals_; ++i) {
      std::string name;
      while (line != section.lines.end() && line->text.starts_with('\'')) name = trim((line++)->text.substr(1));
      const std::string individual = fmt::format("individual {}", i);
      PointList list(dimension_, kMorphologikaMissing);
      for (std::size_t k = 1; k <= landmarks_; ++k, ++line) {
        if (line == section.lines.end() || line->text.starts_with('\''))
          fail(path_, line == section.lines.end() ? section.head.number : line->number,
               fmt::format("individual {} of {} has {}; {} are announced", i, individuals_, counted(k - 1, "landmark"),
                           landmarks_));
        list.add(split_words(line->text), {path_, line->number, std::to_string(k), individual, 0});
      }
      Landmarks& shape = file_.shapes.emplace_back();
      shape.points = list.points();
      shape.name = std::move(name);
    }
    if (line != section.lines.end())
      fail(path_, line->number,
           fmt::format("{} after the {} of {} each that are announced", in_quotes(line->text),
                       counted(individuals_, "individual"), counted(landmarks_, "landmark")));
  }

  void read_names() {
    if (!sections_.contains("names")) return;
    const Section& section = lines_for_individuals("names");
    for (std::size_t i = 0; i < file_.shapes.size(); ++i) file_.shapes[i].name = section.lines[i].text;
  }

  const Section& lines_for_individuals(const std::string& name) const {
    const Section& section = find(name);
    if (section.lines.size() != individuals_)
      fail(path_, section.head.number,
           fmt::format("[{}] has {} for {}", name, counted(section.lines.size(), "line"),
                       counted(individuals_, "individual")));
    return section;
  }

  /// By tabs where there are any, for then there may be blanks within.
  static std::vector<std::string_view> split_values(std::string_view line) {
    if (line.find('\t') == std::string_view::npos) return split_words(line);
    std::vector<std::string_view> values;
    for (std::size_t begin = 0; begin <= line.size();) {
      const std::size_t end = std::min(line.find('\t', begin), line.size());
      values.push_back(trim(line.substr(begin, end - begin)));
      begin = end + 1;
    }
    return values;
  }

  /// Keeps [labelvalues] under the names of [labels].
  void read_labels() {
    if (!sections_.contains("labelvalues")) return;
    std::vector<std::string> labels;
    if (sections_.contains("labels"))
      for (const TextLine& line : find("labels").lines)
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
        file_.warnings.push_back(
            fmt::format("{}: the section [{}] ({}) is not used", path_, name, counted(section.lines.size(), "line")));
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

}  // namespace

bool sniff_morphologika(std::string_view text) {
  const std::vector<std::string_view> lines = first_lines(text, 1);
  return !lines.empty() && std::find(kSections.begin(), kSections.end(), section_of(lines.front())) != kSections.end();
}

LandmarkFile read_morphologika(const std::string& path, std::string_view text) {
  return MorphologikaReader(path, text).read();
}

}  // namespace pulson::io
