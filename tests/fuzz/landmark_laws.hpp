#pragma once

#include <initializer_list>
#include <string_view>

#include "pulson/formats/landmark_files.hpp"

namespace pulson::fuzz {

/// Names and groups are as many as landmarks, numbers are finite or missing, warnings are one line.
void check_landmark_file(const formats::LandmarkFile& file);

/// Each format that can be written refuses the shapes, or writes what it recognises and reads back to the same bits,
/// but for what it said that it cannot hold.
void check_writers(const formats::LandmarkFile& file);

/// The input is `ROW\n` and a text for the reader of that row of landmark_formats(), whatever the rows recognise.
/// @return false where ROW is none of `rows`
bool read_as_row(std::string_view input, std::initializer_list<std::string_view> rows);

}  // namespace pulson::fuzz
