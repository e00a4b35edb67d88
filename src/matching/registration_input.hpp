#pragma once

#include <functional>

#include "pulson/matching/registration.hpp"

namespace pulson::matching {

/// Shapes that fit together, and what was left out to make them so.
struct MatchingShapes {
  Landmarks source;
  Landmarks target;
  DataOptions data;
  std::vector<std::string> notes;
  /// How the source's landmarks are joined where the data are curves: as make_curve() does before landmarks at one
  /// place become one, so that lines which meet there stay whole.
  std::vector<std::pair<int, int>> source_edges{};
};

/// Pairs landmarks by their labels where these identify them, as paired_by_labels does, and leaves out those of the
/// source that miss a coordinate, with their targets, weights and covariances. Landmarks at one place in the source
/// become one: for curves always, else where the target has them so, too, or as `data` asks. @param may_separate
/// whether two landmarks at the same position in this source may separate; by default not
/// @throws InputError where the shapes cannot be matched
MatchingShapes matching_shapes(const Landmarks& source, const Landmarks& target, const DataOptions& data,
                               const std::function<bool(const Landmarks& source, int, int)>& may_separate = {});

}  // namespace pulson::matching
