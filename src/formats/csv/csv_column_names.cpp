#include <algorithm>
#include <array>
#include <utility>

#include "core/text.hpp"
#include "csv_columns.hpp"

namespace pulson::io {
namespace {

constexpr std::string_view kSeparators = " _.-";

struct NamedMeaning {
  std::string_view names;  ///< plain, each between blanks
  ColumnRole role;
  int rank;
};

constexpr std::array<NamedMeaning, 10> kMeanings = {{
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
  std::string unit(find_unit(trim(word)));
  if (!unit.empty()) name.resize(end);
  return unit;
}

/// The axis of a plain name, and how plainly it says so.
std::optional<std::pair<std::size_t, int>> find_axis(std::string_view plain) {
  if (plain.size() == 1 && kAxisLetters.find(plain.front()) != kAxisLetters.npos)
    return std::pair(kAxisLetters.find(plain.front()), 0);
  constexpr std::array<std::string_view, 3> kNumbered = {"pos1", "pos2", "pos3"};
  constexpr std::array<std::string_view, 6> kParaView = {"points:0", "points:1", "points:2",
                                                         "points0",  "points1",  "points2"};
  if (const auto* const found = std::find(kNumbered.begin(), kNumbered.end(), plain); found != kNumbered.end())
    return std::pair(static_cast<std::size_t>(found - kNumbered.begin()), 0);
  if (const auto* const found = std::find(kParaView.begin(), kParaView.end(), plain); found != kParaView.end())
    return std::pair(static_cast<std::size_t>(found - kParaView.begin()) % 3, 2);
  for (const std::string_view word : {"coord", "coords", "coordinate", "coordinates", "pos", "position", "pts"}) {
    if (plain.size() != word.size() + 1) continue;
    const std::size_t axis = kAxisLetters.find(plain.starts_with(word) ? plain.back() : plain.front());
    if (axis != kAxisLetters.npos && (plain.starts_with(word) || plain.ends_with(word))) return std::pair(axis, 2);
  }
  return std::nullopt;
}

}  // namespace

std::string plain_name(std::string_view name) {
  std::string plain = to_lower(name);
  std::erase_if(plain, [](char c) { return kSeparators.find(c) != kSeparators.npos; });
  return plain;
}

std::optional<ColumnMeaning> meaning_of(std::string_view name) {
  std::string base = to_lower(name);
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
  const std::string lower = to_lower(word);
  const std::size_t axis = kAxisLetters.find(lower.empty() ? '\0' : lower.front());
  if (axis == kAxisLetters.npos) return std::nullopt;
  std::string_view rest = std::string_view(lower).substr(1);
  rest.remove_prefix(std::min(rest.find_first_not_of("-_. "), rest.size()));
  for (const std::string_view ending : {"", "coordinates", "coordinate", "coords", "coord"})
    if (rest == ending) return axis;
  return std::nullopt;
}

}  // namespace pulson::io
