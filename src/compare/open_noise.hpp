#pragma once

#include <string>
#include <vector>

#include "pulson/noise/noise_table.hpp"

namespace pulson::compare {

/// A noise model some of whose numbers are to be fitted.
struct OpenNoise {
  std::shared_ptr<const NoiseModel> model;  ///< the open numbers at 1
  std::vector<Eigen::Index> open;           ///< which of NoiseModel::parameters() they are
  bool is_own = false;                      ///< NoiseChoice::is_own()
};

/// The model of a specification in which required numbers may be left out, as `ch-sd`: these are open; a model
/// that is given as such has none. @throws InputError as make_noise() does
OpenNoise make_open_noise(const NoiseChoice& choice, const Landmarks& shape);

}  // namespace pulson::compare
