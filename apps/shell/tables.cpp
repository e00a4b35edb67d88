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

void forget_table_options() { for_spreadsheets = false; }

bool makes_tables_safe() { return for_spreadsheets; }

std::string as_table(std::string csv) { return for_spreadsheets ? text::spreadsheet_safe(csv) : std::move(csv); }

formats::WrittenLandmarks text_to_write(const std::filesystem::path& path, const formats::LandmarkFile& file,
                                        const formats::LandmarkFormat& format) {
  formats::WrittenLandmarks written = text_of_landmarks(path, file, format);
  if (format.name == "csv") written.text = as_table(std::move(written.text));
  return written;
}

std::vector<std::string> write_landmarks(const std::filesystem::path& path, const formats::LandmarkFile& file,
                                         std::string_view format) {
  formats::WrittenLandmarks written = text_to_write(path, file, formats::landmark_format_to_write(path, format));
  write_file_atomically(path, written.text);
  return std::move(written.losses);
}

}  // namespace pulson
