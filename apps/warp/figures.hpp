#pragma once

#include <string>
#include <vector>

#include "frames.hpp"
#include "records/facts.hpp"

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

/// A warp that was made.
struct WarpRun {
  const WarpFigures& figures;
  const WarpArguments& arguments;
  const WarpFrames* frames;  ///< null where points were moved
};

const Facts<WarpRun>& warp_facts();
/// Of a warp of an image, besides.
const Facts<WarpRun>& image_warp_facts();

/// The JSON, where it is asked for. @throws InputError where it cannot be written
void write_figures(const WarpRun& run);

/// The summary, unless that was asked to be left out.
void print_figures(const WarpRun& run);

}  // namespace pulson
