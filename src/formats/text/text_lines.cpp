#include "text_lines.hpp"

#include <charconv>
#include <limits>

#include <fmt/format.h>

namespace pulson::formats {

TextLines::TextLines(const std::string& path, std::string_view text)
    : path_(path), lines_(text::split_lines(path, text)) {
  for (text::TextLine& line : lines_) line.text = text::trim(line.text);
  std::erase_if(lines_, [](const text::TextLine& line) { return line.text.empty(); });
}

text::TextLine TextLines::peek() const {
  if (!at_end()) return lines_[next_];
  return {lines_.empty() ? 1 : lines_.back().number, {}};
}

text::TextLine TextLines::take(std::string_view wanted) {
  if (at_end()) text::fail(path_, peek().number, fmt::format("the file ends where {} is expected", wanted));
  return lines_[next_++];
}

void TextLines::require_end(const std::string& what) const {
  if (!at_end())
    text::fail(path_, peek().number, fmt::format("{} after the {} announced", text::in_quotes(peek().text), what));
}

std::vector<std::string_view> first_lines(std::string_view text, std::size_t count) {
  text = text::without_byte_order_mark(text);
  const char line_end = text::line_end_of(text);
  std::vector<std::string_view> lines;
  while (!text.empty() && lines.size() < count) {
    const std::string_view line = text::trim(text::take_line(text, line_end));
    if (!line.empty()) lines.push_back(line);
  }
  return lines;
}

std::optional<std::size_t> parse_count(std::string_view text) {
  std::size_t count = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, count);
  if (error != std::errc() || stop != end) return std::nullopt;
  return count;
}

std::size_t require_count(const std::string& path, const text::TextLine& line, std::string_view text,
                          std::string_view what) {
  const std::optional<std::size_t> count = parse_count(text);
  if (!count || *count == 0)
    text::fail(path, line.number,
               fmt::format("{} where {}, a whole number from 1, is expected", text::in_quotes(text), what));
  return *count;
}

void PointList::add(std::span<const std::string_view> words, text::CoordinatePlace place) {
  if (words.size() != dimension_)
    text::fail(place.path, place.line,
               fmt::format("landmark {}{} has {}; {} are expected", place.landmark,
                           place.shape.empty() ? "" : " of " + place.shape, text::counted(words.size(), "coordinate"),
                           dimension_));
  for (place.axis = 0; place.axis < dimension_; ++place.axis) {
    const double value = text::parse_coordinate(text::with_decimal_point(words[place.axis]), place);
    coordinates_.push_back(value == missing_ ? std::numeric_limits<double>::quiet_NaN() : value);
  }
}

Points take_points(TextLines& lines, std::size_t count, PointList list, const std::string& shape) {
  const std::string of_shape = shape.empty() ? "" : " of " + shape;
  for (std::size_t i = 1; i <= count; ++i) {
    const text::TextLine line = lines.take(fmt::format("landmark {} of {}{}", i, count, of_shape));
    list.add(text::split_words(line.text), {lines.path(), line.number, std::to_string(i), shape, 0});
  }
  return list.points();
}

std::size_t dimension_of_next(const TextLines& lines, std::size_t others) {
  const text::TextLine line = lines.peek();
  const std::size_t words = text::split_words(line.text).size();
  if (words != others + 2 && words != others + 3)
    text::fail(lines.path(), line.number,
               fmt::format("{} has {}; {} or {} are expected", text::in_quotes(line.text),
                           text::counted(words, "column"), others + 2, others + 3));
  return words - others;
}

}  // namespace pulson::formats
