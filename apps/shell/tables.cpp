#include "tables.hpp"

#include "core/atomic_file.hpp"
#include "core/csv_table.hpp"

namespace pulson {
namespace {

bool for_spreadsheets = false;

}  // namespace

void add_table_option(CLI::App& verb) {
  verb.add_flag_callback(
      "--spreadsheet-safe", [] { for_spreadsheets = true; },
      "put a ' before texts in csv files that a spreadsheet would run as formulas: those that begin with = + - @");
}

bool makes_tables_safe() { return for_spreadsheets; }

std::string as_table(std::string csv) { return for_spreadsheets ? text::spreadsheet_safe(csv) : std::move(csv); }

std::vector<std::string> write_landmarks(const std::filesystem::path& path, const formats::LandmarkFile& file,
                                         std::string_view format) {
  const formats::LandmarkFormat& row = formats::landmark_format_to_write(path, format);
  formats::WrittenLandmarks written = text_of_landmarks(path, file, row);
  write_file_atomically(path, row.name == "csv" ? as_table(std::move(written.text)) : written.text);
  return std::move(written.losses);
}

}  // namespace pulson
