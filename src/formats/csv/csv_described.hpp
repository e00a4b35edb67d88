#pragma once

// Tables that ReadOptions describe: the names of their columns, or the coordinates that take turns in one.

#include <map>
#include <string>
#include <vector>

#include "csv_records.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::io {

/// Gives the columns that `columns` lists (x → he_col) names with this meaning, and other columns that have it others.
/// @throws InputError that lists the columns where one is not there, or where the table has no header
void name_columns(const std::string& path, CsvRecord& header, const std::map<std::string, std::string>& columns);

/// Whether each line holds one field.
bool is_one_column(const std::vector<CsvRecord>& records);

/// One shape of a table of one column, where the d coordinates of each landmark take turns.
LandmarkFile read_in_turn(const std::string& path, const std::vector<CsvRecord>& records, std::size_t dimension);

}  // namespace pulson::io
