#pragma once

// The functions behind the rows of landmark_formats(); LandmarkFormat says what they do.

#include <filesystem>
#include <string>
#include <string_view>

#include "pulson/formats/landmark_files.hpp"

namespace pulson::io {

bool sniff_bigwarp(std::string_view text);
LandmarkFile read_bigwarp(const std::string& path, std::string_view text);

bool sniff_csv(std::string_view text);
LandmarkFile read_csv(const std::string& path, std::string_view text);
/// The same with what the options say of tables.
LandmarkFile read_table(const std::string& path, std::string_view text, const ReadOptions& options);
WrittenLandmarks write_csv(const std::string& path, const LandmarkFile& file);

bool sniff_deeplabcut(std::string_view text);
LandmarkFile read_deeplabcut(const std::string& path, std::string_view text);

bool sniff_tps(std::string_view text);
LandmarkFile read_tps(const std::string& path, std::string_view text);
WrittenLandmarks write_tps(const std::string& path, const LandmarkFile& file);

bool sniff_ibug(std::string_view text);
LandmarkFile read_ibug(const std::string& path, std::string_view text);
WrittenLandmarks write_ibug(const std::string& path, const LandmarkFile& file);

bool sniff_elastix(std::string_view text);
LandmarkFile read_elastix(const std::string& path, std::string_view text);
WrittenLandmarks write_elastix(const std::string& path, const LandmarkFile& file);

bool sniff_transformix(std::string_view text);
LandmarkFile read_transformix(const std::string& path, std::string_view text);

bool sniff_idav(std::string_view text);
LandmarkFile read_idav(const std::string& path, std::string_view text);

bool sniff_nts(std::string_view text);
LandmarkFile read_nts(const std::string& path, std::string_view text);

bool sniff_morphologika(std::string_view text);
LandmarkFile read_morphologika(const std::string& path, std::string_view text);

bool sniff_edma(std::string_view text);
LandmarkFile read_edma(const std::string& path, std::string_view text);

bool sniff_stereomorph(std::string_view text);
LandmarkFile read_stereomorph(const std::string& path, std::string_view text);

bool sniff_vtk(std::string_view text);
LandmarkFile read_vtk(const std::string& path, std::string_view text);
WrittenLandmarks write_vtk(const std::string& path, const LandmarkFile& file);

bool sniff_fcsv(std::string_view text);
LandmarkFile read_fcsv(const std::string& path, std::string_view text);
WrittenLandmarks write_fcsv(const std::string& path, const LandmarkFile& file);

bool sniff_menpo(std::string_view text);
LandmarkFile read_menpo(const std::string& path, std::string_view text);

bool sniff_labelme(std::string_view text);
LandmarkFile read_labelme(const std::string& path, std::string_view text);

bool sniff_dlib(std::string_view text);
LandmarkFile read_dlib(const std::string& path, std::string_view text);

bool sniff_markups(std::string_view text);
LandmarkFile read_markups(const std::string& path, std::string_view text);
WrittenLandmarks write_markups(const std::string& path, const LandmarkFile& file);

bool sniff_npy(std::string_view text);
LandmarkFile read_npy(const std::string& path, std::string_view text);
WrittenLandmarks write_npy_landmarks(const std::string& path, const LandmarkFile& file);

bool sniff_json(std::string_view text);
LandmarkFile read_json(const std::string& path, std::string_view text);
WrittenLandmarks write_json(const std::string& path, const LandmarkFile& file);

/// The name of a file without its extension: the longest of any format, such as `mrk.json`, else what follows the last
/// dot.
std::string file_stem(const std::filesystem::path& path);

}  // namespace pulson::io
