#pragma once

// Notes on what a file holds and is not used unless ReadOptions ask for it.

#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::io {

/// That scales are not applied; empty where no shape has one.
std::string note_of_scales(const std::vector<Landmarks>& shapes);

/// That curves and outlines are not used; empty where there are none.
std::string note_of_curves(const std::vector<Landmarks>& shapes);

}  // namespace pulson::io
