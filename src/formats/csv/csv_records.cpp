
#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"
#include "csv_columns.hpp"
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

/// Takes fields off the front of a line, one by one.
class FieldReader {
 public:
  FieldReader(std::string_view line, char delimiter) : rest_(line), delimiter_(delimiter) {}

  /// The next field; nothing if its quotes are not closed or text follows them.
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
    if (delimiter_ == kAnyBlanks) rest_ = io::trim(rest_);
    return true;
  }

 private:
  bool is_delimiter(char c) const { return delimiter_ == kAnyBlanks ? is_blank(c) : c == delimiter_; }

  void drop_padding() {
    while (!rest_.empty() && is_blank(rest_.front()) && !is_delimiter(rest_.front())) rest_.remove_prefix(1);
  }

  std::string take_plain() {
    const auto end = std::find_if(rest_.begin(), rest_.end(), [this](char c) { return is_delimiter(c); });
    const auto length = static_cast<std::size_t>(end - rest_.begin());
    std::string field(io::trim(rest_.substr(0, length)));
    rest_.remove_prefix(length);
    return field;
  }

  std::optional<std::string> take_quoted() {
    std::string field;
    for (std::size_t i = 1; i < rest_.size(); ++i) {
      const bool is_quote = rest_[i] == '"';
      if (is_quote && !rest_.substr(i + 1).starts_with('"')) {
        rest_.remove_prefix(i + 1);
        return std::string(io::trim(field));
      }
      field += rest_[i];
      if (is_quote) ++i;
    }
    return std::nullopt;
  }

  std::string_view rest_;
  char delimiter_;
};

std::vector<std::string> split_fields(const std::string& path, const io::TextLine& line, char delimiter) {
  FieldReader reader(delimiter == kAnyBlanks ? io::trim(line.text) : line.text, delimiter);
  std::vector<std::string> fields;
  do {
    std::optional<std::string> field = reader.take();
    if (!field)
      io::fail(path, line.number,
               "broken quotes in " + io::in_quotes(line.text) + "; a field in quotes is \"like this\"");
    fields.push_back(*std::move(field));
  } while (reader.next());
  return fields;
}

/// `#N/A` at the beginning of a line is a cell of Excel; CloudCompare writes `//`.
bool is_csv_comment(std::string_view content) {
  if (content.starts_with("//")) return true;
  if (!content.starts_with('#')) return false;
  const std::string_view word = content.substr(0, content.find_first_of(",;\t"));
  return word.size() < 2 || !io::is_missing(io::trim(word));
}

/// What Excel's first line `sep=;` names.
std::optional<char> named_delimiter(std::string_view content) {
  if (content.starts_with('"')) content.remove_prefix(1);
  if (content.size() < 5 || io::to_lower(content.substr(0, 4)) != "sep=") return std::nullopt;
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

/// Gathers the lines of a table.
class RecordReader {
 public:
  explicit RecordReader(const std::string& path) : path_(path) {}

  void add(const io::TextLine& line) {
    const std::string_view content = io::trim(line.text);
    if (content.empty()) {
      next_.follows_blank_line = true;
      return;
    }
    if (is_csv_comment(content)) {
      comment_ = {line.number, content.substr(std::min(content.find_first_not_of("#/ \t"), content.size()))};
      return;
    }
    if (records_.empty() && !delimiter_) {
      delimiter_ = named_delimiter(content);
      if (delimiter_) return;
      delimiter_ = find_delimiter(content);
    }
    add_record(line);
  }

  std::size_t count() const { return records_.size(); }

  std::vector<CsvRecord> finish() {
    drop_empty_last_columns(records_);
    if (delimiter_ != kAnyBlanks) use_decimal_points(records_, *delimiter_);
    return std::move(records_);
  }

 private:
  void add_record(const io::TextLine& line) {
    CsvRecord record = std::exchange(next_, {});
    record.line = line.number;
    record.fields = split_fields(path_, line, *delimiter_);
    if (is_empty_row(record)) {
      next_ = {0, {}, record.follows_blank_line, true};
      return;
    }
    if (records_.empty()) add_header_of_comment(record);
    records_.push_back(std::move(record));
  }

  void add_header_of_comment(const CsvRecord& first) {
    if (comment_.text.empty() || comment_.text.find('"') != std::string_view::npos || is_header(first)) return;
    CsvRecord header{comment_.number, split_fields(path_, comment_, *delimiter_)};
    if (header.fields.size() == first.fields.size() && is_header(header) && names_coordinates(header))
      records_.push_back(std::move(header));
  }

  const std::string& path_;
  std::optional<char> delimiter_;
  io::TextLine comment_{};
  CsvRecord next_{};
  std::vector<CsvRecord> records_;
};

}  // namespace

std::vector<CsvRecord> csv_records(const std::string& path, std::string_view text, std::size_t limit) {
  RecordReader reader(path);
  for (const io::TextLine& line : io::split_lines(path, text)) {
    if (reader.count() >= limit) break;
    reader.add(line);
  }
  return reader.finish();
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

/// `1,234`, which is a number without decimals elsewhere
bool may_have_thousands(std::string_view field, std::size_t comma) {
  const std::size_t begin = field.find_first_of("0123456789");
  return field.size() == comma + 4 && comma - begin <= 3 && field[begin] != '0';
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
      if (delimiter != ',' || !may_have_thousands(field, comma)) has_any = true;
    }
  return has_any;
}

}  // namespace

bool commas_may_be_decimal(std::string_view text) {
  for (std::size_t i = text.find(','); i != std::string_view::npos; i = text.find(',', i + 1))
    if (i == 0 || i + 1 == text.size() || !io::is_digit(text[i - 1]) || !io::is_digit(text[i + 1])) return false;
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
    io::fail(path, record.line, fmt::format("the name {} is longer than {} bytes", io::in_quotes(name), kLongest));
}

}  // namespace pulson::formats
