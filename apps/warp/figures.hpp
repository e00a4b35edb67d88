#pragma once

#include <string>
#include <vector>

#include "frames.hpp"

namespace pulson {

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
