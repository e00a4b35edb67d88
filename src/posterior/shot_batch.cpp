#include "shot_batch.hpp"

#include <algorithm>
#include <cmath>

#include "core/undefined.hpp"
#include "lane_shots.hpp"

namespace pulson::posterior {

using Eigen::Index;
using Eigen::MatrixXd;

namespace {

// Whether a step of a lane contracts may turn on the last bits, which the lanes beside it have a share in: so what was
// found once is not asked again where its derivatives are wanted.

// task(first column, columns) for as many at once as there are lanes.
template <class Task>
void for_each_group(Index columns, const Task& task) {
  const Index lanes = LaneShots::lanes();
  for (Index first = 0; first < columns; first += lanes) task(first, std::min(lanes, columns - first));
}

}  // namespace

ShotBatch::ShotBatch(const Specimen& specimen, const Specimen::Model& model, const LinearAt* chord)
    : specimen_(specimen), model_(model), chord_(chord) {
  if (LaneShots::knows(specimen, model)) lanes_ = std::make_unique<LaneShots>(specimen, model, chord);
}

ShotBatch::~ShotBatch() = default;

Index ShotBatch::at_once() const { return lanes_ ? LaneShots::lanes() : 1; }

ShotBatch::Ends ShotBatch::ends(const MatrixXd& z) const {
  const Index size = specimen_.problem().source.size();
  Ends ends{MatrixXd::Zero(size * std::ssize(specimen_.branches()), z.cols()), {}, {}};
  ends.middles = ends.positions;
  if (lanes_) {
    for_each_group(z.cols(), [&](Index first, Index count) {
      const LaneShots::Shots shots = lanes_->shoot(z.middleCols(first, count), LaneShots::With::kNothing);
      ends.positions.middleCols(first, count) = shots.ends;
      ends.middles.middleCols(first, count) = shots.middles;
      ends.found.insert(ends.found.end(), shots.found.begin(), shots.found.end());
    });
    return ends;
  }
  for (Index l = 0; l < z.cols(); ++l) {
    const auto paths = specimen_.paths(model_, z.col(l));
    ends.found.push_back(paths ? 1 : 0);
    for (std::size_t b = 0; paths && b < paths->size(); ++b) {
      const auto place = Eigen::seqN(static_cast<Index>(b) * size, size);
      ends.positions(place, l) = (*paths)[b].final().q.reshaped();
      const std::vector<PhaseState>& states = (*paths)[b].states;
      ends.middles(place, l) = states[states.size() / 2].q.reshaped();
    }
  }
  return ends;
}

Eigen::VectorXd ShotBatch::log_likelihoods(const Ends& ends) const {
  Eigen::VectorXd logs = Eigen::VectorXd::Constant(ends.positions.cols(), kImpossible);
  for (Index l = 0; l < logs.size(); ++l) {
    if (ends.found[static_cast<std::size_t>(l)] == 0) continue;
    const double value = specimen_.log_likelihood(model_, specimen_.residual(model_, ends.positions.col(l)));
    if (std::isfinite(value)) logs[l] = value;
  }
  return logs;
}

std::vector<Specimen::Slopes> ShotBatch::slopes(const MatrixXd& z) const {
  std::vector<Specimen::Slopes> slopes(static_cast<std::size_t>(z.cols()));
  if (lanes_) {
    for_each_group(z.cols(), [&](Index first, Index count) {
      LaneShots::Shots shots = lanes_->shoot(z.middleCols(first, count), LaneShots::With::kSlopes);
      for (std::size_t l = 0; l < shots.slopes.size(); ++l)
        if (shots.slopes[l].momenta.allFinite() && shots.slopes[l].branches.front().end.allFinite())
          slopes[static_cast<std::size_t>(first) + l] = std::move(shots.slopes[l]);
    });
    return slopes;
  }
  for (Index l = 0; l < z.cols(); ++l)
    if (const auto shot = specimen_.shoot(model_, z.col(l)))
      slopes[static_cast<std::size_t>(l)] = specimen_.slopes(model_, *shot);
  return slopes;
}

std::vector<MatrixXd> ShotBatch::products(const MatrixXd& z) const {
  std::vector<MatrixXd> products(static_cast<std::size_t>(z.cols()));
  if (lanes_) {
    for_each_group(z.cols(), [&](Index first, Index count) {
      LaneShots::Shots shots = lanes_->shoot(z.middleCols(first, count), LaneShots::With::kProducts);
      for (std::size_t l = 0; l < shots.products.size(); ++l)
        if (shots.products[l].allFinite()) products[static_cast<std::size_t>(first) + l] = std::move(shots.products[l]);
    });
    return products;
  }
  const std::vector<Specimen::Slopes> slopes = this->slopes(z);
  for (std::size_t l = 0; l < products.size(); ++l)
    if (!slopes[l].branches.empty()) products[l] = chord_->product(slopes[l], model_);
  return products;
}

}  // namespace pulson::posterior
