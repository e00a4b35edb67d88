#pragma once

#include <string>
#include <string_view>

#include "pulson/images/pages.hpp"

namespace pulson::images {

/// What a png says beside its pixels and palette: resolution, orientation and profile, and all chunks that stay true of
/// another picture, as they are. @throws InputError where the file is a film
PageMetadata metadata_of_png(std::string_view file);

/// The chunks of it, which come after the header of a png.
std::string chunks_of(const PageMetadata& about);

}  // namespace pulson::images
