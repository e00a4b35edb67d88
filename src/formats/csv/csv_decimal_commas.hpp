#pragma once

#include <string_view>
#include <vector>

#include "csv_records.hpp"

namespace pulson::io {

/// Whether each comma stands between two digits, as in `1,5`.
bool commas_may_be_decimal(std::string_view text);

/// Makes the decimal commas of numbers points, if some number has one and none says that commas or points are anything
/// else. Columns that hold names stay as they are; between commas, numbers such as 1,234 alone say nothing.
void use_decimal_points(std::vector<CsvRecord>& records, char delimiter);

}  // namespace pulson::io
