#include "core/text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <Eigen/Cholesky>
#include <fmt/format.h>
#include <unistd.h>

#include "first_names.hpp"
#include "paths.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::text {

namespace {

constexpr std::string_view kBlanks = " \t\r";  // a CR within a line, which a lone one does not end

std::string describe(const CoordinatePlace& place) {
  const std::string of_shape = place.shape.empty() ? "" : " of " + place.shape;
  return fmt::format("{}:{}: landmark {}{}: {}", place.path, place.line, place.landmark, of_shape, "xyz"[place.axis]);
}

double parse_number_at(std::string_view text, const CoordinatePlace& place) {
  try {
    return parse_number(text, "");
  } catch (const InputError&) {
    throw InputError(fmt::format("{} is {}; a number is needed", describe(place), in_quotes(text)));
  }
}

void require_text(const std::string& path, const std::string& contents) {
  if (without_byte_order_mark(contents).find_first_not_of(" \t\r\n") == std::string_view::npos)
    throw InputError(path + " is empty");
  if (contents.starts_with("\xFF\xFE") || contents.starts_with("\xFE\xFF"))
    throw InputError(path + " is text in UTF-16; save it in UTF-8");
}

}  // namespace

std::string read_text_file(const std::filesystem::path& path) {
  std::string contents = read_file(path, kMostText);
  require_text(path.string(), contents);
  return contents;
}

std::string read_standard_input() {
  static const std::string contents = read_descriptor(STDIN_FILENO, "standard input", kMostPiped);
  require_text("standard input", contents);
  return contents;
}

std::vector<TextLine> split_lines(const std::string& path, std::string_view text) {
  if (text.find('\0') != std::string_view::npos)
    throw InputError(path + " is not a text file (it holds a zero byte); text must be in UTF-8");
  text = without_byte_order_mark(text);
  if (text.ends_with('\x1A')) text.remove_suffix(1);  // as DOS ended files
  const char line_end = line_end_of(text);
  std::vector<TextLine> lines;
  while (!text.empty()) lines.push_back({lines.size() + 1, take_line(text, line_end)});
  return lines;
}

char line_end_of(std::string_view text) {
  const std::size_t first = text.find('\n');
  return first < text.find_last_not_of(" \t\r\n") ? '\n' : '\r';
}

std::string_view take_line(std::string_view& text, char line_end) {
  const std::size_t end = std::min(line_end == '\n' ? text.find('\n') : text.find_first_of("\r\n"), text.size());
  std::string_view line = text.substr(0, end);
  const std::size_t end_length = text.substr(end).starts_with("\r\n") ? 2 : 1;
  text.remove_prefix(std::min(end + end_length, text.size()));
  if (line_end == '\n') line = line.substr(0, line.find_last_not_of('\r') + 1);
  return line;
}

std::string_view trim(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

std::vector<std::string_view> split_words(std::string_view text) {
  std::vector<std::string_view> words;
  for (text = trim(text); !text.empty(); text = trim(text)) {
    words.push_back(text.substr(0, text.find_first_of(kBlanks)));
    text.remove_prefix(words.back().size());
  }
  return words;
}

std::string to_lower(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

std::string as_one_line(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  std::string shown(text.substr(0, kLongest));
  std::replace_if(
      shown.begin(), shown.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, '?');
  return text.size() > kLongest ? shown + "..." : shown;
}

std::string in_quotes(std::string_view text) { return fmt::format("'{}'", as_one_line(text)); }

std::string with_decimal_point(std::string_view text) {
  std::string number(text);
  const std::size_t comma = number.find(',');
  if (comma != std::string::npos && comma + 1 < number.size() && number.find_first_of(".,", comma + 1) == text.npos &&
      number.find('.') == std::string::npos)
    number[comma] = '.';
  return number;
}

std::string csv_quoted(std::string_view text) {
  std::string field = "\"";
  for (const char c : text) field.append(c == '"' ? 2 : 1, c);
  return field + '"';
}

std::string image_stem(std::string_view image) {
  image.remove_prefix(image.find_last_of("/\\") + 1);
  return std::string(image.substr(0, image.rfind('.')));
}

std::string counted(std::size_t count, std::string_view noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

std::string first_of(std::vector<std::string> names, std::size_t most) {
  const std::size_t more = names.size() - std::min(names.size(), most);
  names.resize(names.size() - more);
  return fmt::format("{}{}", fmt::join(names, ", "), more > 0 ? fmt::format(" and {} more", more) : "");
}

void fail(const std::string& path, std::size_t line, const std::string& message) {
  throw InputError(fmt::format("{}:{}: {}", path, line, message));
}

bool is_missing(std::string_view text) {
  static constexpr std::array<std::string_view, 12> kMarks = {"",     "na",  "n/a",  "nan", "null", "none",
                                                              "#n/a", "#na", "<na>", "-",   "?",    "."};
  return std::find(kMarks.begin(), kMarks.end(), to_lower(text)) != kMarks.end();
}

bool is_number(std::string_view text) {
  // The first letter decides for most words, and exceptions take long where a header names 100,000 columns
  if (text.empty() || std::string_view("+-.0123456789iInN").find(text.front()) == std::string_view::npos) return false;
  try {
    parse_number(text, "");
    return true;
  } catch (const InputError&) {
    return false;
  }
}

double parse_coordinate(std::string_view text, const CoordinatePlace& place) {
  if (is_missing(text)) return kMissing;
  const double value = parse_number_at(text, place);
  if (std::isinf(value))
    throw InputError(fmt::format("{} is {}; a coordinate must be finite", describe(place), in_quotes(text)));
  return std::isnan(value) ? kMissing : value;
}

Eigen::MatrixXd points_from(const std::vector<double>& coordinates, std::size_t dimension) {
  if (dimension == 0) return {};
  return Eigen::MatrixXd::Map(coordinates.data(), static_cast<Eigen::Index>(dimension),
                              static_cast<Eigen::Index>(coordinates.size() / dimension));
}

std::vector<std::string> unless_all_empty(std::vector<std::string> texts) {
  if (std::all_of(texts.begin(), texts.end(), [](const std::string& text) { return text.empty(); })) texts.clear();
  return texts;
}

}  // namespace pulson::text

namespace pulson {

namespace {

/// Whether the two bytes begin a sequence that is too long for its number, a surrogate, or beyond U+10FFFF.
bool is_forbidden(unsigned char lead, unsigned char second) {
  return (lead == 0xE0 && second < 0xA0) || (lead == 0xED && second > 0x9F) || (lead == 0xF0 && second < 0x90) ||
         (lead == 0xF4 && second > 0x8F);
}

}  // namespace

std::size_t utf8_length(std::string_view text, std::size_t i) {
  const auto byte = [text](std::size_t j) { return static_cast<unsigned char>(text[j]); };
  const unsigned char lead = byte(i);
  const std::size_t length = lead < 0x80   ? 1
                             : lead < 0xC2 ? 0
                             : lead < 0xE0 ? 2
                             : lead < 0xF0 ? 3
                             : lead < 0xF5 ? 4
                                           : 0;
  if (i + length > text.size()) return 0;
  for (std::size_t j = i + 1; j < i + length; ++j)
    if (begins_character(text[j])) return 0;
  return length > 2 && is_forbidden(lead, byte(i + 1)) ? 0 : length;
}

bool is_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    if (length == 0) return false;
    i += length;
  }
  return true;
}

std::string utf8_of_windows_1252(std::string_view text) {
  // What 0x80 to 0x9F stand for; the five that stand for nothing become U+FFFD.
  static constexpr std::array<std::uint16_t, 32> kCodes = {
      0x20AC, 0xFFFD, 0x201A, 0x0192, 0x201E, 0x2026, 0x2020, 0x2021, 0x02C6, 0x2030, 0x0160,
      0x2039, 0x0152, 0xFFFD, 0x017D, 0xFFFD, 0xFFFD, 0x2018, 0x2019, 0x201C, 0x201D, 0x2022,
      0x2013, 0x2014, 0x02DC, 0x2122, 0x0161, 0x203A, 0x0153, 0xFFFD, 0x017E, 0x0178};
  std::string result;
  const auto add = [&result](unsigned byte) { result += static_cast<char>(byte); };
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const unsigned code = byte >= 0x80 && byte < 0xA0 ? kCodes[byte - 0x80U] : byte;
    if (code < 0x80) {
      add(code);
    } else if (code < 0x800) {
      add(0xC0 | (code >> 6));
      add(0x80 | (code & 0x3F));
    } else {
      add(0xE0 | (code >> 12));
      add(0x80 | ((code >> 6) & 0x3F));
      add(0x80 | (code & 0x3F));
    }
  }
  return result;
}

namespace {

using Eigen::MatrixXd;

constexpr double kCovarianceRounding = 1e-13;

}  // namespace

void require_finite(std::string_view what, double value) {
  if (!std::isfinite(value)) throw InputError(fmt::format("{} is {}; it must be finite", what, value));
}

// Beyond these nothing can be computed with, whatever it is: squares of lengths that shapes may have, from 1e-100 to
// 1e100, and their inverses lie within.
constexpr double kSmallestScale = 1e-220, kLargestScale = 1e220;

void require_positive(std::string_view what, double value) {
  if (!std::isfinite(value) || !(value > 0))
    throw InputError(fmt::format("{} is {}; it must be a finite number greater than 0", what, value));
  if (value < kSmallestScale || value > kLargestScale)
    throw InputError(fmt::format("{} is {}; it must be from {} to {}", what, value, kSmallestScale, kLargestScale));
}

bool is_covariance(const MatrixXd& r) {
  if (r.size() == 0 || r.rows() != r.cols() || !r.allFinite()) return false;
  if ((r - r.transpose()).cwiseAbs().maxCoeff() > kCovarianceRounding * r.cwiseAbs().maxCoeff()) return false;
  const Eigen::LLT<MatrixXd> root(r);
  if (root.info() != Eigen::Success) return false;
  // Each axis must keep a part of its variance when those before it are known.
  return (root.matrixLLT().diagonal().array().square() > kCovarianceRounding * r.diagonal().array()).all();
}

void require_size(std::string_view what, Eigen::Index rows, Eigen::Index columns, Eigen::Index needed_rows,
                  Eigen::Index needed_columns) {
  if (rows != needed_rows || columns != needed_columns)
    throw InputError(
        fmt::format("{}: a matrix of {} x {}; {} x {} is needed", what, rows, columns, needed_rows, needed_columns));
}

}  // namespace pulson
