#include "csv_layouts.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "core/text.hpp"

namespace pulson::io {

const CsvLayout* find_layout(const std::vector<CsvRecord>& records) {
  static constexpr std::array<CsvLayout, 5> kLayouts = {{
      {fits_coordinate_rows, read_coordinate_rows},
      {fits_shape_rows, read_shape_rows},
      {fits_named_axis_rows, read_named_axis_rows},
      {fits_axis_rows, read_axis_rows},
      {fits_named_shape_rows, read_named_shape_rows},
  }};
  const auto* const found =
      std::find_if(kLayouts.begin(), kLayouts.end(), [&](const CsvLayout& layout) { return layout.fits(records); });
  return found == kLayouts.end() ? nullptr : found;
}

void require_equal_lengths(const std::string& path, const std::vector<CsvRecord>& records) {
  const CsvRecord& first = records.front();
  for (const CsvRecord& record : records)
    if (record.fields.size() != first.fields.size())
      fail(path, record.line,
           fmt::format("{}, but line {} has {}; all lines must have the same number",
                       counted(record.fields.size(), "column"), first.line, first.fields.size()));
}

std::vector<std::string> unused_columns(const std::string& path, const std::vector<std::string>& names) {
  if (names.empty()) return {};
  std::string message = path + ": columns that are not used:";
  constexpr std::size_t kMost = 8;
  for (std::size_t i = 0; i < std::min(kMost, names.size()); ++i) message += " " + in_quotes(names[i]);
  if (names.size() > kMost) message += fmt::format(" and {} more", names.size() - kMost);
  return {message};
}

bool counts_from_one(const std::vector<std::string>& labels) {
  for (std::size_t i = 0; i < labels.size(); ++i)
    if (labels[i] != std::to_string(i + 1)) return false;
  return true;
}

}  // namespace pulson::io
