#pragma once

// What the readers of landmark formats with a point per line share.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/text.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson::formats {

/// The lines of a file that are not blank, trimmed, one after the other.
class TextLines {
 public:
  TextLines(const std::string& path, std::string_view text);

  const std::string& path() const { return path_; }
  bool at_end() const { return next_ == lines_.size(); }
  std::size_t left() const { return lines_.size() - next_; }

  /// The next line, or at the end an empty one with the number of the last.
  text::TextLine peek() const;

  /// @throws InputError at the end, which says that `wanted` was expected there
  text::TextLine take(std::string_view wanted);

  /// @throws InputError unless the file ends here, after `what` that it announces
  void require_end(const std::string& what) const;

 private:
  const std::string& path_;
  std::vector<text::TextLine> lines_;
  std::size_t next_ = 0;
};

/// The first `count` lines of `text` that are not blank, trimmed; fewer where there are fewer.
std::vector<std::string_view> first_lines(std::string_view text, std::size_t count);

/// A whole number without a sign; nothing where `text` is none or too large a one.
std::optional<std::size_t> parse_count(std::string_view text);

/// A count of at least one. @throws InputError that says what `line` should be
std::size_t require_count(const std::string& path, const text::TextLine& line, std::string_view text,
                          std::string_view what);

/// Points that are gathered one by one, so that the count that a file announces allocates nothing.
class PointList {
 public:
  /// @param missing a number that marks a missing coordinate, besides the marks of is_missing
  explicit PointList(std::size_t dimension, std::optional<double> missing = std::nullopt)
      : dimension_(dimension), missing_(missing) {}

  std::size_t dimension() const { return dimension_; }

  /// Takes decimal commas too. @throws InputError unless there are as many words as dimensions, each a coordinate
  void add(std::span<const std::string_view> words, text::CoordinatePlace place);

  Points points() const { return text::points_from(coordinates_, dimension_); }

 private:
  std::size_t dimension_;
  std::optional<double> missing_;
  std::vector<double> coordinates_;
};

/// Takes `count` lines of coordinates; `shape` is what messages call theirs, or empty.
Points take_points(TextLines& lines, std::size_t count, PointList list, const std::string& shape = {});

/// How many of the words of the next line are coordinates, where `others` are none. @throws InputError unless 2 or 3
std::size_t dimension_of_next(const TextLines& lines, std::size_t others = 0);

/// Whether a line that begins so is a comment: with # or a quote, as some programs write them and nts has them.
inline bool is_tps_comment(std::string_view line) {
  return !line.empty() && std::string_view("#\"'").find(line.front()) != std::string_view::npos;
}

}  // namespace pulson::formats
