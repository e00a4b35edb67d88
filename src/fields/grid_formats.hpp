#pragma once

// The formats behind read_grid_field and write_grid_field.

#include <string>
#include <string_view>

#include "pulson/fields/grid_fields.hpp"

namespace pulson::io {

bool sniff_meta_image(std::string_view text);
/// `path` is what messages call the file. @throws InputError
GridField read_meta_image(const std::string& path, std::string_view text);
/// The whole file. The field's direction is filled.
std::string meta_image_file(const GridField& field, bool compressed);

bool sniff_nrrd(std::string_view text);
GridField read_nrrd(const std::string& path, std::string_view text);
std::string nrrd_file(const GridField& field, bool compressed);

}  // namespace pulson::io
