#include "path_starts.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "pulson/matching/data_term.hpp"
#include "random/normals.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Of bends, in parts of a landmark's displacement. Measured on random pairs in the plane, benchmarks/minima.cpp.
constexpr double kStrong = 0.8;
constexpr double kWeak = 0.4;
// The cosine of the angle by which two landmarks may turn about each other.
constexpr double kLittleTurn = 0.5;

Points way_to_targets(const MatchingProblem& problem) {
  const LandmarkTerm& data = *problem.data->landmarks();
  const Points target = data.target();
  Points way = Points::Zero(target.rows(), target.cols());
  for (Index a = 0; a < way.cols(); ++a) {
    const MatrixXd precision = data.precision(a);
    for (Index axis = 0; axis < way.rows(); ++axis)
      if (precision(axis, axis) > 0) way(axis, a) = target(axis, a) - problem.source(axis, a);
  }
  return way;
}

// Each landmark's way turned by a right angle: in space about an axis that is drawn with the index.
Points turned(const Points& way, int index, std::uint64_t seed) {
  if (way.rows() == 1) return way;
  Points side = way;
  if (way.rows() == 2) {
    side.row(0) = -way.row(1);
    side.row(1) = way.row(0);
    return side;
  }
  const Eigen::Vector3d axis = standard_normals(seed, static_cast<std::uint64_t>(index), 3, 1).col(0).normalized();
  for (Index a = 0; a < way.cols(); ++a) side.col(a) = axis.cross(Eigen::Vector3d(way.col(a)));
  return side;
}

}  // namespace

std::vector<Points> straight_path(const MatchingProblem& problem) {
  const Points way = way_to_targets(problem);
  std::vector<Points> nodes;
  for (int k = 0; k <= problem.grid.steps; ++k)
    nodes.emplace_back(problem.source + (static_cast<double>(k) / problem.grid.steps) * way);
  return nodes;
}

std::vector<Points> bent_path(const MatchingProblem& problem, int index, std::uint64_t seed) {
  const Points way = way_to_targets(problem);
  const int all_to_one_side = way.rows() == 1 ? 0 : way.rows() == 2 ? 2 : 4;
  Points bend;
  if (index < all_to_one_side) {
    bend = (index % 2 == 0 ? kStrong : -kStrong) * turned(way, index / 2, seed);
  } else {
    bend = (index % 2 == 0 ? kStrong : kWeak) * turned(way, index, seed);
    const Eigen::VectorXd drawn =
        standard_normals(seed, static_cast<std::uint64_t>(index), 3 + static_cast<int>(way.cols()), 1)
            .col(0)
            .tail(way.cols());
    for (Index a = 0; a < way.cols(); ++a)
      if (drawn[a] < 0) bend.col(a) = -bend.col(a);
  }
  std::vector<Points> nodes = straight_path(problem);
  for (int k = 0; k <= problem.grid.steps; ++k)
    nodes[static_cast<std::size_t>(k)] += std::sin(std::numbers::pi * k / problem.grid.steps) * bend;
  return nodes;
}

bool turns_little(const MatchingProblem& problem) {
  const Points& q = problem.source;
  const Points end = q + way_to_targets(problem);
  for (Index b = 1; b < q.cols(); ++b)
    for (Index a = 0; a < b; ++a) {
      const Eigen::VectorXd before = q.col(b) - q.col(a), after = end.col(b) - end.col(a);
      if (before.dot(after) < kLittleTurn * before.norm() * after.norm()) return false;
    }
  return true;
}

}  // namespace pulson::matching
