#pragma once

// The functions behind the rows of landmark_formats(); LandmarkFormat says what they do.

#include <string>
#include <string_view>

#include "pulson/io/landmark_files.hpp"

namespace pulson::io {

bool sniff_csv(std::string_view text);
LandmarkFile read_csv(const std::string& path, std::string_view text);

bool sniff_tps(std::string_view text);
LandmarkFile read_tps(const std::string& path, std::string_view text);

bool sniff_vtk(std::string_view text);
LandmarkFile read_vtk(const std::string& path, std::string_view text);

}  // namespace pulson::io
