#pragma once

// What the names of columns mean.

#include <optional>
#include <string>
#include <string_view>

namespace pulson::io {

enum class ColumnRole { kX, kY, kZ, kLabel, kGroup, kSpecimen, kDefined };

/// A column by its name. Of several columns with one role, the one of the lowest rank has it.
struct ColumnMeaning {
  ColumnRole role;
  int rank;
  std::string unit = {};  ///< of a coordinate: mm, px, ...
};

constexpr int kLandmarkRank = 0;  ///< of a label: `landmark`, `point`
constexpr int kNameRank = 1;      ///< `label`, `name`, which may mean a specimen as well
constexpr int kIdRank = 2;        ///< `id`, which may too
constexpr int kIndexRank = 3;     ///< `index`, `no`
constexpr int kImageRank = 2;     ///< of a specimen: `file`, `image`
constexpr int kFrameRank = 3;     ///< `frame`

/// Case, blanks and `_ . -` do not matter. Coordinates may be `X (mm)`, `x_px`, `Xcoord`, `pos_x`, `Points:0`.
std::optional<ColumnMeaning> meaning_of(std::string_view name);

/// In lower case, without blanks and `_ . -`.
std::string plain_name(std::string_view name);

bool is_coordinate(ColumnRole role);

/// 0, 1, 2 for x, y, z, which may be followed by `coordinates` and the like: `x-coordinates`, `Y coord`.
std::optional<std::size_t> axis_of_word(std::string_view word);

}  // namespace pulson::io
