#pragma once

#include "pulson/matching/registration.hpp"

namespace pulson {

/// Shapes that fit together, and what was left out to make them so.
struct MatchingShapes {
  Landmarks source;
  Landmarks target;
  DataOptions data;
  std::vector<std::string> notes;
};

/// Pairs landmarks by their labels where these tell, as paired_by_labels does, and leaves out those of the source that
/// miss a coordinate, with their targets, weights and covariances.
/// @throws InputError where the shapes cannot be matched, as where two landmarks of the source coincide
MatchingShapes matching_shapes(const Landmarks& source, const Landmarks& target, const DataOptions& data);

}  // namespace pulson
