#pragma once

#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::audit {

/// The landmarks from `begin` on, counted from 0, around an outline; or backwards from there. shape: d×N.
Points reordered(const Points& shape, int begin, bool reversed);

/// With a and b in each other's place.
Points exchanged(Points shape, int a, int b);

/// With those from `first` to `last` backwards.
Points run_reversed(Points shape, int first, int last);

/// first, …, last
std::vector<int> run_of(int first, int last);

}  // namespace pulson::audit
