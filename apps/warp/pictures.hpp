#pragma once

#include <functional>

#include "jobs.hpp"

namespace pulson {

/// Runs what writes `file`, unless that has no name; where it fails, for any reason, that is one warning.
void try_to_write(const std::string& file, const std::function<void()>& write);

/// Everything else that was asked for beside the result, as try_to_write does: Jacobians, multiplicity, masks,
/// overlays.
/// @return keys to the pictures of numbers
std::vector<ColourKey> write_more_results(const images::Image& image, const WarpResult& result,
                                          const images::ImageWarp& warp, const WarpFrames& frames,
                                          const WarpArguments& arguments);

/// The displacements, of the result's pixels where it was pulled, else of the image's. @throws InputError
void write_field(const std::string& file, const images::WarpedImage& result, const images::Image& image,
                 const WarpFrames& frames);

/// The landmarks in pixels of the image that is warped.
Points landmarks_on_image(const images::ImageWarp& warp, const WarpArguments& arguments);

/// The image's grid where the map takes it, in pixels of the result.
std::vector<Points> moved_grid(const images::Image& image, const images::ImageWarp& warp, bool inverse);

/// Lines of a regular grid on the image, densely sampled, in its pixels.
std::vector<Points> grid_lines(int width, int height);

/// The landmarks' paths up to step k and the landmarks at their ends, as rings, drawn on a picture of the target.
images::Image with_landmarks(const images::Image& image, const std::vector<Points>& paths, std::size_t k, double scale);

/// The image as it deforms, a frame for each time of the flow and a rest at both ends, at most 640 pixels wide or high.
/// @throws InputError where ffmpeg fails
void write_animation(const images::Image& image, const images::ImageWarp& warp, const WarpFrames& frames,
                     const WarpArguments& arguments);

}  // namespace pulson
