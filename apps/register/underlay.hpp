#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "core/staged_files.hpp"
#include "pulson/draw/pictures.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// The image on which the source was digitised, and where its pixels are.
struct SourceImage {
  std::filesystem::path file;          ///< empty: none is known
  double pixel_size = 1;               ///< length units per pixel
  std::array<double, 2> origin{0, 0};  ///< of its first pixel; where y points up, of its lower edge
};

/// The image that the file of a shape names, where it is beside it; none else. @param shape before its landmarks were
/// moved
SourceImage named_image(const Landmarks& shape, bool scale_was_applied);

/// Puts the image below the landmarks of a picture: with the aligned source before, and as the flow carries what of it
/// is below the grid after. `pulson warp` does that, into files in the folder of `staged` that `remove` takes away.
class Underlay {
 public:
  /// Nothing where no image is known, d is not 2, or the picture has no grid. Adds a line to `notes` where the image
  /// cannot be used.
  Underlay(const SourceImage& image, const matching::Registration& registration, draw::RegistrationPicture& picture,
           StagedFiles& staged, std::vector<std::string>& notes);
  ~Underlay() { remove(); }
  Underlay(const Underlay&) = delete;
  Underlay& operator=(const Underlay&) = delete;

  void remove() const;

  /// The aligned image as a jpg, for the report; without a file where there is none.
  const draw::PlacedImage& aligned() const { return aligned_; }

 private:
  /// Runs `pulson warp`. @return whether it wrote the file
  bool warp(const std::filesystem::path& record, const std::vector<std::string>& options,
            const std::filesystem::path& out);
  std::filesystem::path scratch(const std::string& name);

  StagedFiles& staged_;
  std::string orientation_;  ///< the option
  draw::PlacedImage aligned_;
  std::vector<std::filesystem::path> files_;
  std::string printed_;  ///< by the last run
};

}  // namespace pulson
