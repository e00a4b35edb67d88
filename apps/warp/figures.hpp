#pragma once

#include <optional>
#include <string>
#include <vector>

#include "arguments.hpp"
#include "picture_files.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// The coordinates of the image that is warped and of the result, and the result's size.
struct WarpFrames {
  Frame input;
  Frame result;
  int width = 0;
  int height = 0;
  std::optional<Picture> like;
  std::string title;             ///< of drawings: source → target
  Points landmarks_there;        ///< of the shape whose image the result is like, in its pixels
  std::vector<int> numbers;      ///< of the landmarks, as people count them
  std::vector<int> label_ranks;  ///< of each landmark: its group's number, or where there is one group its own
};

/// Sizes and coordinates as asked for; else those of the image. y points up where the landmarks are of a tps file.
/// @throws InputError
WarpFrames warp_frames(const WarpArguments& arguments, const matching::Registration& registration,
                       const Picture& input);

/// What the colours of a picture of numbers mean.
struct ColourKey {
  std::string file;
  std::string meaning;
};

/// The figures that a warp reports.
struct WarpFigures : images::MapFigures {
  std::string method;             ///< pull, push or points
  std::string reason;             ///< why this one
  double landmark_error_max = 0;  ///< pixels; of points: landmark units
  double ridge = 0;
  double seconds = 0;
  std::vector<ColourKey> colours = {};
};

/// "22.2 %"
std::string percent_text(double part);

/// The keys that scripts use, and how it was made.
std::string figures_json(const WarpFigures& figures, const WarpArguments& arguments, const WarpFrames* frames);

/// The JSON, where it is asked for. @throws InputError where it cannot be written
void write_figures(const WarpFigures& figures, const WarpArguments& arguments, const WarpFrames* frames);

/// The summary, unless that was asked to be left out.
void print_figures(const WarpFigures& figures, const WarpArguments& arguments, const WarpFrames* frames);

}  // namespace pulson
