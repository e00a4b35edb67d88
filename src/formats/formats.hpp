#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {

// The rows of landmark_formats(), each defined behind its reader and writer.
LandmarkFormat amira_format();
LandmarkFormat bigwarp_format();
LandmarkFormat cmtk_format();
LandmarkFormat coco_format();
LandmarkFormat csv_format();
LandmarkFormat cvat_format();
LandmarkFormat deeplabcut_format();
LandmarkFormat dlib_format();
LandmarkFormat edma_format();
LandmarkFormat elastix_format();
LandmarkFormat fcsv_format();
LandmarkFormat fiji_format();
LandmarkFormat geojson_format();
LandmarkFormat ibug_format();
LandmarkFormat idav_format();
LandmarkFormat imagej_roi_format();
LandmarkFormat json_format();
LandmarkFormat labelme_format();
LandmarkFormat markups_format();
LandmarkFormat menpo_format();
LandmarkFormat meshlab_format();
LandmarkFormat morphologika_format();
LandmarkFormat npy_format();
LandmarkFormat npz_format();
LandmarkFormat nts_format();
LandmarkFormat openpose_format();
LandmarkFormat stereomorph_format();
LandmarkFormat tps_format();
LandmarkFormat transformix_format();
LandmarkFormat via_csv_format();
LandmarkFormat via_json_format();
LandmarkFormat vtk_format();

/// Whether a file that begins so is an image of the common kinds, by its mark.
bool is_image(std::string_view contents);

/// The format of a file that holds `text`: the one that the options name, else as read_landmark_file() finds it.
/// @throws InputError where it is none
const LandmarkFormat& landmark_format_of(const std::filesystem::path& path, std::string_view text,
                                         const ReadOptions& options);

/// read_all_shapes() where `text` is all that the file holds.
LandmarkFile shapes_of_text(const std::filesystem::path& path, std::string text, const ReadOptions& options);

/// As the row `csv` reads tables, with what the options say of them.
LandmarkFile read_table(const std::string& path, std::string_view text, const ReadOptions& options);

/// As the row `npy` reads an array.
LandmarkFile read_npy(const std::string& path, std::string_view text);
/// The columns of x, y and z, counted from 0, of a file that the row `fcsv` reads. @throws InputError as it does
std::vector<std::size_t> fcsv_coordinates(const std::string& path, std::string_view text);

/// As the row `csv` writes.
WrittenLandmarks write_csv(const std::string& path, const LandmarkFile& file);

/// The name of a file without its extension: the longest of any format, such as `mrk.json`, else what follows the last
/// dot.
std::string file_stem(const std::filesystem::path& path);

/// What a shape without a name of its own is called: file_stem() in UTF-8.
std::string name_by_file(const std::filesystem::path& path);

}  // namespace pulson::formats
