#include "pulson/warp/material_flow.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "core/factorisations.hpp"
#include "core/text.hpp"
#include "pulson/core/parallel.hpp"
#include "space_motion.hpp"

namespace pulson::warp {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kSamePlace = 1e-9;  // of the size of the coordinates
// Points that go through the steps together: their label-space basis fits into a cache.
constexpr Index kBlock = 256;

// Calls task(first, size) for blocks of `count` points, on all threads.
template <class Task>
void for_blocks(Index count, const Task& task) {
  parallel_for(static_cast<int>((count + kBlock - 1) / kBlock), [&](int block) {
    const Index first = block * kBlock;
    task(first, std::min(kBlock, count - first));
  });
}

MatrixXd identity_columns(Index d, Index count) { return MatrixXd::Identity(d, d).reshaped().replicate(1, count); }

// Displacements of points with given labels, by the rows of a step.
class LabelBlock {
 public:
  LabelBlock(const LabelSpace* space, const Points& labels, bool with_gradients)
      : space_(space), labels_(labels), with_gradients_(with_gradients) {
    if (space_ != nullptr) basis_ = space_->basis(labels);
  }

  LabelDisplacements of(const std::vector<Points>& coefficients) const {
    LabelDisplacements own;
    for (const Points& row : coefficients) {
      own.places.emplace_back();
      own.gradients.emplace_back();
      if (row.size() == 0) continue;
      own.places.back() = row * basis_;
      if (with_gradients_) own.gradients.back() = space_->gradients(labels_, row);
    }
    return own;
  }

 private:
  const LabelSpace* space_;
  const Points& labels_;
  bool with_gradients_;
  MatrixXd basis_;
};

}  // namespace

Eigen::VectorXd MovedPoints::jacobians() const {
  const Index d = places.rows();
  Eigen::VectorXd determinants(places.cols());
  for (Index m = 0; m < places.cols(); ++m) determinants[m] = MatrixXd(gradients.col(m).reshaped(d, d)).determinant();
  return determinants;
}

double MovedPoints::folded_fraction() const {
  const Eigen::VectorXd determinants = jacobians();
  return determinants.size() > 0
             ? static_cast<double>(std::count_if(determinants.begin(), determinants.end(), is_fold)) /
                   static_cast<double>(determinants.size())
             : 0;
}

MaterialFlow::MaterialFlow(StochasticSystem system, Trajectory path, LabelKernel labels)
    : system_(std::move(system)),
      path_(std::move(path)),
      steps_(make_integrator(path_.integrator)->space_steps(system_, path_)) {
  const SerialBlas serial;
  check_fields();
  const std::vector<std::vector<Points>> displacements = landmark_displacements();
  check_landmarks(displacements);
  double largest = 0;
  for (const std::vector<Points>& rows : displacements)
    for (const Points& row : rows)
      if (row.size() > 0) largest = std::max(largest, row.cwiseAbs().maxCoeff());
  label_coefficients_.resize(steps_.size());
  if (largest == 0) return;
  labels_ = LabelSpace::make(labels, system_.kernel, path_.initial().q);
  for (std::size_t k = 0; k < steps_.size(); ++k)
    for (const Points& row : displacements[k])
      label_coefficients_[k].push_back(row.size() > 0 ? labels_->coefficients(row) : Points());
}

// By step and row of its table what the noise, and what compensates it, does to landmarks besides its fields over
// space; all empty where it declares nothing of the kind.
std::vector<std::vector<Points>> MaterialFlow::landmark_displacements() const {
  const NoiseModel& noise = *system_.noise;
  std::vector<std::vector<Points>> all(steps_.size());
  if (!noise.traits().displacement.has_landmarks()) return all;
  for (std::size_t k = 0; k < steps_.size(); ++k) {
    const SpaceStep& step = steps_[k];
    all[k].resize(static_cast<std::size_t>(step.drift.rows()));
    for (Index j = 0; j < step.drift.cols(); ++j) {
      const PhaseState& at = step.stages[static_cast<std::size_t>(j)];
      const bool noisy = !step.noise.col(j).isZero(0);
      const bool compensated = step.compensated && !step.drift.col(j).isZero(0);
      Points by_noise, by_compensation;
      if (noisy) by_noise = noise.gradient(at, step.w).p - noise.spatial_noise(at.q, at, step.w);
      if (compensated) by_compensation = noise.compensation_gradient(at).p - noise.spatial_compensation(at.q, at);
      for (Index i = 0; i < step.drift.rows(); ++i) {
        Points& row = all[k][static_cast<std::size_t>(i)];
        if (row.size() == 0) row = Points::Zero(at.q.rows(), at.q.cols());
        if (noisy) row += step.noise(i, j) * by_noise;
        if (compensated) row += step.drift(i, j) * by_compensation;
      }
    }
    for (Points& row : all[k])
      if (row.isZero(0)) row.resize(0, 0);
  }
  return all;
}

// A field that is declared has to be what moves the landmarks in the first step in which anything does.
void MaterialFlow::check_fields() const {
  const NoiseModel& noise = *system_.noise;
  const Displacement displacement = noise.traits().displacement;
  if (!displacement.has_field() || displacement.has_landmarks()) return;
  for (const SpaceStep& step : steps_) {
    const PhaseState& at = step.stages.front();
    const Points moved = noise.gradient(at, step.w).p;
    if (moved.isZero(0)) continue;
    if ((noise.spatial_noise(at.q, at, step.w) - moved).norm() <= kSamePlace * moved.norm()) return;
    throw std::logic_error("noise '" + noise.spec() + "' declares a field over space that is not what moves landmarks");
  }
}

// Landmarks go through the steps as points of space and must land on themselves; where they do not, a step is too long.
void MaterialFlow::check_landmarks(const std::vector<std::vector<Points>>& displacements) const {
  parallel_for(path_.grid.steps, [&](int k) {
    const auto i = static_cast<std::size_t>(k);
    const Points& end = path_.states[i + 1].q;
    Tracers points{path_.states[i].q, {}};
    const bool moved = SpatialStep(system_, steps_[i]).forward(points, {displacements[i], {}});
    const double scale = std::max(path_.states[i].q.cwiseAbs().maxCoeff(), end.cwiseAbs().maxCoeff());
    if (!moved || !((points.x - end).cwiseAbs().maxCoeff() <= kSamePlace * scale))
      throw StepError(k, path_.grid, "the map of space has no unique value at some landmark");
  });
}

std::vector<Points> MaterialFlow::paths(const Points& labels) const {
  require_size("the labels of points", labels, dimension(), labels.cols());
  std::vector<Points> places(steps_.size() + 1, Points(labels.rows(), labels.cols()));
  places.front() = labels;
  for_blocks(labels.cols(), [&](Index first, Index size) {
    const Points block = labels.middleCols(first, size);
    const LabelBlock own(labels_.get(), block, false);
    Tracers points{block, {}};
    for (std::size_t k = 0; k < steps_.size(); ++k) {
      if (!SpatialStep(system_, steps_[k]).forward(points, own.of(label_coefficients_[k])))
        throw StepError(static_cast<int>(k), path_.grid, "the map of space has no unique value at some point");
      places[k + 1].middleCols(first, size) = points.x;
    }
  });
  return places;
}

Points MaterialFlow::end(const Points& labels) const { return moved(labels, false).places; }

MovedPoints MaterialFlow::end_with_gradients(const Points& labels) const { return moved(labels, true); }

MovedPoints MaterialFlow::moved(const Points& labels, bool with_gradients) const {
  require_size("the labels of points", labels, dimension(), labels.cols());
  const Index d = labels.rows();
  MovedPoints result{Points(d, labels.cols()), MatrixXd(d * d, with_gradients ? labels.cols() : 0)};
  for_blocks(labels.cols(), [&](Index first, Index size) {
    const Points block = labels.middleCols(first, size);
    const LabelBlock own(labels_.get(), block, with_gradients);
    Tracers points{block, with_gradients ? identity_columns(d, size) : MatrixXd()};
    for (std::size_t k = 0; k < steps_.size(); ++k)
      if (!SpatialStep(system_, steps_[k]).forward(points, own.of(label_coefficients_[k])))
        throw StepError(static_cast<int>(k), path_.grid, "the map of space has no unique value at some point");
    result.places.middleCols(first, size) = points.x;
    if (with_gradients) result.gradients.middleCols(first, size) = points.gradients;
  });
  return result;
}

MovedPoints MaterialFlow::inverse(const Points& places) const {
  if (!is_diffeomorphic())
    throw InputError("the map has no inverse: its noise moves landmarks individually and may fold space");
  require_size("the places of points", places, dimension(), places.cols());
  const Index d = places.rows();
  MovedPoints result{Points(d, places.cols()), MatrixXd(d * d, places.cols())};
  for_blocks(places.cols(), [&](Index first, Index size) {
    Tracers points{places.middleCols(first, size), identity_columns(d, size)};
    for (std::size_t k = steps_.size(); k-- > 0;)
      if (!SpatialStep(system_, steps_[k]).backward(points))
        throw StepError(static_cast<int>(k), path_.grid, "the map of space cannot be inverted at some point");
    result.places.middleCols(first, size) = points.x;
    result.gradients.middleCols(first, size) = points.gradients;
  });
  return result;
}

double MaterialFlow::landmark_error() const {
  return (end(path_.initial().q) - path_.final().q).colwise().norm().maxCoeff();
}

}  // namespace pulson::warp
