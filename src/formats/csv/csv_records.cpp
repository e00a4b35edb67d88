
#include <algorithm>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"
#include "csv_columns.hpp"
#include "formats/frame_text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

constexpr char kAnyBlanks = ' ';

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

char find_delimiter(std::string_view line) {
  std::string unquoted;
  bool inside_quotes = false;
  for (const char c : line) {
    if (c == '"') inside_quotes = !inside_quotes;
    if (!inside_quotes) unquoted += c;
  }
  const bool is_tab_first = unquoted.find('\t') != std::string::npos && commas_may_be_decimal(unquoted);
  for (const char delimiter : {';', is_tab_first ? '\t' : ',', '\t'})
    if (unquoted.find(delimiter) != std::string::npos) return delimiter;
  return kAnyBlanks;
}

/// From the beginning of `text` to the end of a later line, with the ends of the lines between.
std::string_view up_to(const text::TextLine& last, std::string_view text) {
  return {text.data(), static_cast<std::size_t>(last.text.data() + last.text.size() - text.data())};
}

/// Takes the fields off the front of a line, one by one; one in quotes may go on in the lines after it.
class FieldReader {
 public:
  FieldReader(std::span<const text::TextLine> lines, char delimiter)
      : lines_(lines), rest_(trimmed(lines.front().text, delimiter)), delimiter_(delimiter) {}

  /// The next field, with the blanks within its quotes; nothing if these are not closed or text follows them.
  std::optional<std::string> take() {
    drop_padding();
    if (!rest_.starts_with('"')) return take_plain();
    std::optional<std::string> field = take_quoted();
    drop_padding();
    if (!rest_.empty() && !is_delimiter(rest_.front())) return std::nullopt;
    return field;
  }

  /// Steps over the delimiter; false at the end of the line.
  bool next() {
    if (rest_.empty()) return false;
    rest_.remove_prefix(1);
    if (delimiter_ == kAnyBlanks) rest_ = text::trim(rest_);
    return true;
  }

  /// Lines that are read, from the first.
  std::size_t count_lines() const { return line_ + 1; }

 private:
  static std::string_view trimmed(std::string_view line, char delimiter) {
    return delimiter == kAnyBlanks ? text::trim(line) : line;
  }

  bool is_delimiter(char c) const { return delimiter_ == kAnyBlanks ? is_blank(c) : c == delimiter_; }

  void drop_padding() {
    while (!rest_.empty() && is_blank(rest_.front()) && !is_delimiter(rest_.front())) rest_.remove_prefix(1);
  }

  std::string take_plain() {
    const auto end = std::find_if(rest_.begin(), rest_.end(), [this](char c) { return is_delimiter(c); });
    const auto length = static_cast<std::size_t>(end - rest_.begin());
    std::string field(text::trim(rest_.substr(0, length)));
    rest_.remove_prefix(length);
    return field;
  }

  std::optional<std::string> take_quoted() {
    std::string field;
    for (std::size_t i = 1; i < rest_.size() || add_line(); ++i) {
      const bool is_quote = rest_[i] == '"';
      if (is_quote && !rest_.substr(i + 1).starts_with('"')) {
        rest_.remove_prefix(i + 1);
        if (delimiter_ == kAnyBlanks) rest_ = rest_.substr(0, rest_.find_last_not_of(" \t\r") + 1);
        return field;
      }
      field += rest_[i];
      if (is_quote) ++i;
    }
    return std::nullopt;
  }

  /// Goes on with the line's end and the next line; false at the last.
  bool add_line() {
    if (line_ + 1 == lines_.size()) return false;
    rest_ = up_to(lines_[++line_], rest_);
    return true;
  }

  std::span<const text::TextLine> lines_;
  std::size_t line_ = 0;
  std::string_view rest_;
  char delimiter_;
};

/// Splits the first of these lines, and those on which its fields in quotes go on, into the fields of a record.
/// @return how many lines that are
std::size_t split_fields(const std::string& path, std::span<const text::TextLine> lines, char delimiter,
                         CsvRecord& record) {
  FieldReader reader(lines, delimiter);
  do {
    std::optional<std::string> field = reader.take();
    if (!field)
      text::fail(path, lines.front().number,
                 "broken quotes in " + text::in_quotes(lines.front().text) + "; a field in quotes is \"like this\"");
    const std::string_view plain = text::trim(*field);
    if (plain.size() < field->size()) {
      record.padded.emplace_back(record.fields.size(), *field);
      field = std::string(plain);
    }
    record.fields.push_back(*std::move(field));
  } while (reader.next());
  return reader.count_lines();
}

/// The first of these lines and those after it, up to where its quotes are closed; it alone where they never are.
std::string_view with_closed_quotes(std::span<const text::TextLine> lines) {
  std::size_t quotes = 0;
  for (const text::TextLine& line : lines) {
    quotes += static_cast<std::size_t>(std::count(line.text.begin(), line.text.end(), '"'));
    if (quotes % 2 == 0) return up_to(line, lines.front().text);
  }
  return lines.front().text;
}

/// What Excel's first line `sep=;` names.
std::optional<char> named_delimiter(std::string_view content) {
  if (content.starts_with('"')) content.remove_prefix(1);
  if (content.size() < 5 || text::to_lower(content.substr(0, 4)) != "sep=") return std::nullopt;
  const std::string_view rest = content.substr(5);
  const bool is_alone = rest.find_first_not_of(std::string{'"', content[4]}) == std::string_view::npos;
  return is_alone && std::string_view(",;\t|").find(content[4]) != std::string_view::npos ? std::optional(content[4])
                                                                                          : std::nullopt;
}

bool is_empty_row(const CsvRecord& record) {
  return std::all_of(record.fields.begin(), record.fields.end(), [](const auto& field) { return field.empty(); });
}

/// Whether the last of `width` columns is empty; the first line may do without it.
bool is_last_column_empty(const std::vector<CsvRecord>& records, std::size_t width) {
  return std::all_of(records.begin(), records.end(), [&](const CsvRecord& record) {
    if (record.fields.size() != width) return &record == &records.front() && record.fields.size() < width;
    return record.fields.back().empty();
  });
}

void drop_empty_last_columns(std::vector<CsvRecord>& records) {
  while (!records.empty() && records.back().fields.size() > 1) {
    const std::size_t width = records.back().fields.size();
    if (!is_last_column_empty(records, width)) return;
    for (CsvRecord& record : records)
      if (record.fields.size() == width) record.fields.pop_back();
  }
}

}  // namespace

// CloudCompare writes `//`.
bool is_csv_comment(std::string_view content) {
  if (content.starts_with("//")) return true;
  if (!content.starts_with('#')) return false;
  const std::string_view word = content.substr(0, content.find_first_of(",;\t"));
  return word.size() < 2 || !text::is_missing(text::trim(word));
}

bool names_csv_delimiter(std::string_view content) { return named_delimiter(content).has_value(); }

namespace {

/// Gathers the records of a table.
class RecordReader {
 public:
  explicit RecordReader(const std::string& path) : path_(path) {}

  /// Takes the first of these lines, and those on which its fields go on. @return how many lines that are
  std::size_t add(std::span<const text::TextLine> lines) {
    const std::string_view content = text::trim(lines.front().text);
    if (content.empty()) {
      next_.follows_blank_line = true;
      return 1;
    }
    if (is_csv_comment(content)) {
      note_row_in_comment(lines.front());
      comment_ = {lines.front().number, content.substr(std::min(content.find_first_not_of("#/ \t"), content.size()))};
      return 1;
    }
    if (records_.empty() && !delimiter_) {
      delimiter_ = named_delimiter(content);
      if (delimiter_) return 1;
      delimiter_ = find_delimiter(with_closed_quotes(lines));
    }
    return add_record(lines);
  }

  std::size_t count() const { return records_.size(); }
  std::optional<char> delimiter() const { return delimiter_; }

  std::vector<CsvRecord> finish() {
    drop_empty_last_columns(records_);
    if (delimiter_ != kAnyBlanks) use_decimal_points(records_, *delimiter_);
    return std::move(records_);
  }

 private:
  /// `#3,1.5,2` may be a row whose name begins with the mark of comments.
  void note_row_in_comment(const text::TextLine& line) {
    if (records_.empty() || delimiter_ == kAnyBlanks || records_.back().comment_row > 0) return;
    if (line.text.find('"') != std::string_view::npos) return;
    CsvRecord row{line.number, {}};
    split_fields(path_, {&line, 1}, *delimiter_, row);
    const bool has_number = std::any_of(row.fields.begin() + 1, row.fields.end(), text::is_number);
    if (has_number && row.fields.size() == records_.front().fields.size()) records_.back().comment_row = line.number;
  }

  std::size_t add_record(std::span<const text::TextLine> lines) {
    CsvRecord record = std::exchange(next_, {});
    record.line = lines.front().number;
    const std::size_t taken = split_fields(path_, lines, *delimiter_, record);
    if (is_empty_row(record)) {
      next_ = {0, {}, record.follows_blank_line, true, 0, {}};
      return taken;
    }
    if (records_.empty()) add_header_of_comment(record);
    records_.push_back(std::move(record));
    return taken;
  }

  void add_header_of_comment(const CsvRecord& first) {
    if (comment_.text.empty() || comment_.text.find('"') != std::string_view::npos || is_header(first)) return;
    if (comment_.text.starts_with(kFrameComment)) return;
    CsvRecord header{comment_.number, {}};
    split_fields(path_, {&comment_, 1}, *delimiter_, header);
    if (header.fields.size() == first.fields.size() && is_header(header) && names_coordinates(header))
      records_.push_back(std::move(header));
  }

  const std::string& path_;
  std::optional<char> delimiter_;
  text::TextLine comment_{};
  CsvRecord next_{};
  std::vector<CsvRecord> records_;
};

}  // namespace

std::vector<CsvRecord> csv_records(const std::string& path, std::string_view text, std::size_t limit) {
  RecordReader reader(path);
  const std::vector<text::TextLine> lines = text::split_lines(path, text);
  for (std::span<const text::TextLine> rest = lines; !rest.empty() && reader.count() < limit;)
    rest = rest.subspan(reader.add(rest));
  return reader.finish();
}

std::optional<char> csv_delimiter(const std::string& path, std::string_view text) {
  RecordReader reader(path);
  const std::vector<text::TextLine> lines = text::split_lines(path, text);
  for (std::span<const text::TextLine> rest = lines; !rest.empty() && reader.count() == 0;)
    rest = rest.subspan(reader.add(rest));
  return reader.count() > 0 ? reader.delimiter() : std::nullopt;
}

const std::string& CsvRecord::name(std::size_t column) const {
  for (const auto& [place, field] : padded)
    if (place == column) return field;
  return fields[column];
}

bool may_have_thousands(std::string_view number) {
  const std::size_t begin = number.find_first_of("0123456789");
  const std::size_t comma = number.find(',');
  return number.size() == comma + 4 && comma - begin <= 3 && number[begin] != '0';
}

namespace {

bool is_all_of(std::string_view text, std::string_view characters) {
  return text.find_first_not_of(characters) == std::string_view::npos;
}

bool looks_like_number(std::string_view field) {
  return is_all_of(field, "+-0123456789.,eE") && field.find_first_of("0123456789") != std::string_view::npos;
}

/// Where the decimal comma of `1,5` or `-1,5e3` is; npos where the field is no such number.
std::size_t find_decimal_comma(std::string_view field) {
  const std::size_t comma = field.find(',');
  const bool is_decimal = comma != std::string_view::npos && field.find_first_of(".,", comma + 1) == field.npos &&
                          field.find('.') == field.npos && looks_like_number(field) && commas_may_be_decimal(field);
  return is_decimal ? comma : std::string_view::npos;
}

/// Columns that hold names by the header, whatever they look like.
std::set<std::size_t> columns_of_names(const CsvRecord& header) {
  std::set<std::size_t> columns;
  for (std::size_t i = 0; i < header.fields.size(); ++i)
    if (const std::optional<ColumnMeaning> meaning = meaning_of(header.fields[i]))
      if (!is_coordinate(meaning->role)) columns.insert(i);
  return columns;
}

/// Whether some number has a decimal comma and none says that commas or points are anything else.
bool has_decimal_commas(const std::vector<CsvRecord>& records, char delimiter, const std::set<std::size_t>& names) {
  bool has_any = false;
  for (const CsvRecord& record : records)
    for (std::size_t i = 0; i < record.fields.size(); ++i) {
      const std::string& field = record.fields[i];
      if (names.contains(i) || !looks_like_number(field) || is_all_of(field, "+-0123456789eE")) continue;
      const std::size_t comma = find_decimal_comma(field);
      if (comma == std::string::npos) return false;
      if (delimiter != ',' || !may_have_thousands(field)) has_any = true;
    }
  return has_any;
}

}  // namespace

bool commas_may_be_decimal(std::string_view text) {
  for (std::size_t i = text.find(','); i != std::string_view::npos; i = text.find(',', i + 1))
    if (i == 0 || i + 1 == text.size() || !text::is_digit(text[i - 1]) || !text::is_digit(text[i + 1])) return false;
  return true;
}

void use_decimal_points(std::vector<CsvRecord>& records, char delimiter) {
  if (records.empty()) return;
  const std::set<std::size_t> names = columns_of_names(records.front());
  if (!has_decimal_commas(records, delimiter, names)) return;
  for (CsvRecord& record : records)
    for (std::size_t i = 0; i < record.fields.size(); ++i)
      if (const std::size_t comma = find_decimal_comma(record.fields[i]); comma != std::string::npos)
        if (!names.contains(i)) record.fields[i][comma] = '.';
}

std::vector<CsvRecord> first_records(std::string_view text, std::size_t count) {
  try {
    return csv_records("", text, count);
  } catch (const InputError&) {
    return {};
  }
}

void require_short_name(const std::string& path, const CsvRecord& record, const std::string& name) {
  constexpr std::size_t kLongest = 200;
  if (name.size() > kLongest)
    text::fail(path, record.line, fmt::format("the name {} is longer than {} bytes", text::in_quotes(name), kLongest));
}

}  // namespace pulson::formats
