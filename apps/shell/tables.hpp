#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/App.hpp>

#include "pulson/formats/landmark_files.hpp"

namespace pulson {

/// `--spreadsheet-safe`, which every verb that writes tables has.
void add_table_option(CLI::App& verb);

/// Whether --spreadsheet-safe was given.
bool makes_tables_safe();
/// Tables are as they are again.
void forget_table_options();

/// The text of a table as it is to be written: with --spreadsheet-safe, text::spreadsheet_safe() of it.
std::string as_table(std::string csv);

/// text_of_landmarks(), and as_table() where the format is csv.
formats::WrittenLandmarks text_to_write(const std::filesystem::path& path, const formats::LandmarkFile& file,
                                        const formats::LandmarkFormat& format);

/// write_landmark_file(), and as_table() where the format is csv.
std::vector<std::string> write_landmarks(const std::filesystem::path& path, const formats::LandmarkFile& file,
                                         std::string_view format = {});

}  // namespace pulson
