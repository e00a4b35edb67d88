#include "points_without_order.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <Eigen/QR>

#include "pulson/core/alignment.hpp"

namespace pulson::audit {
namespace {

using Eigen::Index;

constexpr int kTurns = 200;  // from which the pose is sought
constexpr int kClosestRounds = 20;

Points centred(const Points& points) { return points.colwise() - points.rowwise().mean(); }

double distance_to_nearest(const Points& from, const Points& to, std::vector<int>& nearest) {
  double sum = 0;
  nearest.resize(static_cast<std::size_t>(from.cols()));
  for (Index a = 0; a < from.cols(); ++a) {
    sum += (to.colwise() - from.col(a)).colwise().squaredNorm().minCoeff(&nearest[static_cast<std::size_t>(a)]);
  }
  return std::sqrt(sum / static_cast<double>(from.cols()));
}

Eigen::MatrixXd random_rotation(Index d, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Eigen::MatrixXd any = Eigen::MatrixXd::NullaryExpr(d, d, [&] { return normal(random); });
  Eigen::MatrixXd rotation = Eigen::HouseholderQR<Eigen::MatrixXd>(any).householderQ();
  if (rotation.determinant() < 0) rotation.row(0) *= -1;
  return rotation;
}

}  // namespace

double distance_as_set(const Points& shape, const Points& target) {
  const Points fixed = centred(target), sized = centred(shape) * (centroid_size(target) / centroid_size(shape));
  std::mt19937 random(1);
  double best = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < kTurns; ++turn) {
    Points moved = random_rotation(shape.rows(), random) * sized;
    std::vector<int> nearest;
    for (int round = 0; round < kClosestRounds; ++round) {
      distance_to_nearest(moved, fixed, nearest);
      const Points partners = fixed(Eigen::all, nearest);
      if (!(diameter(partners) > 0)) break;
      moved = align(moved, partners, AlignmentKind::kRigid).apply(moved);
    }
    best = std::min(best,
                    std::max(distance_to_nearest(moved, fixed, nearest), distance_to_nearest(fixed, moved, nearest)));
  }
  return best;
}

}  // namespace pulson::audit
