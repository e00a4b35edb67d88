#pragma once

// What is wrong with landmarks: hypotheses about shapes, each judged by how much more probable the shape would be
// without it.

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::audit {

enum class Problem : unsigned char {
  kExchanged,    ///< two landmarks have each other's names
  kMoved,        ///< a landmark is not where it belongs
  kReversed,     ///< a run of landmarks, or all of an outline, is the other way round
  kShifted,      ///< the landmarks of an outline begin at another one
  kMirrored,     ///< the shape is a mirror image
  kZero,         ///< landmarks are at the origin, or another place that stands for a missing one
  kUndigitised,  ///< all landmarks are at such a place
  kUnit,         ///< the coordinates are in another unit of length than those of the other shapes
  kAxes,         ///< axes are in another order
  kUnordered,    ///< positions have nothing in common with those of the same number, but as a set
  kForeign       ///< the shape has nothing in common with the others
};

/// `exchanged`, `moved`, …, as in audit.json.
std::string_view problem_name(Problem problem);

/// One thing that is probably wrong with one shape.
struct Finding {
  Problem problem = Problem::kExchanged;
  int specimen = 0;              ///< its place in the cohort, from 0
  std::vector<int> landmarks{};  ///< those concerned; of an outline that begins elsewhere the one it begins at; from 0
  double log_ratio = 0;          ///< likelihood of the shape with this mended over that without, natural logarithm
  double log_odds = 0;           ///< of this against nothing more being wrong; infinite where it is exactly so
  double before = 0, after = 0;  ///< root mean square distance after a similarity, length units of the shape
  double factor = 1;             ///< of kUnit: the size over that of most others
  std::string slip{};            ///< of kMoved: what was probably typed, "x is 10 times too large"; else empty
  Points corrected{};            ///< the shape without it, d×N, NaN where unknown; empty where nothing mends it
};

struct Audit {
  /// By specimen; several of one are in the order in which they are mended: `corrected` has those before it, too.
  std::vector<Finding> findings;
  Points reference;              ///< d×N, what shapes are judged by; empty where they were too few or too small
  double shapes_per_error = 50;  ///< prior: one shape in so many has an error, all kinds and places alike
};

/// Landmarks that a shape of a cohort needs to be judged: in the plane and in space one of them can then be predicted
/// from the others and their pose. A pair needs more, as nothing else shows how shapes of the kind vary.
inline constexpr int kFewestLandmarks = 4, kFewestLandmarksOfPair = 8;
inline constexpr int kMostLandmarks = 300;       ///< which cost a second
inline constexpr std::size_t kFewestShapes = 5;  ///< of a cohort

/// What is wrong with `shape`, the landmarks of which are to correspond with those of `reference` in their order. Only
/// sizes and missing codes are judged in one dimension, where order changes are no errors, and for fewer than 8 or more
/// than 300 landmarks in both. Costs O(N³).
Audit audit_pair(const Landmarks& reference, const Landmarks& shape);

/// The same of each shape of a cohort, by a law of the others.
/// @param shapes of N landmarks each; those with fewer than kFewestLandmarks are not judged; only sizes and missing
/// codes are judged where there are fewer than 5
/// @param on_progress gets the fraction that is done, from 0 to 1 and rising, from one thread at a time; may be empty
Audit audit_cohort(const std::vector<Landmarks>& shapes, const std::function<void(double)>& on_progress = {});

/// "landmarks 2 and 8 look exchanged (odds 10^9; rms distance 71.1, 14.1 without)"
std::string describe(const Finding& finding, const Landmarks& shape);

}  // namespace pulson::audit
