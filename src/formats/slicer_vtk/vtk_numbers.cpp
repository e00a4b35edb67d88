#include "vtk_numbers.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::io {
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
    cursor.fail_here(
        fmt::format("{} is among the numbers of {}; a whole number is needed", in_quotes(word), in_quotes(block.text)));
  return id;
}

/// One string; at least a byte is left.
void skip_binary_string(VtkCursor& cursor, std::string_view name) {
  const VtkPlace place = cursor.here();
  const auto fail_if_longer = [&](std::uint64_t size) {
    if (size > cursor.left())
      cursor.fail_at(place, fmt::format("a string of {} takes {}; the file has {} more", in_quotes(name),
                                        counted(size, "byte"), cursor.left()));
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
  return to_lower(text_.substr(begin, word.size())) == word;
}

void VtkCursor::fail_at(VtkPlace place, const std::string& message) const {
  if (!is_binary) fail(path_, place.line, message);
  throw InputError(fmt::format("{}: byte {}: {}", path_, place.byte, message));
}

std::size_t take_vtk_count(VtkCursor& cursor, std::string_view of) {
  const std::string_view word = cursor.take_word();
  std::size_t count = 0;
  if (!parse_whole(word, count))
    cursor.fail_here(fmt::format("{} is followed by {}; a whole number, not negative, is needed", of, in_quotes(word)));
  return count;
}

const VtkType& take_vtk_type(VtkCursor& cursor, std::string_view of) {
  const std::string_view word = cursor.take_word();
  const auto* const type = std::find_if(kVtkTypes.begin(), kVtkTypes.end(),
                                        [name = to_lower(word)](const VtkType& known) { return known.name == name; });
  if (type == kVtkTypes.end())
    cursor.fail_here(fmt::format(
        "the numbers of {} have the type {}; float, double or a type of whole numbers is needed", of, in_quotes(word)));
  return *type;
}

void begin_vtk_numbers(VtkCursor& cursor, const VtkBlock& block, const VtkType& type, std::size_t count,
                       std::size_t each) {
  if (cursor.is_binary) cursor.take_line();
  // In text a number takes two bytes, the last perhaps one.
  const std::size_t most = cursor.is_binary ? cursor.left() / type.size : (cursor.left() + 1) / 2;
  if (count <= most / each) return;
  cursor.fail_at(block.place,
                 fmt::format("{} needs {} numbers{}; the file has {} more", in_quotes(block.text), count,
                             each == 1 ? "" : fmt::format(" times {}", each), counted(cursor.left(), "byte")));
}

std::string_view take_vtk_number(VtkCursor& cursor, const VtkBlock& block, std::size_t count, std::size_t taken) {
  const std::string_view word = cursor.take_word();
  if (word.empty())
    cursor.fail_at(block.place, fmt::format("{} needs {}; the file ends after {}", in_quotes(block.text),
                                            counted(count, "number"), taken));
  return word;
}

void skip_vtk_strings(VtkCursor& cursor, std::string_view name, std::size_t count, std::size_t each) {
  const VtkPlace place = cursor.here();
  cursor.take_line();
  for (std::size_t c = 0; c < count; ++c)
    for (std::size_t e = 0; e < each; ++e) {
      if (cursor.left() == 0) {
        if (!cursor.is_binary) return;
        cursor.fail_at(place, fmt::format("the file ends within the strings of {}", in_quotes(name)));
      }
      if (cursor.is_binary)
        skip_binary_string(cursor, name);
      else
        cursor.take_line();
    }
}

std::vector<VtkId> take_vtk_ids(VtkCursor& cursor, const VtkBlock& block, const VtkType& type, std::size_t count) {
  if (!type.is_whole) cursor.fail_at(block.place, in_quotes(block.text) + " needs a type of whole numbers");
  begin_vtk_numbers(cursor, block, type, count, 1);
  std::vector<VtkId> ids(count);
  for (std::size_t i = 0; i < count; ++i)
    ids[i] = cursor.is_binary ? type.id(cursor.take_bytes(type.size))
                              : parse_id(cursor, take_vtk_number(cursor, block, count, i), block);
  return ids;
}

}  // namespace pulson::io
