#include "csv_columns.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"

namespace pulson::formats {

namespace {

constexpr std::string_view kSeparators = " _.-";

struct NamedMeaning {
  std::string_view names;  ///< plain, each between blanks
  ColumnRole role;
  int rank;
};

constexpr std::array<NamedMeaning, 11> kMeanings = {{
    {" landmark landmarkid landmarkno landmarknr landmarknumber landmarkname landmarkindex landmark# lm lmid lmno "
     "point "
     "pointid pointno pointname pt ptid keypoint bodypart coordid ",
     ColumnRole::kLabel, kLandmarkRank},
    {" label name ", ColumnRole::kLabel, kNameRank},
    {" id ", ColumnRole::kLabel, kIdRank},
    {" index idx no nr number num ", ColumnRole::kLabel, kIndexRank},
    {" group outline ", ColumnRole::kGroup, 0},
    {" specimen specimenid specimenname specimenno spec specid shape shapeid ", ColumnRole::kSpecimen, 0},
    {" sample sampleid samplename individual individualid ind subject subjectid patient patientid animal animalid "
     "track "
     "trackid ",
     ColumnRole::kSpecimen, 1},
    {" file filename filepath image imageid imagename imagefile imagepath img imgid imgname photo picture ",
     ColumnRole::kSpecimen, kImageRank},
    {" frame frameid frameidx frameno framenumber ", ColumnRole::kSpecimen, kFrameRank},
    {" defined ", ColumnRole::kDefined, 0},
    {" absent ", ColumnRole::kAbsent, 0},
}};

constexpr std::array<std::pair<std::string_view, std::string_view>, 12> kUnits = {{
    {"mm", "mm"},
    {"um", "um"},
    {"\xC2\xB5m", "um"},  // the micro sign
    {"\xCE\xBCm", "um"},  // the Greek letter
    {"micron", "um"},
    {"microns", "um"},
    {"cm", "cm"},
    {"px", "px"},
    {"pix", "px"},
    {"pixel", "px"},
    {"pixels", "px"},
    {"nm", "nm"},
}};

std::string_view find_unit(std::string_view word) {
  const auto* const found =
      std::find_if(kUnits.begin(), kUnits.end(), [&](const auto& unit) { return unit.first == word; });
  return found == kUnits.end() ? std::string_view() : found->second;
}

/// Takes `(mm)`, `[px]` or `_mm` off the end of a name in lower case. @return the unit; empty where there is none
std::string take_unit(std::string& name) {
  const char last = name.empty() ? '\0' : name.back();
  const bool is_closed = last == ')' || last == ']';
  const std::size_t end = is_closed ? name.find_last_of(last == ')' ? '(' : '[') : name.find_last_of(kSeparators);
  if (end == std::string::npos || end == 0) return {};
  const std::string_view word = std::string_view(name).substr(end + 1, name.size() - end - (is_closed ? 2 : 1));
  std::string unit(find_unit(text::trim(word)));
  if (!unit.empty()) name.resize(end);
  return unit;
}

/// The axis of a plain name, and how plainly it says so.
std::optional<std::pair<std::size_t, int>> find_axis(std::string_view plain) {
  if (plain.size() == 1 && text::kAxisLetters.find(plain.front()) != text::kAxisLetters.npos)
    return std::pair(text::kAxisLetters.find(plain.front()), 0);
  constexpr std::array<std::string_view, 3> kNumbered = {"pos1", "pos2", "pos3"};
  constexpr std::array<std::string_view, 6> kParaView = {"points:0", "points:1", "points:2",
                                                         "points0",  "points1",  "points2"};
  if (const auto* const found = std::find(kNumbered.begin(), kNumbered.end(), plain); found != kNumbered.end())
    return std::pair(static_cast<std::size_t>(found - kNumbered.begin()), 0);
  if (const auto* const found = std::find(kParaView.begin(), kParaView.end(), plain); found != kParaView.end())
    return std::pair(static_cast<std::size_t>(found - kParaView.begin()) % 3, 2);
  for (const std::string_view word : {"coord", "coords", "coordinate", "coordinates", "pos", "position", "pts"}) {
    if (plain.size() != word.size() + 1) continue;
    const std::size_t axis = text::kAxisLetters.find(plain.starts_with(word) ? plain.back() : plain.front());
    if (axis != text::kAxisLetters.npos && (plain.starts_with(word) || plain.ends_with(word)))
      return std::pair(axis, 2);
  }
  return std::nullopt;
}

}  // namespace

std::string plain_name(std::string_view name) {
  std::string plain = text::to_lower(name);
  std::erase_if(plain, [](char c) { return kSeparators.find(c) != kSeparators.npos; });
  return plain;
}

std::optional<ColumnMeaning> meaning_of(std::string_view name) {
  std::string base = text::to_lower(name);
  const std::string unit = take_unit(base);
  if (const auto axis = find_axis(plain_name(base)))
    return ColumnMeaning{static_cast<ColumnRole>(axis->first), axis->second + (unit.empty() ? 0 : 1), unit};
  const std::string plain = plain_name(name);
  if (plain.empty()) return std::nullopt;
  const std::string word = " " + plain + " ";
  const auto* const found = std::find_if(kMeanings.begin(), kMeanings.end(), [&](const NamedMeaning& meaning) {
    return meaning.names.find(word) != std::string_view::npos;
  });
  if (found == kMeanings.end()) return std::nullopt;
  return ColumnMeaning{found->role, found->rank};
}

bool is_coordinate(ColumnRole role) { return role <= ColumnRole::kZ; }

std::optional<std::size_t> axis_of_word(std::string_view word) {
  const std::string lower = text::to_lower(word);
  const std::size_t axis = text::kAxisLetters.find(lower.empty() ? '\0' : lower.front());
  if (axis == text::kAxisLetters.npos) return std::nullopt;
  std::string_view rest = std::string_view(lower).substr(1);
  rest.remove_prefix(std::min(rest.find_first_not_of("-_. "), rest.size()));
  for (const std::string_view ending : {"", "coordinates", "coordinate", "coords", "coord"})
    if (rest == ending) return axis;
  return std::nullopt;
}

namespace {

constexpr std::string_view kRightHeader =
    "a landmark table has columns x[,y[,z]] or pos1[,pos2[,pos3]], and specimen,landmark before them where it holds "
    "several shapes";

std::string list_fields(const CsvRecord& record) {
  constexpr std::size_t kMost = 6;
  std::string list;
  for (std::size_t i = 0; i < std::min(kMost, record.fields.size()); ++i)
    list += (i > 0 ? ", " : "") + text::in_quotes(record.fields[i]);
  return list + (record.fields.size() > kMost ? ", ..." : "");
}

/// Columns that name the axes all together, in the order x, y, z.
struct NamedAxes {
  std::vector<std::string_view> names;  ///< plain
  std::string_view axes;                ///< where they point
};

const NamedAxes* find_named_axes(const CsvRecord& header, std::vector<std::size_t>& columns) {
  static const std::array<NamedAxes, 4> kNamedAxes = {{
      {{"l", "p", "s"}, "LPS"},
      {{"r", "a", "s"}, "RAS"},
      {{"axis2", "axis1", "axis0"}, ""},  // napari counts rows first
      {{"axis1", "axis0"}, ""},
  }};
  std::map<std::string, std::size_t> places;
  for (std::size_t i = 0; i < header.fields.size(); ++i) places.try_emplace(plain_name(header.fields[i]), i);
  for (const NamedAxes& named : kNamedAxes) {
    columns.clear();
    for (const std::string_view name : named.names)
      if (const auto found = places.find(std::string(name)); found != places.end()) columns.push_back(found->second);
    if (columns.size() == named.names.size()) return &named;
  }
  columns.clear();
  return nullptr;
}

void require_one(const std::string& path, const CsvRecord& header, const std::vector<RankedColumn>& columns) {
  if (columns.size() < 2 || columns[0].rank != columns[1].rank) return;
  text::fail(path, header.line,
             fmt::format("the columns {} and {} mean the same; give only one",
                         text::in_quotes(header.fields[columns[0].column]),
                         text::in_quotes(header.fields[columns[1].column])));
}

/// The units of x, which those of the other axes have to be.
std::string units_of(const std::string& path, const CsvRecord& header, const std::vector<std::size_t>& columns) {
  const std::string& first = header.fields[columns.front()];
  std::string unit = meaning_of(first)->unit;
  for (const std::size_t column : columns)
    if (meaning_of(header.fields[column])->unit != unit)
      text::fail(path, header.line,
                 fmt::format("the columns {} and {} are not in the same units", text::in_quotes(first),
                             text::in_quotes(header.fields[column])));
  return unit;
}

/// Columns in one unit where those found are not, as ImageJ's cell counter has `X(micron)` beside `X`.
void use_common_unit(const CsvRecord& header, CsvColumns& result) {
  std::vector<std::size_t>& found = result.coordinates;
  const auto unit_of = [&](std::size_t column) { return meaning_of(header.fields[column])->unit; };
  const std::string unit = unit_of(found.back());
  const auto has_unit = [&](std::size_t column) { return unit_of(column) == unit; };
  if (std::all_of(found.begin(), found.end(), has_unit)) return;
  std::vector<std::size_t> in_unit;
  for (std::size_t axis = 0; axis < found.size(); ++axis)
    for (const RankedColumn& candidate : find_columns(header, static_cast<ColumnRole>(axis)))
      if (has_unit(candidate.column) && in_unit.size() == axis) in_unit.push_back(candidate.column);
  if (in_unit.size() != found.size()) return;
  found = in_unit;
  result.notes.push_back(fmt::format("the coordinates are those in {}, which all axes have", unit));
}

bool is_worded(const CsvRecord& header, std::size_t column) { return meaning_of(header.fields[column])->rank > 1; }

void find_coordinates(const std::string& path, const CsvRecord& header, CsvColumns& result) {
  std::vector<std::size_t>& found = result.coordinates;
  for (const ColumnRole role : {ColumnRole::kX, ColumnRole::kY, ColumnRole::kZ}) {
    const std::vector<RankedColumn> columns = find_columns(header, role);
    // `Z-pos` of ImageJ's cell counter is the number of a slice beside its X and Y
    const bool is_other_z = role == ColumnRole::kZ && !columns.empty() && found.size() == 2 &&
                            is_worded(header, columns.front().column) != is_worded(header, found.front());
    if (columns.empty() || is_other_z) continue;
    if (found.size() != static_cast<std::size_t>(role))
      text::fail(
          path, header.line,
          fmt::format("there is a column {} but none for {}; {}",
                      text::in_quotes(header.fields[columns.front().column]), "xyz"[found.size()], kRightHeader));
    require_one(path, header, columns);
    found.push_back(columns.front().column);
  }
  if (!found.empty()) {
    use_common_unit(header, result);
    result.units = units_of(path, header, found);
    return;
  }
  const NamedAxes* const named = find_named_axes(header, found);
  if (named == nullptr)
    text::fail(
        path, header.line,
        fmt::format("no coordinates in the columns {}; {}; `columns` names others", list_fields(header), kRightHeader));
  result.axes = named->axes;
  if (result.axes.empty())
    result.notes.push_back(fmt::format("the columns {} are read as {}, as napari counts rows first",
                                       found.size() == 2 ? "axis-0, axis-1" : "axis-0, axis-1, axis-2",
                                       found.size() == 2 ? "y, x" : "z, y, x"));
}

bool is_used(const CsvColumns& columns, std::size_t column) {
  const auto has = [&](const std::vector<std::size_t>& list) {
    return std::find(list.begin(), list.end(), column) != list.end();
  };
  return has(columns.coordinates) || has(columns.specimen) || column == columns.label || column == columns.group ||
         column == columns.image || column == columns.defined || column == columns.absent;
}

/// Whether a line is a name and two or three coordinates.
bool is_named_point(const CsvRecord& record) {
  const auto& fields = record.fields;
  if (fields.size() < 3 || fields.size() > 4 || text::is_missing(fields.front()) || text::is_number(fields.front()))
    return false;
  return std::all_of(fields.begin() + 1, fields.end(), is_number_or_missing);
}

}  // namespace

std::vector<RankedColumn> find_columns(const CsvRecord& header, ColumnRole role) {
  std::vector<RankedColumn> columns;
  for (std::size_t i = 0; i < header.fields.size(); ++i)
    if (const auto meaning = meaning_of(header.fields[i]); meaning && meaning->role == role)
      columns.push_back({i, meaning->rank});
  std::stable_sort(columns.begin(), columns.end(), [](const auto& a, const auto& b) { return a.rank < b.rank; });
  return columns;
}

std::optional<std::size_t> find_column(const CsvRecord& header, ColumnRole role) {
  const std::vector<RankedColumn> columns = find_columns(header, role);
  return columns.empty() ? std::nullopt : std::optional(columns.front().column);
}

bool is_number_or_missing(const std::string& field) { return text::is_missing(field) || text::is_number(field); }

bool holds_named_points(const std::vector<CsvRecord>& records) {
  const auto holds_a_number = [](const CsvRecord& record) {
    return std::any_of(record.fields.begin(), record.fields.end(), text::is_number);
  };
  return std::all_of(records.begin(), records.end(), is_named_point) &&
         std::any_of(records.begin(), records.end(), holds_a_number);
}

bool holds_numbers(const CsvRecord& record) {
  return std::all_of(record.fields.begin(), record.fields.end(), is_number_or_missing);
}

bool holds_only_marks(const CsvRecord& record) {
  return std::all_of(record.fields.begin(), record.fields.end(),
                     [](const std::string& field) { return text::is_missing(field); });
}

bool is_header(const CsvRecord& record) {
  const auto& fields = record.fields;
  return std::none_of(fields.begin(), fields.end(), [](const std::string& field) { return text::is_number(field); }) &&
         !holds_only_marks(record);
}

bool names_coordinates(const CsvRecord& header) {
  const auto is_axis = [](const std::string& name) {
    const auto meaning = meaning_of(name);
    return meaning && is_coordinate(meaning->role);
  };
  std::vector<std::size_t> columns;
  return std::any_of(header.fields.begin(), header.fields.end(), is_axis) ||
         find_named_axes(header, columns) != nullptr;
}

bool names_plain_coordinates(const CsvRecord& header) {
  return std::any_of(header.fields.begin(), header.fields.end(), [](const std::string& name) {
    const auto meaning = meaning_of(name);
    return meaning && is_coordinate(meaning->role) && meaning->rank == 0;
  });
}

CsvColumns coordinates_of_header(const std::string& path, const CsvRecord& header) {
  CsvColumns result;
  find_coordinates(path, header, result);
  return result;
}

CsvColumns columns_of_header(const std::string& path, const std::vector<CsvRecord>& records) {
  const CsvRecord& header = records.front();
  CsvColumns result = coordinates_of_header(path, header);
  for (const ColumnRole role : {ColumnRole::kGroup, ColumnRole::kDefined, ColumnRole::kAbsent})
    require_one(path, header, find_columns(header, role));
  result.group = find_column(header, ColumnRole::kGroup);
  result.defined = find_column(header, ColumnRole::kDefined);
  result.absent = find_column(header, ColumnRole::kAbsent);
  require_equal_lengths(path, records);
  choose_names(path, records, result);
  for (std::size_t i = 0; i < header.fields.size(); ++i) {
    const auto meaning = meaning_of(header.fields[i]);
    const bool is_index = meaning && meaning->role == ColumnRole::kLabel && meaning->rank == kIndexRank;
    const bool is_unnamed_first = i == 0 && header.fields[i].empty();
    if (!is_index && !is_unnamed_first && !is_used(result, i)) result.unused.push_back(header.fields[i]);
  }
  return result;
}

CsvColumns columns_of_named_points(const CsvRecord& first) {
  CsvColumns columns;
  columns.label = 0;
  for (std::size_t i = 1; i < first.fields.size(); ++i) columns.coordinates.push_back(i);
  return columns;
}

CsvColumns columns_without_header(const std::string& path, const CsvRecord& first) {
  for (const std::string& field : first.fields)
    if (!text::is_number(field) && !text::is_missing(field))
      text::fail(path, first.line,
                 text::in_quotes(field) +
                     " is not a number; a table with more than coordinates needs a header such as label,x,y");
  CsvColumns columns;
  for (std::size_t i = 0; i < first.fields.size(); ++i) columns.coordinates.push_back(i);
  if (columns.coordinates.size() > 3)
    text::fail(
        path, first.line,
        fmt::format("{} columns without a header; a table without one has the columns x[,y[,z]], one landmark per line",
                    first.fields.size()));
  return columns;
}

}  // namespace pulson::formats
