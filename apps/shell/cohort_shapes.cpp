#include "cohort_shapes.hpp"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <map>
#include <set>
#include <string_view>

#include <fmt/format.h>

#include "core/first_names.hpp"
#include "core/landmark_pairs.hpp"
#include "core/shape_frames.hpp"
#include "core/text.hpp"
#include "messages.hpp"
#include "picture_sizes.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson {

std::vector<Landmarks> read_shapes(const std::vector<std::string>& addresses, const formats::ReadOptions& options,
                                   std::vector<std::string>& notes) {
  std::vector<Landmarks> all;
  for (const std::string& address : addresses) {
    formats::LandmarkFile file = read_addressed_shapes(address, options);
    notes.insert(notes.end(), file.warnings.begin(), file.warnings.end());
    std::move(file.shapes.begin(), file.shapes.end(), std::back_inserter(all));
  }
  return all;
}

void leave_out_undigitised(std::vector<Landmarks>& shapes) {
  std::vector<std::string> names;
  for (const Landmarks& shape : shapes)
    if (is_undigitised(shape)) names.push_back(fmt::format("{} ({})", quoted_line(shape.name), shape.source));
  if (names.empty()) return;
  constexpr std::size_t kMostNamed = 8;
  const std::size_t count = names.size();
  print_warning(
      fmt::format("{} of {} shapes {} left out, whose landmarks are all at one point or missing, as where "
                  "nothing was digitised: {}",
                  count, shapes.size(), count == 1 ? "is" : "are", text::first_of(std::move(names), kMostNamed)));
  std::erase_if(shapes, is_undigitised);
}

void require_digitised(const Landmarks& shape) {
  if (is_undigitised(shape))
    throw InputError(fmt::format("{} ({}): all landmarks are at one point or missing, as where nothing was digitised",
                                 shape.source, quoted_line(shape.name)));
}

void CohortNotes::add(std::vector<std::string> notes) {
  if (first_.empty())
    first_ = std::move(notes);
  else if (!notes.empty())
    ++others_;
}

std::vector<std::string> CohortNotes::lines() && {
  if (others_ > 0) first_.back() += fmt::format("; likewise for {} more shapes", others_);
  return std::move(first_);
}

void put_in_order_of(const Landmarks& first, std::vector<Landmarks>& shapes, bool by_order,
                     std::vector<std::string>& notes) {
  const PairBy by = by_order ? PairBy::kOrder : PairBy::kNames;
  CohortNotes of_shapes;
  Landmarks reference = first;
  std::vector<Landmarks*> all{&reference};
  for (Landmarks& shape : shapes) all.push_back(&shape);
  find_picture_sizes(all);
  for (Landmarks& shape : shapes) {
    std::vector<std::string> of_shape;
    shape = in_order_of(first, in_frame_of(first, shape, of_shape), of_shape, by);
    of_shapes.add(std::move(of_shape));
  }
  const std::vector<std::string> lines = std::move(of_shapes).lines();
  notes.insert(notes.end(), lines.begin(), lines.end());
}

void prepare_to_write(const formats::LandmarkFormat& format, formats::LandmarkFile& file,
                      std::vector<std::string>& notes) {
  std::vector<Landmarks*> all;
  for (Landmarks& shape : file.shapes) all.push_back(&shape);
  find_picture_sizes(all);
  if (format.name == "json" || all.empty()) return;
  const bool y_down = format.y_down.value_or(file.shapes.front().frame.y_down);
  const auto reference = std::find_if(file.shapes.begin(), file.shapes.end(), [&](const Landmarks& shape) {
    return shape.dimension() == 2 && shape.frame.y_down == y_down;
  });
  if (reference == file.shapes.end()) return;  // the writer converts all alike
  const Landmarks first = *reference;
  for (Landmarks& shape : file.shapes) shape = in_frame_of(first, shape, notes);
}

std::vector<std::string> notes_of_names(const std::vector<Landmarks>& shapes) {
  std::map<std::string_view, int> counts;
  for (const Landmarks& shape : shapes) ++counts[shape.name];
  const auto repeats = [](const auto& entry) { return entry.second > 1; };
  const auto first = std::find_if(counts.begin(), counts.end(), repeats);
  if (first == counts.end()) return {};
  const auto more = std::count_if(std::next(first), counts.end(), repeats);
  return {fmt::format("{} shapes are named {}{}; tables list them in their order", first->second,
                      text::in_quotes(first->first), more > 0 ? fmt::format(", and {} more names repeat", more) : "")};
}

namespace {

constexpr std::size_t kLongestName = 100;  // bytes; file systems allow 255

// Bytes of UTF-8 beyond ASCII stay.
bool may_be_in_name(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte >= 0x80U || std::isalnum(byte) != 0 || c == '.' || c == '_' || c == '-';
}

// A name that Windows keeps for a device, with an extension or without: `NUL`, `com1.txt`.
bool is_reserved(std::string_view name) {
  const std::string stem = text::to_lower(name.substr(0, name.find('.')));
  static const std::set<std::string, std::less<>> kDevices = {"con", "prn", "aux", "nul"};
  const bool is_port = stem.size() == 4 && (stem.starts_with("com") || stem.starts_with("lpt")) &&
                       text::is_digit(stem.back()) && stem.back() != '0';
  return is_port || kDevices.contains(stem);
}

std::string folder_name(const Landmarks& shape, std::size_t number) {
  std::string name = shape.name.empty() ? fmt::to_string(number) : shape.name;
  if (!is_utf8(name)) name = utf8_of_windows_1252(name);
  for (char& c : name)
    if (!may_be_in_name(c)) c = '_';
  if (name.front() == '.' || name.front() == '-') name.front() = '_';
  std::size_t length = std::min(name.size(), kLongestName);
  while (length < name.size() && !begins_character(name[length])) --length;
  name.resize(length);
  if (name.back() == '.') name.back() = '_';  // Windows leaves it out
  return is_reserved(name) ? "_" + name : name;
}

}  // namespace

std::vector<std::string> folder_names(const std::vector<Landmarks>& shapes, const std::vector<std::string>& others) {
  std::vector<std::string> names;
  std::set<std::string> taken;  // in lower case, as some file systems do not distinguish it
  for (const std::string& other : others) taken.insert(text::to_lower(other));
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    const std::string name = folder_name(shapes[s], s + 1);
    std::string free = name;
    for (int k = 2; !taken.insert(text::to_lower(free)).second; ++k) free = fmt::format("{}_{}", name, k);
    names.push_back(free);
  }
  return names;
}

}  // namespace pulson
