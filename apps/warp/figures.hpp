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
struct WarpFigures {
  std::string method;  ///< pull, push or points
  std::string reason;  ///< why this one
  double folded_fraction = 0;
  double min_jacobian = 1;
  int max_multiplicity = 1;
  double uncovered_fraction = 0;
  double hole_fraction = 0;
  double landmark_error_max = 0;  ///< pixels; of points: landmark units
  double map_error = 0;           ///< pixels
  double ridge = 0;
  double seconds = 0;
  std::vector<ColourKey> colours = {};
};

/// The keys that scripts use, and how it was made.
std::string figures_json(const WarpFigures& figures, const WarpArguments& arguments, const WarpFrames* frames);

/// The summary, unless that was asked to be left out, and the JSON.
void print_figures(const WarpFigures& figures, const WarpArguments& arguments, const WarpFrames* frames);

}  // namespace pulson
