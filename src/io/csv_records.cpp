#include "csv_records.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "text.hpp"

namespace pulson::io {
namespace {

constexpr char kAnyBlanks = ' ';

bool is_blank(char c) { return c == ' ' || c == '\t'; }

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Whether each comma stands between two digits, as in `1,5`.
bool commas_may_be_decimal(std::string_view text) {
  for (std::size_t i = text.find(','); i != std::string_view::npos; i = text.find(',', i + 1))
    if (i == 0 || i + 1 == text.size() || !is_digit(text[i - 1]) || !is_digit(text[i + 1])) return false;
  return true;
}

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
    if (delimiter_ == kAnyBlanks) rest_ = trim(rest_);
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
    std::string field(trim(rest_.substr(0, length)));
    rest_.remove_prefix(length);
    return field;
  }

  std::optional<std::string> take_quoted() {
    std::string field;
    for (std::size_t i = 1; i < rest_.size(); ++i) {
      const bool is_quote = rest_[i] == '"';
      if (is_quote && !rest_.substr(i + 1).starts_with('"')) {
        rest_.remove_prefix(i + 1);
        return std::string(trim(field));
      }
      field += rest_[i];
      if (is_quote) ++i;
    }
    return std::nullopt;
  }

  std::string_view rest_;
  char delimiter_;
};

std::vector<std::string> split_fields(const std::string& path, const TextLine& line, char delimiter) {
  FieldReader reader(delimiter == kAnyBlanks ? trim(line.text) : line.text, delimiter);
  std::vector<std::string> fields;
  do {
    std::optional<std::string> field = reader.take();
    if (!field)
      fail(path, line.number, "broken quotes in " + in_quotes(line.text) + "; a field in quotes is \"like this\"");
    fields.push_back(*std::move(field));
  } while (reader.next());
  return fields;
}

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

/// Whether some number has a decimal comma and none says that commas or points are anything else.
bool has_decimal_commas(const std::vector<CsvRecord>& records) {
  bool has_any = false;
  for (const CsvRecord& record : records)
    for (const std::string& field : record.fields) {
      if (!looks_like_number(field) || is_all_of(field, "+-0123456789eE")) continue;
      if (find_decimal_comma(field) == std::string::npos) return false;
      has_any = true;
    }
  return has_any;
}

void use_decimal_points(std::vector<CsvRecord>& records) {
  for (CsvRecord& record : records)
    for (std::string& field : record.fields)
      if (const std::size_t comma = find_decimal_comma(field); comma != std::string::npos) field[comma] = '.';
}

}  // namespace

std::vector<CsvRecord> csv_records(const std::string& path, std::string_view text, std::size_t limit) {
  std::vector<CsvRecord> records;
  char delimiter = kAnyBlanks;
  for (const TextLine& line : split_lines(path, text)) {
    const std::string_view content = trim(line.text);
    if (content.empty() || content.front() == '#') continue;
    if (records.size() == limit) break;
    if (records.empty()) delimiter = find_delimiter(content);
    records.push_back({line.number, split_fields(path, line, delimiter)});
  }
  if ((delimiter == ';' || delimiter == '\t') && has_decimal_commas(records)) use_decimal_points(records);
  return records;
}

}  // namespace pulson::io
