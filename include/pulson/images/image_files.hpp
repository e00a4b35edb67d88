#pragma once

#include <filesystem>
#include <string>

#include "pulson/images/image.hpp"

namespace pulson {

/// The image in a file of format png, jpg, tif (its first page), bmp, pgm or ppm, recognised by its contents, not its
/// name. Depth and channels are those of the file: grey stays one channel, a palette becomes red, green and blue, grey
/// with alpha four channels, fewer than 8 bits become 8, and alpha is straight also where a tif multiplied it in. The
/// orientation in a jpg's EXIF data is not applied, so the pixels are where landmarks were placed on them.
/// Values of a pgm or ppm are scaled from the file's highest to 255 or 65535, those of a tif of 10, 12 or 14 bits
/// to 16.
/// @throws InputError if the file is missing, a folder, not an image, truncated, larger than 2^20 pixels on a side or
/// 2^30 in all, or of pixels that Image cannot hold (64-bit, signed)
Image read_image(const std::filesystem::path& path);

/// Writes an image in the format of the extension: .png (8 or 16 bits, alpha), .tif or .tiff (also float; alpha), .jpg
/// or .jpeg (8 bits, quality 95), .bmp (8 bits), .pgm (grey, 8 or 16 bits), .ppm (colour, 8 or 16 bits). Two channels
/// are written as four. The file holds all or what it held before. @throws InputError for another extension, for an
/// image the format cannot hold (names those that can), or if the file cannot be written
void write_image(const std::filesystem::path& path, const Image& image);

/// Whether write_image knows the extension of `path`. For use before a long computation.
/// @throws InputError that lists the extensions if not
void check_image_extension(const std::filesystem::path& path);

}  // namespace pulson
