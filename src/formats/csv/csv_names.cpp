// Which columns of a table with a landmark per line name landmarks and specimens.

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include <fmt/format.h>

#include "core/text.hpp"
#include "csv_columns.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::formats {
namespace {

constexpr std::size_t kFirstRow = 1;  // after the header

/// How the values of a column repeat on lines one after another.
struct Runs {
  std::size_t count = 0;
  std::size_t shortest = 0;
  std::size_t longest = 0;
  bool are_distinct = true;  ///< no two runs have one value
  bool has_empty = false;

  bool name_parts() const { return are_distinct && !has_empty && longest > 1; }
  bool name_equal_parts() const { return name_parts() && shortest == longest; }
};

class TableNames {
 public:
  TableNames(const std::string& path, const std::vector<CsvRecord>& records, CsvColumns& columns)
      : path_(path), records_(records), columns_(columns) {}

  void choose() {
    choose_specimens();
    choose_label();
    take_slices_for_specimens();
    if (columns_.label && !columns_.group && columns_.specimen.empty()) take_label_for_specimen();
    drop_counters();
    if (columns_.specimen.empty() && !columns_.group && !columns_.label) require_no_other_names();
  }

 private:
  const CsvRecord& header() const { return records_.front(); }
  std::string quoted(std::size_t column) const { return text::in_quotes(header().fields[column]); }

  void choose_specimens() {
    for (const RankedColumn& candidate : find_columns(header(), ColumnRole::kSpecimen)) {
      if (candidate.rank == kFrameRank && column_of_slices() && runs_of(candidate.column).count < 2) continue;
      if (candidate.rank == kImageRank && !columns_.image) columns_.image = candidate.column;
      if (columns_.specimen.empty() || !follows_from(columns_.specimen.front(), candidate.column))
        columns_.specimen.push_back(candidate.column);
    }
  }

  /// `Slice` of ImageJ, beside `Frame`.
  std::optional<std::size_t> column_of_slices() const {
    const auto& names = header().fields;
    const auto found = std::find_if(names.begin(), names.end(),
                                    [](const std::string& name) { return text::to_lower(name) == "slice"; });
    return found == names.end() ? std::nullopt : std::optional(static_cast<std::size_t>(found - names.begin()));
  }

  /// Slices of a stack that have several points each, in the plane, are specimens; a label that goes with the slice is
  /// its name.
  void take_slices_for_specimens() {
    const std::optional<std::size_t> slice = column_of_slices();
    if (!slice || !columns_.specimen.empty() || columns_.coordinates.size() != 2) return;
    const Runs runs = runs_of(*slice);
    if (!runs.name_parts() || runs.count < 2) return;
    const bool is_named =
        columns_.label && follows_from(*slice, *columns_.label) && follows_from(*columns_.label, *slice);
    columns_.specimen = {is_named ? *columns_.label : *slice};
    if (columns_.label && follows_from(*slice, *columns_.label)) columns_.label.reset();
    columns_.notes.push_back(
        fmt::format("each of the {} slices in the column {} is read as a specimen", runs.count, quoted(*slice)));
  }

  /// Whether equal values of `first` go with equal values of `second`.
  bool follows_from(std::size_t first, std::size_t second) const {
    std::map<std::string_view, std::string_view> found;
    return std::all_of(records_.begin() + kFirstRow, records_.end(), [&](const CsvRecord& record) {
      return found.try_emplace(record.fields[first], record.fields[second]).first->second == record.fields[second];
    });
  }

  void choose_label() {
    const std::vector<RankedColumn> candidates = find_columns(header(), ColumnRole::kLabel);
    if (candidates.empty()) {
      if (header().fields.front().empty()) columns_.label = 0;
      return;
    }
    const RankedColumn& best = candidates.front();
    columns_.label = best.column;
    for (auto other = candidates.begin() + 1; other != candidates.end(); ++other) place_other(best, *other);
  }

  /// A second column of labels may name the specimens or count the lines.
  void place_other(const RankedColumn& best, const RankedColumn& other) {
    const bool may_be_specimen = other.rank == kNameRank || other.rank == kIdRank;
    if (other.rank != best.rank && may_be_specimen && columns_.specimen.empty() && runs_of(other.column).name_parts()) {
      columns_.specimen.push_back(other.column);
      return;
    }
    const bool is_counter = records_.size() > kFirstRow + 1 && counts_lines(records_, other.column, kFirstRow);
    if (other.rank != best.rank && (!columns_.specimen.empty() || other.rank == kIndexRank || is_counter)) return;
    text::fail(path_, header().line,
               fmt::format("the columns {} and {} mean the same; give only one; call the one that names the specimen "
                           "'specimen'",
                           quoted(std::min(best.column, other.column)), quoted(std::max(best.column, other.column))));
  }

  Runs runs_of(std::size_t column) const {
    Runs runs;
    std::set<std::string_view> seen;
    std::size_t length = 0;
    for (std::size_t i = kFirstRow; i < records_.size(); ++i) {
      const std::string& value = records_[i].fields[column];
      runs.has_empty |= value.empty();
      ++length;
      const bool is_last = i + 1 == records_.size() || records_[i + 1].fields[column] != value;
      if (!is_last) continue;
      runs.shortest = runs.count == 0 ? length : std::min(runs.shortest, length);
      runs.longest = std::max(runs.longest, length);
      runs.are_distinct &= seen.insert(value).second;
      ++runs.count;
      length = 0;
    }
    return runs;
  }

  std::optional<int> rank_of_label() const {
    const std::optional<ColumnMeaning> meaning = meaning_of(header().fields[*columns_.label]);
    return meaning ? std::optional(meaning->rank) : std::nullopt;
  }

  /// ImageJ writes the name of the image in each line, in a column Label.
  void take_label_for_specimen() {
    const std::optional<int> rank = rank_of_label();
    if ((rank != kNameRank && rank != kIdRank) || !runs_of(*columns_.label).name_equal_parts()) return;
    columns_.specimen.push_back(*columns_.label);
    columns_.notes.push_back(
        fmt::format("the values of the column {} repeat in runs; it is read as the specimen", quoted(*columns_.label)));
    columns_.label.reset();
  }

  /// A count of all lines names no landmarks; of one shape it numbers them.
  void drop_counters() {
    if (!columns_.label || rank_of_label() == kLandmarkRank) return;
    const bool is_index = rank_of_label() == kIndexRank || !columns_.specimen.empty();
    if (is_index && counts_lines(records_, *columns_.label, kFirstRow)) {
      columns_.are_numbered = columns_.specimen.empty();
      columns_.label.reset();
    }
  }

  void require_no_other_names() const {
    for (std::size_t i = 0; i < header().fields.size(); ++i) {
      const bool is_named = !header().fields[i].empty() && !meaning_of(header().fields[i]);
      if (!is_named || records_.size() <= kFirstRow || is_number_or_missing(records_[kFirstRow].fields[i])) continue;
      const Runs runs = runs_of(i);
      if (runs.name_parts() && runs.count > 1 && runs.shortest > 1)
        text::fail(
            path_, header().line,
            fmt::format("the values of the column {} repeat in runs: call it 'specimen' if it distinguishes shapes, "
                        "'group' if it distinguishes outlines, otherwise remove it",
                        quoted(i)));
    }
  }

  const std::string& path_;
  const std::vector<CsvRecord>& records_;
  CsvColumns& columns_;
};

/// The row names of R differ, and numbers among them are whole.
bool holds_row_names(const std::vector<CsvRecord>& records) {
  std::set<std::string_view> seen;
  return std::all_of(records.begin() + kFirstRow, records.end(), [&](const CsvRecord& record) {
    const std::string& name = record.fields.front();
    const bool is_whole = name.find_first_not_of("0123456789") == std::string::npos;
    return !text::is_missing(name) && (is_whole || !text::is_number(name)) && seen.insert(name).second;
  });
}

bool lacks_name_of_first(const std::vector<CsvRecord>& records) {
  const std::size_t width = records.front().fields.size();
  return is_header(records.front()) && width > 1 &&
         std::all_of(records.begin() + kFirstRow, records.end(),
                     [&](const CsvRecord& record) { return record.fields.size() == width + 1; }) &&
         holds_row_names(records);
}

/// Whether the columns from `begin` on are V1, V2, V3, ..., or X1, X2, ..., at most `most` of them.
bool are_numbered(const CsvRecord& header, std::size_t begin, std::size_t most) {
  const std::size_t count = header.fields.size() - begin;
  const char prefix = count > 0 && header.fields[begin].starts_with('X') ? 'X' : 'V';
  for (std::size_t i = 0; i < count; ++i)
    if (i >= most || header.fields[begin + i] != fmt::format("{}{}", prefix, i + 1)) return false;
  return count > 1;
}

}  // namespace

void name_unnamed_columns(std::vector<CsvRecord>& records) {
  if (records.size() <= kFirstRow) return;
  std::vector<std::string>& names = records.front().fields;
  if (lacks_name_of_first(records)) names.insert(names.begin(), "");
  const std::size_t begin = names.front().empty() ? 1 : 0;
  const std::vector<std::string>& row = records[kFirstRow].fields;
  const bool has_labels = begin == 0 && !is_number_or_missing(row.front());
  const bool is_too_short = has_labels && names.size() < 3;  // names before one number are any list of values
  if (is_too_short || !are_numbered(records.front(), begin, has_labels ? 4 : 3)) return;
  const std::size_t first = has_labels ? 1 : begin;
  if (has_labels) names.front() = "label";
  for (std::size_t i = first; i < names.size(); ++i) names[i] = std::string(1, "xyz"[i - first]);
}

std::string joined_fields(const CsvRecord& record, const std::vector<std::size_t>& columns) {
  std::string joined;
  for (const std::size_t column : columns) {
    const std::string& field = record.name(column);
    if (!field.empty()) joined += (joined.empty() ? "" : "/") + field;
  }
  return joined;
}

bool names_image(std::string_view text) {
  constexpr std::array<std::string_view, 7> kEndings = {".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp", ".gif"};
  const std::string lower = text::to_lower(text);
  return std::any_of(kEndings.begin(), kEndings.end(), [&](auto ending) { return lower.ends_with(ending); });
}

void choose_names(const std::string& path, const std::vector<CsvRecord>& records, CsvColumns& columns) {
  TableNames(path, records, columns).choose();
}

bool counts_lines(const std::vector<CsvRecord>& records, std::size_t column, std::size_t begin) {
  std::optional<double> next;
  for (std::size_t i = begin; i < records.size(); ++i) {
    const std::string& field = records[i].fields[column];
    if (!text::is_number(field)) return false;
    const double value = parse_number(field, "");
    if (next ? value != *next : value != 0 && value != 1) return false;
    next = value + 1;
  }
  return next.has_value();
}

}  // namespace pulson::formats
