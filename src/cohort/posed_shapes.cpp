#include "posed_shapes.hpp"

#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "core/factorisations.hpp"

namespace pulson::cohort {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMostPlacings = 50;
constexpr double kPlaced = 1e-12;  // movement of the mean by the last change of pose, of its size

// An orthonormal basis of what is orthogonal to the columns.
MatrixXd complement(const MatrixXd& columns) {
  if (columns.cols() == 0) return MatrixXd::Identity(columns.rows(), columns.rows());
  const Eigen::HouseholderQR<MatrixXd> factors(columns);
  return MatrixXd(factors.householderQ()).rightCols(columns.rows() - columns.cols());
}

MatrixXd directions_at(const Points& mean, AlignmentKind alignment) {
  std::vector<Index> all(static_cast<std::size_t>(mean.size()));
  std::iota(all.begin(), all.end(), 0);
  return motion_directions(mean, alignment, all);
}

// The generalised least squares of poses from the observed coordinates of one shape.
class PoseEstimate {
 public:
  // @param covariance regular, dN×dN
  PoseEstimate(const MatrixXd& covariance, const MatrixXd& directions, const std::vector<Index>& observed)
      : z_(directions(observed, Eigen::all)), factors_(covariance(observed, observed)) {
    vz_ = factors_.solve(z_);
    if (z_.cols() > 0) normal_.compute(z_.transpose() * vz_);
  }

  const Eigen::LLT<MatrixXd>& factors() const { return factors_; }
  const MatrixXd& z() const { return z_; }

  // (ZᵀV⁻¹Z)⁻¹ZᵀV⁻¹ displacements
  MatrixXd pose(const MatrixXd& displacements) const { return solved(vz_.transpose() * displacements); }
  // (ZᵀV⁻¹Z)⁻¹ right
  MatrixXd solved(const MatrixXd& right) const { return z_.cols() > 0 ? MatrixXd(normal_.solve(right)) : right; }

 private:
  MatrixXd z_, vz_;
  Eigen::LLT<MatrixXd> factors_;
  Eigen::LDLT<MatrixXd> normal_;
};

Points with_those_that_count(Points points, const VectorXd& precisions) {
  for (Index a = 0; a < precisions.size(); ++a)
    if (precisions[a] == 0) points.col(a).setConstant(std::nan(""));
  return points;
}

// Regular: the flat prior of poses covers whatever variance is added along Z.
MatrixXd with_poses(const MatrixXd& covariance, const MatrixXd& directions) {
  const double along = covariance.trace() / static_cast<double>(covariance.rows());
  return covariance + along * directions * directions.transpose();
}

}  // namespace

std::vector<Index> places_of(const Points& points, bool observed) {
  std::vector<Index> chosen;
  for (Index a = 0; a < points.cols(); ++a)
    for (Index axis = 0; axis < points.rows(); ++axis)
      if (points.col(a).allFinite() == observed) chosen.push_back(a * points.rows() + axis);
  return chosen;
}

Alignment composed(const Alignment& second, const Alignment& first) {
  return {first.kind, second.scale * first.scale, second.linear * first.linear,
          second.scale * second.linear * first.translation + second.translation};
}

Alignment inverted(const Alignment& similarity) {
  const MatrixXd linear = similarity.linear.transpose();
  return {similarity.kind, 1 / similarity.scale, linear, -linear * similarity.translation / similarity.scale};
}

PosedShapes::PosedShapes(Points mean, AlignmentKind alignment, const MatrixXd& covariance, double noise)
    : mean_(std::move(mean)),
      alignment_(alignment),
      directions_(directions_at(mean_, alignment)),
      basis_(complement(directions_)),
      covariance_(basis_ * (basis_.transpose() * covariance * basis_) * basis_.transpose()),
      noise_(noise) {}

// Regular.
MatrixXd PosedShapes::covariance_of(const VectorXd& precisions, const std::vector<Index>& observed) const {
  MatrixXd all = with_poses(covariance_, directions_);
  if (precisions.size() == 0) return all;
  for (const Index place : observed) all(place, place) += noise_ * (1 / precisions[place / mean_.rows()] - 1);
  return all;
}

PosedShapes::Conditional PosedShapes::condition(const Points& placed, const VectorXd& precisions) const {
  const Points counted = with_those_that_count(placed, precisions);
  Conditional found{places_of(counted, true), places_of(counted, false), {}, {}, {}, {}, {}, 0};
  const std::vector<Index>&observed = found.observed, &missing = found.missing;
  const MatrixXd all = covariance_of(precisions, observed);
  const PoseEstimate estimate(all, directions_, observed);
  const VectorXd displacement = (placed - mean_).reshaped()(observed);
  found.pose = estimate.pose(displacement);
  found.information = estimate.factors().solve(MatrixXd::Identity(std::ssize(observed), std::ssize(observed)));
  found.information -=
      found.information * estimate.z() * estimate.pose(MatrixXd::Identity(std::ssize(observed), std::ssize(observed)));
  found.distance = displacement.dot(found.information * displacement);
  if (missing.empty()) return found;
  const MatrixXd regression = estimate.factors().solve(all(observed, missing)).transpose();
  const MatrixXd left = directions_(missing, Eigen::all) - regression * estimate.z();
  found.weights = regression + left * estimate.pose(MatrixXd::Identity(std::ssize(observed), std::ssize(observed)));
  found.displacement = found.weights * displacement;
  found.covariance =
      all(missing, missing) - regression * all(observed, missing) + left * estimate.solved(left.transpose());
  return found;
}

Alignment PosedShapes::placing(const Points& given, const VectorXd& precisions) const {
  const Points shape = with_those_that_count(given, precisions);
  Alignment map = inverted(align(mean_, shape, alignment_, {.weights = precisions}));
  if (alignment_ == AlignmentKind::kNone) return map;
  const std::vector<Index> observed = places_of(shape, true);
  const bool is_complete = std::ssize(observed) == mean_.size() && precisions.size() == 0;  // then (ZᵀV⁻¹Z)⁻¹ZᵀV⁻¹ = Zᵀ
  const MatrixXd all = is_complete ? MatrixXd(0, 0) : covariance_of(precisions, observed);
  const std::optional<PoseEstimate> estimate =
      is_complete ? std::nullopt : std::optional<PoseEstimate>(std::in_place, all, directions_, observed);
  for (int round = 0; round < kMostPlacings; ++round) {
    const VectorXd displacement = (map.apply(shape) - mean_).reshaped()(observed);
    const VectorXd pose = estimate ? VectorXd(estimate->pose(displacement)) : directions_.transpose() * displacement;
    const Points moved = mean_ + (directions_ * pose).reshaped(mean_.rows(), mean_.cols());
    map = composed(align(moved, mean_, alignment_), map);
    if (pose.norm() <= kPlaced * mean_.norm()) break;
  }
  return map;
}

ExpectedShapes expected_shapes(const PosedShapes& law, const std::vector<Points>& shapes) {
  ExpectedShapes expected;
  expected.uncertain = MatrixXd::Zero(law.covariance().rows(), law.covariance().cols());
  for (const Points& shape : shapes) {
    expected.placings.push_back(law.placing(shape));
    expected.placed.push_back(expected.placings.back().apply(shape));
    Points complete = expected.placed.back();
    if (!complete.allFinite()) {
      const PosedShapes::Conditional found = law.condition(complete);
      complete.reshaped()(found.missing) = law.mean().reshaped()(found.missing) + found.displacement;
      expected.uncertain(found.missing, found.missing) += found.covariance;
    }
    expected.complete.push_back(std::move(complete));
  }
  return expected;
}

Points updated_mean(const PosedShapes& law, const std::vector<Points>& complete, AlignmentKind alignment) {
  const Points& before = law.mean();
  Points sum = Points::Zero(before.rows(), before.cols());
  for (const Points& shape : complete) sum += shape - before;
  const VectorXd step = sum.reshaped() / static_cast<double>(complete.size());
  const VectorXd free = step - law.directions() * (law.directions().transpose() * step);
  Points mean = before + free.reshaped(before.rows(), before.cols());
  if (alignment == AlignmentKind::kSimilarity) {
    const VectorXd middle = mean.rowwise().mean();
    const double scale = centroid_size(before) / centroid_size(mean);
    mean = (scale * (mean.colwise() - middle)).colwise() + middle;
  }
  return mean;
}

}  // namespace pulson::cohort
