#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "picture.hpp"
#include "pulson/draw/pictures.hpp"
#include "pulson/matching/registration.hpp"
#include "warp/placed_picture.hpp"

namespace pulson {

/// The image on which the source was digitised, and where its pixels are.
struct SourceImage {
  std::filesystem::path file;           ///< empty: none is known
  std::optional<PlacedPicture> placed;  ///< none where it cannot be used
};

/// Reads the image; the shape's frame then has its size. Adds a line to `notes` where the image cannot be used.
/// @param shape whose landmarks were placed on it
SourceImage source_image(const std::filesystem::path& file, const FrameOptions& options, std::int64_t max_pixels,
                         Landmarks& shape, std::vector<std::string>& notes);

/// Puts the image below the landmarks of a picture: with the aligned source before, and as the flow carries what of it
/// is below the grid after. Nothing where no image is known, d is not 2, or the picture has no grid. Adds a line to
/// `notes` where the image cannot be used. @return the aligned image for the report
std::optional<PageImage> add_underlay(const SourceImage& image, const matching::Registration& registration,
                                      draw::RegistrationPicture& picture, std::vector<std::string>& notes);

}  // namespace pulson
