#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "picture.hpp"
#include "pulson/draw/pictures.hpp"
#include "pulson/images/image.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// The image on which the source was digitised, and where its pixels are.
struct SourceImage {
  std::filesystem::path file;          ///< empty: none is known
  double pixel_size = 1;               ///< length units per pixel
  std::array<double, 2> origin{0, 0};  ///< of its first pixel; where y points up, of its lower edge
  std::int64_t max_pixels = images::kMaxPixels;
};

/// The image that the file of a shape names, by a path from the folder of that file or by its name alone, where it is
/// there and a regular file; none else. @param shape before its landmarks were moved
SourceImage named_image(const Landmarks& shape, bool scale_was_applied);

/// Puts the image below the landmarks of a picture: with the aligned source before, and as the flow carries what of it
/// is below the grid after. Nothing where no image is known, d is not 2, or the picture has no grid. Adds a line to
/// `notes` where the image cannot be used. @return the aligned image for the report
std::optional<PageImage> add_underlay(const SourceImage& image, const matching::Registration& registration,
                                      draw::RegistrationPicture& picture, std::vector<std::string>& notes);

}  // namespace pulson
