#pragma once

#include <stdexcept>
#include <string>

#include <png.h>

#include "pulson/draw/pictures.hpp"

namespace pulson {

/// The pixels of a png, by libpng. @throws std::runtime_error if it is none
inline draw::Raster png_pixels(const std::string& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, file.c_str()) == 0) throw std::runtime_error(file + " is no png");
  image.format = PNG_FORMAT_RGBA;
  draw::Raster raster{static_cast<int>(image.width), static_cast<int>(image.height), {}};
  raster.rgba.resize(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, raster.rgba.data(), 0, nullptr) == 0)
    throw std::runtime_error(file + " is cut");
  return raster;
}

}  // namespace pulson
