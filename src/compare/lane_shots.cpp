// Compiled once per vector target by foreach_target.h; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "compare/lane_shots.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
#include "lane_shots.hpp"
#include "lane_shots_body.hpp"
// clang-format on

#if HWY_ONCE

#include <algorithm>
#include <cmath>

#include "matching/momentum_basis.hpp"

namespace pulson::compare {

HWY_EXPORT(ShootLanes);
HWY_EXPORT(ShotLaneCount);

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kMostCoordinates = 48;  // beyond them the matrices of all lanes leave the cache

// Numbers of several columns, lane by lane.
std::vector<double> in_lanes(const MatrixXd& columns, int lanes) {
  std::vector<double> values(static_cast<std::size_t>(columns.rows() * lanes));
  for (Index i = 0; i < columns.rows(); ++i)
    for (Index l = 0; l < lanes; ++l)
      values[static_cast<std::size_t>(i * lanes + l)] = columns(i, std::min(l, columns.cols() - 1));
  return values;
}

MatrixXd of_lanes(const std::vector<double>& values, Index rows, Index count, int lanes) {
  MatrixXd columns(rows, count);
  for (Index i = 0; i < rows; ++i)
    for (Index l = 0; l < count; ++l) columns(i, l) = values[static_cast<std::size_t>(i * lanes + l)];
  return columns;
}

}  // namespace

int LaneShots::lanes() { return static_cast<int>(HWY_DYNAMIC_DISPATCH(ShotLaneCount)()); }

bool LaneShots::knows(const matching::MatchingObjective& objective) {
  const matching::MatchingProblem& problem = objective.problem();
  const NoiseTraits traits = problem.system.noise->traits();
  return problem.integrator->name() == "variational-2" && traits.hamiltonian &&
         (traits.additive || bump_fields(*problem.system.noise)) && problem.source.size() <= kMostCoordinates &&
         lanes() >= 2;
}

LaneShots::LaneShots(const matching::MatchingObjective& objective)
    : objective_(objective), momenta_(objective.basis().changes()) {
  const matching::MatchingProblem& problem = objective.problem();
  const Points& source = problem.source;
  projection_ = MatrixXd::Identity(source.size(), source.size());
  bumps_ = bump_fields(*problem.system.noise);
  if (bumps_) return;
  const Index channels = (objective.unknowns() - momenta_.cols()) / problem.grid.steps;
  of_q_.resize(source.size(), channels);
  of_p_.resize(source.size(), channels);
  const PhaseState rest{source, Points::Zero(source.rows(), source.cols())};
  for (Index i = 0; i < channels; ++i) {
    const PhaseState field = problem.system.noise->gradient(rest, VectorXd::Unit(channels, i));
    of_q_.col(i) = field.q.reshaped();
    of_p_.col(i) = field.p.reshaped();
  }
}

LaneShots::LaneShots(const matching::MatchingObjective& objective, const Observation& observation,
                     const MatrixXd& slope)
    : LaneShots(objective) {
  const matching::MatchingProblem& problem = objective.problem();
  const Index size = problem.source.size();
  const Index n = observation.count();
  const int steps = problem.grid.steps;
  projection_ = observation.projection.transpose();
  by_start_ = momenta_ * slope.leftCols(momenta_.cols()).transpose();
  (bumps_ ? by_weights_ : by_q_).resize(bumps_ ? channels() : size, n * steps);
  if (!bumps_) by_p_.resize(size, n * steps);
  const double root = std::sqrt(problem.grid.dt());
  for (int k = 0; k < steps && channels() > 0; ++k) {
    const MatrixXd part = root * slope.middleCols(momenta_.cols() + k * channels(), channels()).transpose();
    if (bumps_) {
      by_weights_.middleCols(k * n, n) = part;
    } else {
      by_q_.middleCols(k * n, n) = of_p_ * part;
      by_p_.middleCols(k * n, n) = -of_q_ * part;
    }
  }
}

MatrixXd LaneShots::changes_of(const Rows& rows, Index lane) const {
  const Index size = projection_.cols();
  const Index steps = objective_.problem().grid.steps;
  const double root = std::sqrt(objective_.problem().grid.dt());
  const int lanes = LaneShots::lanes();
  using Strides = Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>;
  const auto of_step = [&](const std::vector<double>& values, Index height, Index step) {
    return MatrixXd(Eigen::Map<const MatrixXd, 0, Strides>(values.data() + step * height * size * lanes + lane, height,
                                                           size, Strides(height * lanes, lanes))
                        .transpose());
  };
  MatrixXd changes(size, objective_.unknowns());
  changes.leftCols(momenta_.cols()).noalias() = of_step(rows.by_start, size, 0) * momenta_;
  for (Index k = 0; k < steps && channels() > 0; ++k) {
    auto part = changes.middleCols(momenta_.cols() + k * channels(), channels());
    part.setZero();
    if (!rows.by_weights.empty()) part = root * of_step(rows.by_weights, channels(), k);
    if (!rows.by_q.empty()) part.noalias() += root * of_step(rows.by_q, size, k) * of_p_;
    if (!rows.by_p.empty()) part.noalias() -= root * of_step(rows.by_p, size, k) * of_q_;
  }
  return changes;
}

LaneShots::Shots LaneShots::shoot(const MatrixXd& z, With with) const {
  const matching::MatchingProblem& problem = objective_.problem();
  const NoiseTraits traits = problem.system.noise->traits();
  const int lanes = LaneShots::lanes();
  const Index size = problem.source.size();
  const Index n = projection_.cols();
  const int steps = problem.grid.steps;
  const std::vector<double> p0 = in_lanes(momenta_ * z.topRows(momenta_.cols()), lanes);
  std::vector<double> q_kicks, p_kicks, weights;
  const MatrixXd w = std::sqrt(problem.grid.dt()) * z.bottomRows(channels() * steps);
  if (bumps_) {
    weights = in_lanes(bumps_->beta * w, lanes);
  } else if (channels() > 0) {
    MatrixXd of_positions(size * steps, z.cols()), of_momenta(size * steps, z.cols());
    for (int k = 0; k < steps; ++k) {
      of_positions.middleRows(k * size, size).noalias() = of_p_ * w.middleRows(k * channels(), channels());
      of_momenta.middleRows(k * size, size).noalias() = -of_q_ * w.middleRows(k * channels(), channels());
    }
    q_kicks = in_lanes(of_positions, lanes);
    p_kicks = in_lanes(of_momenta, lanes);
  }
  const bool has_kicks = channels() > 0 && !bumps_;
  const bool moves_positions = has_kicks && traits.moves_positions();
  const bool moves_momenta = has_kicks && traits.moves_momenta;
  const auto lane_size = static_cast<std::size_t>(lanes);
  std::vector<double> ends(static_cast<std::size_t>(size) * lane_size), found(lane_size);
  std::vector<double> slopes(with == With::kSlopes ? static_cast<std::size_t>(n * n) * lane_size : 0);
  const auto rows_of_lanes = static_cast<std::size_t>(with == With::kChanges ? size : 0) * lane_size;
  const auto of_all = [&](Index height) {
    return static_cast<std::size_t>(height) * static_cast<std::size_t>(steps) * rows_of_lanes;
  };
  Rows rows{std::vector<double>(moves_positions ? of_all(size) : 0),
            std::vector<double>(moves_momenta ? of_all(size) : 0),
            std::vector<double>(static_cast<std::size_t>(size) * rows_of_lanes),
            std::vector<double>(bumps_ ? of_all(channels()) : 0)};
  thread_local std::vector<double> workspace;
  LaneShotArguments arguments;
  arguments.dimension = static_cast<int>(problem.source.rows());
  arguments.landmarks = static_cast<int>(problem.source.cols());
  arguments.steps = steps;
  arguments.rows = with == With::kNothing ? 0 : static_cast<int>(n);
  arguments.half = problem.grid.dt() / 2;
  arguments.terms = &problem.system.kernel.terms();
  arguments.moves_positions = moves_positions;
  arguments.moves_momenta = moves_momenta;
  arguments.q0 = problem.source.data();
  arguments.p0 = p0.data();
  arguments.q_kicks = q_kicks.data();
  arguments.p_kicks = p_kicks.data();
  if (bumps_) {
    arguments.bumps = static_cast<int>(bumps_->centres.cols());
    arguments.centres = bumps_->centres.data();
    arguments.sharpness = 1 / (bumps_->width * bumps_->width);
    arguments.beta = bumps_->beta;
    arguments.weights = weights.data();
    arguments.by_weights = by_weights_.data();
  }
  arguments.projection = projection_.data();
  arguments.by_q = by_q_.data();
  arguments.by_p = by_p_.data();
  arguments.by_start = by_start_.data();
  arguments.ends = ends.data();
  arguments.found = found.data();
  arguments.slopes = with == With::kSlopes ? slopes.data() : nullptr;
  arguments.rows_by_q = rows.by_q.data();
  arguments.rows_by_p = rows.by_p.data();
  arguments.rows_by_start = rows.by_start.data();
  arguments.rows_by_weights = rows.by_weights.data();
  arguments.workspace = &workspace;
  HWY_DYNAMIC_DISPATCH(ShootLanes)(arguments);
  Shots shots{of_lanes(ends, size, z.cols(), lanes), std::vector<char>(static_cast<std::size_t>(z.cols())), {}, {}};
  for (std::size_t l = 0; l < shots.found.size(); ++l) shots.found[l] = found[l] != 0 ? 1 : 0;
  for (Index l = 0; with == With::kChanges && l < z.cols(); ++l) shots.changes.push_back(changes_of(rows, l));
  for (Index l = 0; with == With::kSlopes && l < z.cols(); ++l) {
    MatrixXd slope(n, n);
    for (Index i = 0; i < n * n; ++i) slope.reshaped()[i] = slopes[static_cast<std::size_t>(i * lanes + l)];
    shots.slopes.push_back(std::move(slope));
  }
  return shots;
}

}  // namespace pulson::compare

#endif  // HWY_ONCE
