// NTSYS matrices: comments that begin with a quote, a header `1 rows[L|B|E] cols[L] 0|1 [missing value] dim=d`, labels,
// and the numbers by rows. A row is a specimen or, where there are as many columns as dimensions, a landmark.

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "formats/formats.hpp"
#include "pulson/core/name_table.hpp"
#include "text_lines.hpp"

namespace pulson::formats {
namespace {

bool is_nts_comment(std::string_view line) { return line.starts_with('"') || line.starts_with('\''); }

/// One side of the matrix: how many, and where their labels stand: L ahead of the numbers, B and E at the beginning and
/// the end of each row, 0 where there are none.
struct NtsSide {
  std::size_t count;
  char labels;
};

struct NtsHeader {
  std::size_t line;
  NtsSide rows;
  NtsSide columns;
  std::optional<double> missing;
  std::optional<std::size_t> dimension;
};

std::optional<NtsSide> parse_side(std::string_view word, std::string_view places) {
  NtsSide side{0, 0};
  const char last = text::to_lower(word.substr(word.size() - 1)).front();
  if (places.find(last) != std::string_view::npos) {
    side.labels = last;
    word.remove_suffix(1);
  }
  const std::optional<std::size_t> count = parse_count(word);
  if (!count || *count == 0) return std::nullopt;
  side.count = *count;
  return side;
}

/// Takes `dim=d` off the end of `text`. @return nothing where that is not a number
std::optional<std::size_t> take_dimension(std::string_view& text) {
  const std::size_t begin = text::to_lower(text).find("dim");
  const std::size_t equals = text.find('=', begin);
  if (equals == std::string_view::npos) return std::nullopt;
  const std::string_view number = text::trim(text.substr(equals + 1));
  text = text.substr(0, begin);
  return parse_count(number);
}

/// @return nothing unless `line` is a header
std::optional<NtsHeader> parse_header(const text::TextLine& line) {
  std::string_view text = line.text;
  NtsHeader header{line.number, {0, 0}, {0, 0}, std::nullopt, std::nullopt};
  if (text::to_lower(text).find("dim") != std::string::npos) {
    header.dimension = take_dimension(text);
    if (!header.dimension) return std::nullopt;
  }
  const std::vector<std::string_view> words = text::split_words(text);
  if (words.size() < 4 || words.size() > 5 || words[0] != "1") return std::nullopt;
  const std::optional<NtsSide> rows = parse_side(words[1], "lbe");
  const std::optional<NtsSide> columns = parse_side(words[2], "l");
  if (!rows || !columns || (words[3] != "0" && words[3] != "1")) return std::nullopt;
  header.rows = *rows;
  header.columns = *columns;
  if (words.size() == 5) {
    if (!text::is_number(words[4])) return std::nullopt;
    header.missing = parse_number(words[4], "");
  }
  return header;
}

/// The words of the lines that are left, one after the other.
class NtsWords {
 public:
  explicit NtsWords(TextLines& lines) : lines_(lines) {}

  bool at_end() const { return next_ == words_.size() && lines_.at_end(); }
  std::size_t last_line() const { return line_.number; }
  std::size_t next_line() const { return next_ == words_.size() ? lines_.peek().number : line_.number; }

  std::string_view take(const std::string& wanted) {
    if (next_ == words_.size()) {
      line_ = lines_.take(wanted);
      words_ = text::split_words(line_.text);
      next_ = 0;
    }
    return words_[next_++];
  }

  /// The whole of the next line.
  std::string take_line(const std::string& wanted) { return std::string(lines_.take(wanted).text); }

 private:
  TextLines& lines_;
  text::TextLine line_{0, {}};
  std::vector<std::string_view> words_;
  std::size_t next_ = 0;
};

std::vector<std::string> take_words(NtsWords& words, std::size_t count, const std::string& what) {
  std::vector<std::string> taken;
  for (std::size_t i = 1; i <= count; ++i)
    taken.emplace_back(words.take(fmt::format("the label of {} {} of {}", what, i, count)));
  return taken;
}

/// The words of `lines`, from the line `begin` on.
std::size_t count_words(TextLines lines, std::size_t begin) {
  std::size_t words = 0;
  for (std::size_t i = 0; !lines.at_end(); ++i) {
    const std::size_t here = text::split_words(lines.take("").text).size();
    if (i >= begin) words += here;
  }
  return words;
}

class NtsReader {
 public:
  NtsReader(const std::string& path, std::string_view text) : path_(path), lines_(path, text), words_(lines_) {}

  LandmarkFile read() {
    read_header();
    read_labels();
    if (header_.columns.count == dimension_)
      read_one_shape();
    else
      read_specimens();
    if (!words_.at_end())
      text::fail(path_, words_.next_line(),
                 fmt::format("there is more than the {} by {} numbers that line {} announces", header_.rows.count,
                             header_.columns.count, header_.line));
    return std::move(file_);
  }

 private:
  void read_header() {
    while (is_nts_comment(lines_.peek().text)) lines_.take("");
    const text::TextLine line = lines_.take("a header such as 1 10 24 0 dim=2");
    const std::optional<NtsHeader> header = parse_header(line);
    if (!header)
      text::fail(path_, line.number,
                 text::in_quotes(line.text) + " where a header such as 1 10 24 0 dim=2 is expected");
    header_ = *header;
    dimension_ = header_.dimension ? *header_.dimension : dimension_of_columns();
    if (dimension_ < 1 || dimension_ > 3)
      text::fail(path_, header_.line, fmt::format("dim={}; landmarks have 1, 2 or 3 coordinates", dimension_));
    if (header_.columns.count % dimension_ != 0)
      text::fail(path_, header_.line,
                 fmt::format("{} cannot be landmarks with dim={}", text::counted(header_.columns.count, "column"),
                             dimension_));
  }

  std::size_t dimension_of_columns() {
    const std::size_t columns = header_.columns.count;
    if (columns != 2 && columns != 3)
      text::fail(path_, header_.line,
                 fmt::format("a matrix of {} without dim=, such as covariates; landmarks need dim=2 or dim=3 here",
                             text::counted(columns, "column")));
    file_.warnings.push_back(
        fmt::format("{}: the header has no dim=; the rows of {} are read as landmarks of one shape", path_, columns));
    return columns;
  }

  void read_labels() {
    const NtsSide rows = header_.rows;
    if (rows.labels == 'l') row_labels_ = are_labels_lines() ? label_lines() : take_words(words_, rows.count, "row");
    if (header_.columns.labels == 'l') {
      take_words(words_, header_.columns.count, "column");
      file_.warnings.push_back(path_ + ": the labels of the columns are not used");
    }
  }

  /// Whether each row label has a line of its own, and so may hold blanks: then the rest is just what is announced.
  bool are_labels_lines() const {
    if (lines_.left() <= header_.rows.count) return false;
    const std::size_t numbers = count_words(lines_, header_.rows.count);
    const std::size_t labels = header_.columns.labels == 'l' ? header_.columns.count : 0;
    return numbers >= labels && (numbers - labels) / header_.columns.count == header_.rows.count &&
           (numbers - labels) % header_.columns.count == 0;
  }

  std::vector<std::string> label_lines() {
    std::vector<std::string> labels;
    for (std::size_t i = 1; i <= header_.rows.count; ++i)
      labels.push_back(words_.take_line(fmt::format("the label of row {}", i)));
    return labels;
  }

  void read_row(std::size_t row, PointList& list, const std::string& shape) {
    const auto take_label = [&] { row_labels_.emplace_back(words_.take(fmt::format("the label of row {}", row))); };
    if (header_.rows.labels == 'b') take_label();
    std::vector<std::string_view> point;
    for (std::size_t i = 1; i <= header_.columns.count; ++i) {
      point.push_back(words_.take(fmt::format("number {} of {} of row {}", i, header_.columns.count, row)));
      if (point.size() < dimension_) continue;
      const std::size_t landmark = shape.empty() ? row : i / dimension_;
      list.add(point, {path_, words_.last_line(), std::to_string(landmark), shape, 0});
      point.clear();
    }
    if (header_.rows.labels == 'e') take_label();
  }

  void read_one_shape() {
    PointList list(dimension_, header_.missing);
    for (std::size_t row = 1; row <= header_.rows.count; ++row) read_row(row, list, "");
    Landmarks& shape = file_.shapes.emplace_back();
    shape.points = list.points();
    shape.labels = row_labels_;
  }

  void read_specimens() {
    for (std::size_t row = 1; row <= header_.rows.count; ++row) {
      PointList list(dimension_, header_.missing);
      read_row(row, list, fmt::format("specimen {}", row));
      Landmarks& shape = file_.shapes.emplace_back();
      shape.points = list.points();
      if (header_.rows.labels != 0) shape.name = row_labels_[row - 1];
    }
  }

  const std::string& path_;
  TextLines lines_;
  NtsWords words_;
  NtsHeader header_{0, {0, 0}, {0, 0}, std::nullopt, std::nullopt};
  std::size_t dimension_ = 0;
  std::vector<std::string> row_labels_;
  LandmarkFile file_;
};

/// Whether as many words follow as the header announces: a table may begin with the same four words.
bool has_the_words(std::string_view text, const NtsHeader& header) {
  const std::size_t begin = text.find_first_of("\r\n");
  std::size_t words = 0;
  for (const std::string_view line : first_lines(text.substr(std::min(begin, text.size())), std::string::npos))
    words += text::split_words(line).size();
  if (header.rows.labels != 0) words -= std::min(words, header.rows.count);
  if (header.columns.labels != 0) words -= std::min(words, header.columns.count);
  return words % header.columns.count == 0 && words / header.columns.count == header.rows.count;
}

bool sniff_nts(std::string_view text) {
  std::string_view first;
  while (true) {
    const std::vector<std::string_view> lines = first_lines(text, 1);
    if (lines.empty()) return false;
    first = lines.front();
    text.remove_prefix(static_cast<std::size_t>(first.data() - text.data()));
    if (!is_nts_comment(first)) break;
    text.remove_prefix(first.size());
  }
  const std::optional<NtsHeader> header = parse_header({1, first});
  return header && (header->dimension || has_the_words(text, *header));
}

LandmarkFile read_nts(const std::string& path, std::string_view text) { return NtsReader(path, text).read(); }

}  // namespace

LandmarkFormat nts_format() {
  return {.name = "nts",
          .extensions = {"nts", "dta"},
          .help = "NTSYS matrix with dim= in its header: a row for each specimen, or for each landmark of one",
          .sniff = sniff_nts,
          .read = read_nts};
}

}  // namespace pulson::formats
