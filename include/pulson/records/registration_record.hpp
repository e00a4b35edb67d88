#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "pulson/matching/fit_parameters.hpp"
#include "pulson/matching/homotopy.hpp"
#include "pulson/matching/landmark_shares.hpp"

namespace pulson {

/// Counts that measure how far the result is from a diffeomorphic image of the source; none where undefined.
struct TopologyCounts {
  std::optional<int> order_inversions;   ///< d = 1: pairs of landmarks that changed order
  std::optional<int> flipped_triangles;  ///< d = 2: flipped triangles of the source's Delaunay triangulation
};

/// Additional facts about a registration.
struct RegistrationFacts {
  TopologyCounts counts{};
  LandmarkShares shares{};
  std::optional<FittedParameters> fitted{};  ///< where parameters were fitted before
  std::vector<HomotopyStep> homotopy{};      ///< where it was followed
};

/// `registration.json`: the record of a registration, arrays as [landmark][axis] and increments as [step][channel],
/// numbers in the fewest digits that read back to the same bits. `source` is q0, where the flow begins: the original
/// after alignment.
std::string registration_json(const Registration& registration, const RegistrationFacts& facts);

/// Reads what registration_json wrote. @param own the noise models, where the record's is one of your own
/// @throws InputError that names the file, the key and what would be right
Registration read_registration(const std::filesystem::path& path, const NoiseTable* own = nullptr);

/// `residuals.csv`: one row per landmark with result and distance; for landmark data also with target and residual; and
/// with what there is of its shares. A number that is not there, as of a target that was not observed, is NA.
std::string residuals_csv(const Registration& registration, const LandmarkShares& shares);

/// `trajectory.csv`: one row per step and landmark with time, position and momentum.
std::string trajectory_csv(const Registration& registration, const Trajectory& path);

}  // namespace pulson
