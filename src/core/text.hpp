#pragma once

// What the readers of text formats share: lines, words, numbers and the wording of errors.

#include <cstddef>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace pulson::text {

/// All of a file of up to kMostText bytes, as read_file() reads it. @throws InputError if it cannot be read, holds only
/// blanks, or begins as text in UTF-16 does.
std::string read_text_file(const std::filesystem::path& path);

/// The path of standard input, as `-` is, behind which an address may go on: `/dev/stdin#3`.
inline constexpr std::string_view kStandardInput = "/dev/stdin";

/// All of standard input, which is read once and kept. @throws InputError as read_text_file does
std::string read_standard_input();

/// A line of a file, without its end, and its number from 1.
struct TextLine {
  std::size_t number;
  std::string_view text;
};

/// What ends the lines of `text`: LF where one stands between two lines (also as CRLF; a lone CR is then a blank
/// within a line), else CR.
char line_end_of(std::string_view text);

/// Takes the first line off `text`, without its end.
std::string_view take_line(std::string_view& text, char line_end);

/// The lines of `text`, which may end in LF, CRLF or CR (line_end_of) and begin with a byte order mark.
/// @throws InputError if it holds a zero byte: then it is no text, or UTF-16.
std::vector<TextLine> split_lines(const std::string& path, std::string_view text);

/// Some editors put it before the text.
inline constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// `text` without the marks before it; some programs put one before that of another.
inline std::string_view without_byte_order_mark(std::string_view text) {
  while (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  return text;
}

/// A coordinate that was not measured.
inline constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

inline constexpr std::string_view kAxisLetters = "xyz";

inline bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::string_view trim(std::string_view text);
std::vector<std::string_view> split_words(std::string_view text);
std::string to_lower(std::string_view text);

/// `text` made fit for a one-line message: long text is cut, control characters become '?'.
std::string as_one_line(std::string_view text);

/// The same in quotes.
std::string in_quotes(std::string_view text);

/// A field of a csv file in double quotes, those in it doubled.
std::string csv_quoted(std::string_view text);

/// `text` with a decimal point for a decimal comma, where it has one comma within digits and no point.
std::string with_decimal_point(std::string_view text);

/// The name of an image's file without folders, of either kind, and extension: `C:\photos\fish 1.jpg` → `fish 1`.
std::string image_stem(std::string_view image);

/// "1 landmark", "2 landmarks".
std::string counted(std::size_t count, std::string_view noun);

/// @throws InputError "path:line: message".
[[noreturn]] void fail(const std::string& path, std::size_t line, const std::string& message);

/// Where a coordinate stands, for messages alone.
struct CoordinatePlace {
  const std::string& path;
  std::size_t line;
  std::string landmark;  ///< its label in quotes or its number
  std::string shape;     ///< as in "shape 3", may be empty
  std::size_t axis;      ///< 0, 1, 2
};

/// Whether `text` is one of the usual marks of a missing value: nothing, NA, NaN, ...
bool is_missing(std::string_view text);

/// Whether the whole of `text` is a number.
bool is_number(std::string_view text);

/// A finite number, or NaN where the value is missing (is_missing, or a number that is NaN). @throws InputError that
/// names the place.
double parse_coordinate(std::string_view text, const CoordinatePlace& place);

/// Points whose coordinates follow one another, `dimension` of each; of none there are no points.
Eigen::MatrixXd points_from(const std::vector<double>& coordinates, std::size_t dimension);

/// The texts; nothing where all of them are empty.
std::vector<std::string> unless_all_empty(std::vector<std::string> texts);

}  // namespace pulson::text

namespace pulson {

/// Bytes of the UTF-8 sequence that starts at byte `i`, 0 if it is broken.
std::size_t utf8_length(std::string_view text, std::size_t i);

/// Whether a byte of UTF-8 begins a character.
constexpr bool begins_character(char byte) { return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U; }

bool is_utf8(std::string_view text);

/// Text in Windows-1252, which holds ISO 8859-1, in UTF-8.
std::string utf8_of_windows_1252(std::string_view text);

/// @throws InputError that says what the number is of
void require_finite(std::string_view what, double value);
void require_positive(std::string_view what, double value);

/// Whether `r` is finite, symmetric and positive definite, up to rounding.
bool is_covariance(const Eigen::MatrixXd& r);

/// @throws InputError that says what the matrix is of, its size and the size that it must have
void require_size(std::string_view what, Eigen::Index rows, Eigen::Index columns, Eigen::Index needed_rows,
                  Eigen::Index needed_columns);

/// The same for a matrix or vector.
template <class Matrix>
void require_size(std::string_view what, const Eigen::EigenBase<Matrix>& matrix, Eigen::Index needed_rows,
                  Eigen::Index needed_columns) {
  require_size(what, matrix.rows(), matrix.cols(), needed_rows, needed_columns);
}

}  // namespace pulson
