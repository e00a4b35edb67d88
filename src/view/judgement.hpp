#pragma once

// What landmarks say of one another while they are placed, in closed form.

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "pulson/core/landmarks.hpp"

namespace pulson::view {

/// {x: (x − centre)ᵀ shape⁻¹ (x − centre) ≤ 1}
struct Ellipse {
  Eigen::Vector2d centre;
  Eigen::Matrix2d shape;

  bool contains(const Eigen::Vector2d& x) const;
};

/// Fewest landmarks that both pictures have for one more to be predicted: two fix a similarity, the third shows how
/// far shapes differ from one.
inline constexpr int kFewestKnown = 3;
/// Landmarks that are judged: more would take longer than a click.
inline constexpr int kMostJudged = 300;

struct DoubtfulLandmark {
  int landmark;
  Ellipse expected;  ///< it lies outside
};

struct Exchange {
  int a, b;
};

struct Judgement {
  std::optional<Ellipse> proposal{};         ///< of the landmark that is wanted: 95 %
  std::vector<DoubtfulLandmark> doubtful{};  ///< outside of an ellipse that all of a sound shape's leave with 5 %
  std::vector<Exchange> exchanged{};         ///< pairs that the audit accuses
  std::vector<std::string> findings{};       ///< all that it finds, a line each
};

/// Judges the landmarks of one picture by those of another, in the law by which `pulson audit` judges a pair: aligned,
/// the displacements of the others are a Gaussian process whose variance is integrated out, so that one landmark given
/// the others has a Student distribution,
///
///     e ~ t_ν(0, s²P_aa⁻¹/ν),   s² = yᵀPy without it,   ν = m − d, at most 4 (LandmarkLaw's tail of pairs).
///
/// Ellipses are its regions of a probability, widened by the error of a click.
/// @param reference, shape 2×N, NaN where not placed @param wanted a landmark that the reference has and the shape
/// lacks
Judgement judge_placement(const Points& reference, const Points& shape, std::optional<int> wanted);

}  // namespace pulson::view
