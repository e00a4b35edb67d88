#pragma once

#include <memory>
#include <string>

#include "pulson/core/time_grid.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::posterior {

/// A path of a tree of shapes. It begins where its parent ends, or at the source.
struct Branch {
  std::string name;  ///< of the node at its end
  int parent = -1;   ///< −1: the source
  TimeGrid grid;
  std::shared_ptr<const matching::DataTerm> data;  ///< of the shape at its end, least squares; none: not observed
};

}  // namespace pulson::posterior
