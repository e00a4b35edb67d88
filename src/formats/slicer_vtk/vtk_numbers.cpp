#include "vtk_numbers.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <numeric>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::formats {

namespace {

constexpr std::string_view kSpaces = " \t\r\n\v\f";

template <class T>
T big_endian(const char* bytes) {
  std::array<char, sizeof(T)> raw{};
  std::memcpy(raw.data(), bytes, sizeof(T));
  if constexpr (std::endian::native == std::endian::little) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<T>(raw);
}

template <class T>
constexpr VtkType row(std::string_view name) {
  return {name, sizeof(T), std::is_integral_v<T>,
          [](const char* bytes) { return static_cast<double>(big_endian<T>(bytes)); },
          [](const char* bytes) { return static_cast<VtkId>(big_endian<T>(bytes)); }};
}

constexpr VtkType kInt = row<std::int32_t>("int");

// A binary vtkidtype has four bytes, whatever it has in memory; a long is taken to have eight.
constexpr std::array<VtkType, 14> kVtkTypes = {{
    row<float>("float"),
    row<double>("double"),
    kInt,
    row<std::uint32_t>("unsigned_int"),
    row<std::int64_t>("long"),
    row<std::uint64_t>("unsigned_long"),
    row<std::int64_t>("vtktypeint64"),
    row<std::uint64_t>("vtktypeuint64"),
    row<std::int32_t>("vtkidtype"),
    row<std::int16_t>("short"),
    row<std::uint16_t>("unsigned_short"),
    row<std::int8_t>("char"),
    row<std::int8_t>("signed_char"),
    row<std::uint8_t>("unsigned_char"),
}};

/// Whether the whole of `word` is such a number.
template <class Whole>
bool parse_whole(std::string_view word, Whole& value) {
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return !word.empty() && error == std::errc() && stop == word.data() + word.size();
}

VtkId parse_id(const VtkCursor& cursor, std::string_view word, const VtkBlock& block) {
  VtkId id = 0;
  if (!parse_whole(word, id))
    cursor.fail_here(fmt::format("{} is among the numbers of {}; a whole number is needed", text::in_quotes(word),
                                 text::in_quotes(block.text)));
  return id;
}

/// One string; at least a byte is left.
void skip_binary_string(VtkCursor& cursor, std::string_view name) {
  const VtkPlace place = cursor.here();
  const auto fail_if_longer = [&](std::uint64_t size) {
    if (size > cursor.left())
      cursor.fail_at(place, fmt::format("a string of {} takes {}; the file has {} more", text::in_quotes(name),
                                        text::counted(size, "byte"), cursor.left()));
  };
  std::uint64_t length = static_cast<unsigned char>(*cursor.take_bytes(1));
  const std::uint64_t others = (std::uint64_t{8} >> (length >> 6U)) - 1;
  length &= 0x3FU;
  fail_if_longer(others);
  for (const char* byte = cursor.take_bytes(others); const char c : std::string_view(byte, others))
    length = length << 8U | static_cast<unsigned char>(c);
  fail_if_longer(length);
  cursor.take_bytes(length);
}

}  // namespace

const VtkType& vtk_int() { return kInt; }

const VtkType& vtk_byte() { return kVtkTypes.back(); }

std::string_view VtkCursor::take_line() {
  place_ = here();
  const std::size_t end = std::min(text_.find('\n', at_), text_.size());
  std::string_view taken = text_.substr(at_, end - at_);
  if (taken.ends_with('\r')) taken.remove_suffix(1);
  at_ = std::min(end + 1, text_.size());
  if (end < text_.size()) ++line_;
  return taken;
}

std::string_view VtkCursor::take_word() {
  for (; at_ < text_.size() && kSpaces.find(text_[at_]) != std::string_view::npos; ++at_)
    if (text_[at_] == '\n') ++line_;
  place_ = here();
  const std::size_t end = std::min(text_.find_first_of(kSpaces, at_), text_.size());
  const std::size_t begin = std::exchange(at_, end);
  return text_.substr(begin, end - begin);
}

const char* VtkCursor::take_bytes(std::size_t count) { return text_.data() + std::exchange(at_, at_ + count); }

bool VtkCursor::is_next(std::string_view word) const {
  const std::size_t begin = std::min(text_.find_first_not_of(kSpaces, at_), text_.size());
  return text::to_lower(text_.substr(begin, word.size())) == word;
}

void VtkCursor::fail_at(VtkPlace place, const std::string& message) const {
  if (!is_binary) text::fail(path_, place.line, message);
  throw InputError(fmt::format("{}: byte {}: {}", path_, place.byte, message));
}

std::size_t take_vtk_count(VtkCursor& cursor, std::string_view of) {
  const std::string_view word = cursor.take_word();
  std::size_t count = 0;
  if (!parse_whole(word, count))
    cursor.fail_here(
        fmt::format("{} is followed by {}; a whole number, not negative, is needed", of, text::in_quotes(word)));
  return count;
}

const VtkType& take_vtk_type(VtkCursor& cursor, std::string_view of) {
  const std::string_view word = cursor.take_word();
  const auto* const type =
      std::find_if(kVtkTypes.begin(), kVtkTypes.end(),
                   [name = text::to_lower(word)](const VtkType& known) { return known.name == name; });
  if (type == kVtkTypes.end())
    cursor.fail_here(
        fmt::format("the numbers of {} have the type {}; float, double or a type of whole numbers is needed", of,
                    text::in_quotes(word)));
  return *type;
}

void begin_vtk_numbers(VtkCursor& cursor, const VtkBlock& block, const VtkType& type, std::size_t count,
                       std::size_t each) {
  if (cursor.is_binary) cursor.take_line();
  // In text a number takes two bytes, the last perhaps one.
  const std::size_t most = cursor.is_binary ? cursor.left() / type.size : (cursor.left() + 1) / 2;
  if (count <= most / each) return;
  cursor.fail_at(block.place,
                 fmt::format("{} needs {} numbers{}; the file has {} more", text::in_quotes(block.text), count,
                             each == 1 ? "" : fmt::format(" times {}", each), text::counted(cursor.left(), "byte")));
}

std::string_view take_vtk_number(VtkCursor& cursor, const VtkBlock& block, std::size_t count, std::size_t taken) {
  const std::string_view word = cursor.take_word();
  if (word.empty())
    cursor.fail_at(block.place, fmt::format("{} needs {}; the file ends after {}", text::in_quotes(block.text),
                                            text::counted(count, "number"), taken));
  return word;
}

void skip_vtk_strings(VtkCursor& cursor, std::string_view name, std::size_t count, std::size_t each) {
  const VtkPlace place = cursor.here();
  cursor.take_line();
  for (std::size_t c = 0; c < count; ++c)
    for (std::size_t e = 0; e < each; ++e) {
      if (cursor.left() == 0) {
        if (!cursor.is_binary) return;
        cursor.fail_at(place, fmt::format("the file ends within the strings of {}", text::in_quotes(name)));
      }
      if (cursor.is_binary)
        skip_binary_string(cursor, name);
      else
        cursor.take_line();
    }
}

std::vector<VtkId> take_vtk_ids(VtkCursor& cursor, const VtkBlock& block, const VtkType& type, std::size_t count) {
  if (!type.is_whole) cursor.fail_at(block.place, text::in_quotes(block.text) + " needs a type of whole numbers");
  begin_vtk_numbers(cursor, block, type, count, 1);
  std::vector<VtkId> ids(count);
  for (std::size_t i = 0; i < count; ++i)
    ids[i] = cursor.is_binary ? type.id(cursor.take_bytes(type.size))
                              : parse_id(cursor, take_vtk_number(cursor, block, count, i), block);
  return ids;
}

std::string take_vtk_header(VtkCursor& cursor) {
  const std::string_view first = cursor.take_line();
  if (!first.starts_with(kVtkMagic))
    cursor.fail_here(
        fmt::format("the file begins with {}; {} is expected", text::in_quotes(first), text::in_quotes(kVtkMagic)));
  const std::string_view version = text::trim(first.substr(kVtkMagic.size()));
  const double number = text::is_number(version) ? parse_number(version, "") : 0;
  if (!(number >= 1 && number < 5.2))
    cursor.fail_here(fmt::format("version {} of the format; 1.0 to 5.1 are read", text::in_quotes(version)));
  const std::string_view title = cursor.take_line();
  const std::string_view encoding = text::trim(cursor.take_line());
  const bool is_binary = text::to_lower(encoding) == "binary";
  if (!is_binary && text::to_lower(encoding) != "ascii")
    cursor.fail_here(text::in_quotes(encoding) + " where ASCII or BINARY is expected");
  if (text::to_lower(cursor.take_word()) != "dataset") cursor.fail_here("a line DATASET POLYDATA is needed here");
  const std::string_view kind = cursor.take_word();
  if (text::to_lower(kind) != "polydata")
    cursor.fail_here(fmt::format("the dataset is {}; only POLYDATA is read", text::in_quotes(kind)));
  cursor.is_binary = is_binary;
  for (const char* const axes : {"RAS", "LPS"})
    if (title.find(std::string("SPACE=") + axes) != std::string_view::npos) return axes;
  return {};
}

void skip_vtk_metadata(VtkCursor& cursor) {
  cursor.take_line();
  while (cursor.left() > 0 && !text::trim(cursor.take_line()).empty()) {
  }
}

namespace {

/// `name components tuples type` and the numbers, or lines of text.
void skip_vtk_array(VtkCursor& cursor, std::string_view name) {
  VtkBlock block{cursor.place(), ""};
  const std::size_t components = take_vtk_count(cursor, name);
  const std::size_t tuples = take_vtk_count(cursor, name);
  if (components == 0)
    cursor.fail_at(block.place, fmt::format("the field {} has no components", text::in_quotes(name)));
  if (cursor.is_next("string")) return skip_vtk_strings(cursor, name, tuples, components);
  const VtkType& type = take_vtk_type(cursor, name);
  block.text = fmt::format("{} {} {} {}", name, components, tuples, type.name);
  begin_vtk_numbers(cursor, block, type, tuples, components);
  const std::size_t count = components * tuples;
  if (cursor.is_binary) cursor.take_bytes(count * type.size);
  for (std::size_t i = 0; i < count && !cursor.is_binary; ++i) take_vtk_number(cursor, block, count, i);
}

}  // namespace

void skip_vtk_field(VtkCursor& cursor) {
  cursor.take_word();
  const std::size_t arrays = take_vtk_count(cursor, "FIELD");
  for (std::size_t skipped = 0; skipped < arrays;) {
    const std::string_view name = cursor.take_word();
    if (name.empty()) cursor.fail_here("the file ends within FIELD");
    if (text::to_lower(name) == "metadata") {
      skip_vtk_metadata(cursor);
    } else {
      if (name != "NULL_ARRAY") skip_vtk_array(cursor, name);
      ++skipped;
    }
  }
}

namespace {

/// `count point point ...` of each cell, `size` numbers in all: to version 4.2.
void take_counted(VtkCursor& cursor, VtkCells& cells, std::size_t count, std::size_t size) {
  const std::vector<VtkId> numbers = take_vtk_ids(cursor, cells.section, vtk_int(), size);
  const std::string title = text::in_quotes(cells.section.text);
  std::size_t next = 0;
  cells.begins = {0};
  for (std::size_t c = 0; c < count; ++c) {
    const VtkId length = next < size ? numbers[next++] : -1;
    if (length < 0 || static_cast<std::size_t>(length) > size - next)
      cursor.fail_at(cells.section.place, fmt::format("cell {} of {} does not fit into its numbers", c, title));
    const auto begin = numbers.begin() + static_cast<std::ptrdiff_t>(next);
    cells.points.insert(cells.points.end(), begin, begin + length);
    cells.begins.push_back(std::ssize(cells.points));
    next += static_cast<std::size_t>(length);
  }
  if (next != size)
    cursor.fail_at(cells.section.place, fmt::format("the cells of {} take {} of its numbers", title, next));
}

std::vector<VtkId> take_named(VtkCursor& cursor, std::string_view name, std::size_t count) {
  const std::string_view word = cursor.take_word();
  const VtkPlace place = cursor.place();
  if (text::to_lower(word) != text::to_lower(name))
    cursor.fail_here(fmt::format("{} where {} is expected", text::in_quotes(word), name));
  const VtkType& type = take_vtk_type(cursor, name);
  return take_vtk_ids(cursor, {place, fmt::format("{} {}", name, type.name)}, type, count);
}

/// OFFSETS of the cells, one more than there are, and CONNECTIVITY: from version 5.0.
void take_with_offsets(VtkCursor& cursor, VtkCells& cells, std::size_t begins, std::size_t points) {
  cells.begins = take_named(cursor, "OFFSETS", begins);
  cells.points = take_named(cursor, "CONNECTIVITY", points);
  if (cells.begins.empty()) cells.begins = {0};
  if (cells.begins.front() != 0 || cells.begins.back() != std::ssize(cells.points) ||
      !std::is_sorted(cells.begins.begin(), cells.begins.end()))
    cursor.fail_at(cells.section.place, fmt::format("the offsets of {} do not rise from 0 to {}",
                                                    text::in_quotes(cells.section.text), points));
}

bool joins_points(const VtkCells& cells) { return cells.are_lines() || cells.keyword == "polygons"; }

/// Sets of points that grow together.
class PointSets {
 public:
  explicit PointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }

  std::size_t root(std::size_t a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }

  void join(std::size_t a, std::size_t b) { parent_[root(b)] = root(a); }

 private:
  std::vector<std::size_t> parent_;
};

}  // namespace

VtkCells take_vtk_cells(VtkCursor& cursor, std::string_view keyword) {
  VtkCells cells{{cursor.place(), ""}, text::to_lower(keyword)};
  const std::size_t first = take_vtk_count(cursor, keyword);
  const std::size_t second = take_vtk_count(cursor, keyword);
  cells.section.text = fmt::format("{} {} {}", keyword, first, second);
  if (cursor.is_next("offsets"))
    take_with_offsets(cursor, cells, first, second);
  else
    take_counted(cursor, cells, first, second);
  return cells;
}

void check_vtk_points(const VtkCursor& cursor, const VtkCells& cells, std::size_t count) {
  const auto outside = std::find_if(cells.points.begin(), cells.points.end(), [count](VtkId point) {
    return point < 0 || static_cast<std::size_t>(point) >= count;
  });
  if (outside == cells.points.end()) return;
  const auto after = std::upper_bound(cells.begins.begin(), cells.begins.end(), outside - cells.points.begin());
  cursor.fail_at(cells.section.place, fmt::format("cell {} of {} has the point {}; there are {}, counted from 0",
                                                  after - cells.begins.begin() - 1, text::in_quotes(cells.section.text),
                                                  *outside, text::counted(count, "point")));
}

std::vector<std::size_t> vtk_pieces(const std::vector<VtkCells>& sections, std::size_t count) {
  PointSets sets(count);
  for (const VtkCells& cells : sections)
    if (joins_points(cells)) cells.visit_edges([&](std::size_t a, std::size_t b) { sets.join(a, b); });
  std::vector<std::size_t> piece_of_root(count);
  std::size_t last = 0;
  for (const VtkCells& cells : sections)
    for (std::size_t i = 0; i < cells.points.size() && joins_points(cells); ++i)
      if (std::size_t& piece = piece_of_root[sets.root(static_cast<std::size_t>(cells.points[i]))]; piece == 0)
        piece = ++last;
  std::vector<std::size_t> pieces(count);
  for (std::size_t a = 0; a < count; ++a) pieces[a] = piece_of_root[sets.root(a)];
  return pieces;
}

bool vtk_lines_follow_points(const std::vector<VtkCells>& sections, const std::vector<std::size_t>& pieces) {
  std::vector<std::size_t> size(pieces.size() + 1);
  std::vector<std::size_t> rank(pieces.size());
  for (std::size_t a = 0; a < pieces.size(); ++a) rank[a] = size[pieces[a]]++;
  bool follow = true;
  for (const VtkCells& cells : sections)
    if (cells.are_lines())
      cells.visit_edges([&](std::size_t a, std::size_t b) {
        const std::size_t apart = std::max(rank[a], rank[b]) - std::min(rank[a], rank[b]);
        if (apart > 1 && apart + 1 != size[pieces[a]]) follow = false;
      });
  return follow;
}

}  // namespace pulson::formats
