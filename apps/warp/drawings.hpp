#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "draw/image_picture.hpp"
#include "images/colour_maps.hpp"
#include "pictures.hpp"

namespace pulson {

/// The name without its folder, for captions.
std::string file_name(const std::string& file);

/// Images with captions, as a warp draws them.
class Drawings {
 public:
  explicit Drawings(const WarpArguments& arguments) : arguments_(arguments) {}

  /// The image in front, the result, and the target's image if --like gives it, with grid and landmarks.
  draw::ImagePicture side_by_side(const images::Image& image, const images::WarpedImage& result,
                                  const images::ImageWarp& warp, const WarpFrames& frames) const;

  /// The result over the target's image: in squares by turns, half of each, and their difference.
  draw::ImagePicture overlay(const images::WarpedImage& result, const WarpFrames& frames) const;

  /// Numbers of pixels as colours, and what these mean.
  struct Numbers {
    std::string heading;
    images::Image colours;
    draw::ColourBar bar;
    int width = 0;  ///< pixels of the frame in which `landmarks` are
    int height = 0;
    Points landmarks = Points(2, 0);
  };
  draw::ImagePicture numbers(const Numbers& numbers) const;
  draw::ImagePicture jacobian(const images::Image& image, const images::ImageWarp& warp,
                              const std::vector<float>& jacobians) const;

  /// @throws InputError as write_image_picture does
  void write(const draw::ImagePicture& picture, const std::filesystem::path& file) const;
  /// The bytes of a png.
  std::string png_of(const draw::ImagePicture& picture, std::string& narrow) const;

 private:
  draw::ImagePanel panel_of(std::string heading, const images::Image& image, int width, int height) const;

  const WarpArguments& arguments_;
};

/// Of Jacobians: white where areas stay, folds marked.
inline constexpr images::DivergingScale kJacobianScale{.centre = 1, .reach = 1, .marked_below = 0.0};
inline const std::string kJacobianHeading = "Jacobian determinant of the map, alignment included";

/// Of their logarithms to base 2; folds, which have none, are −∞ and marked.
inline constexpr images::DivergingScale kLogJacobianScale{
    .centre = 0, .reach = 2, .marked_below = std::numeric_limits<float>::lowest()};

/// The bar of a scale, with its ends and middle, and the colour of folds where a value has it.
draw::ColourBar bar_of(const images::DivergingScale& scale, const std::vector<float>& values);
/// The bar of viridis from 0 to `most`.
draw::ColourBar bar_of(double most);
/// A field of it for each of the whole numbers that occur.
draw::ColourBar bar_of_counts(double most, const std::vector<float>& counts);

}  // namespace pulson
