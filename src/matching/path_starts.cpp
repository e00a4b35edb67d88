#include "path_starts.hpp"

#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>
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

// For each landmark a normal number: in turn correlated, as the kernel has it where they are half way, and not.
Eigen::VectorXd sides(const MatchingProblem& problem, int index, std::uint64_t seed) {
  const auto count = static_cast<int>(problem.source.cols());
  Eigen::VectorXd drawn = standard_normals(seed, static_cast<std::uint64_t>(index), 3 + count, 1).col(0).tail(count);
  if (index % 2 == 1) return drawn;
  const Points middle = problem.source + 0.5 * way_to_targets(problem);
  MatrixXd gram = problem.system.kernel.gram(middle, middle);
  gram.diagonal().array() += 1e-6 * problem.system.kernel.at_zero();
  return Eigen::LLT<MatrixXd>(gram).matrixL() * drawn;
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
    const Eigen::VectorXd drawn = sides(problem, index, seed);
    for (Index a = 0; a < way.cols(); ++a)
      if (drawn[a] < 0) bend.col(a) = -bend.col(a);
  }
  std::vector<Points> nodes = straight_path(problem);
  for (int k = 0; k <= problem.grid.steps; ++k)
    nodes[static_cast<std::size_t>(k)] += std::sin(std::numbers::pi * k / problem.grid.steps) * bend;
  return nodes;
}

}  // namespace pulson::matching
