// Where the fields of a table stand in its text, for those who change some of them and keep the rest.

#include <algorithm>

#include "csv_columns.hpp"

namespace pulson::formats {
namespace {

/// Steps through one record of a table.
class SpanReader {
 public:
  SpanReader(std::string_view text, std::size_t at, char delimiter, char line_end)
      : text_(text), at_(at), delimiter_(delimiter), line_end_(line_end) {}

  /// @return where the record ends
  std::size_t read(std::vector<CsvSpan>& fields) {
    fields.clear();
    do {
      skip_blanks();
      if (any_blanks() && at_line_end() && !fields.empty()) break;
      fields.push_back(!at_line_end() && text_[at_] == '"' ? take_quoted() : take_plain());
    } while (step_over_delimiter());
    return at_;
  }

 private:
  bool any_blanks() const { return delimiter_ == ' '; }
  bool at_line_end() const { return at_ >= text_.size() || text_[at_] == line_end_; }
  bool is_blank(char c) const { return (c == ' ' || c == '\t' || c == '\r') && c != line_end_; }
  bool is_delimiter(char c) const { return any_blanks() ? is_blank(c) : c == delimiter_; }

  void skip_blanks() {
    while (!at_line_end() && is_blank(text_[at_]) && (any_blanks() || text_[at_] != delimiter_)) ++at_;
  }

  bool step_over_delimiter() {
    if (at_line_end()) return false;
    ++at_;
    return true;
  }

  CsvSpan take_plain() {
    CsvSpan span{at_, at_};
    for (; !at_line_end() && !is_delimiter(text_[at_]); ++at_)
      if (!is_blank(text_[at_])) span.end = at_ + 1;
    return span;
  }

  /// What follows the closing quote up to the delimiter is passed over.
  CsvSpan take_quoted() {
    CsvSpan span{++at_, text_.size()};
    for (; at_ < text_.size(); ++at_) {
      if (text_[at_] != '"') continue;
      if (at_ + 1 >= text_.size() || text_[at_ + 1] != '"') break;
      ++at_;
    }
    span.end = std::min(at_, text_.size());
    while (!at_line_end() && !is_delimiter(text_[at_])) ++at_;
    while (span.begin < span.end && is_blank(text_[span.begin])) ++span.begin;
    while (span.begin < span.end && is_blank(text_[span.end - 1])) --span.end;
    return span;
  }

  std::string_view text_;
  std::size_t at_;
  char delimiter_, line_end_;
};

}  // namespace

std::size_t csv_spans(std::string_view text, std::size_t at, char delimiter, char line_end,
                      std::vector<CsvSpan>& fields) {
  return SpanReader(text, at, delimiter, line_end).read(fields);
}

}  // namespace pulson::formats
