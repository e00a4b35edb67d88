// Compiled once per vector target by foreach_target.h; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "posterior/lane_shots.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
#include "lane_shots.hpp"
#include "lane_shots_body.hpp"
// clang-format on

#if HWY_ONCE

#include <algorithm>
#include <cmath>

#include "own_kernels.hpp"

namespace pulson::posterior {

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

bool LaneShots::knows(const Specimen& specimen, const Specimen::Model& model) {
  if (has_own(model.system.kernel.terms())) return false;
  const matching::MatchingProblem& problem = specimen.problem();
  const NoiseTraits traits = model.system.noise->traits();
  const std::string integrator = problem.integrator->name();
  return specimen.momentum_unknowns() > 0 && (integrator == "variational-2" || integrator == "heun") &&
         traits.hamiltonian && (traits.additive || bump_fields(*model.system.noise)) &&
         problem.source.size() <= kMostCoordinates && lanes() >= 2;
}

LaneShots::LaneShots(const Specimen& specimen, const Specimen::Model& model, const LinearAt* chord)
    : specimen_(specimen), model_(model) {
  const matching::MatchingProblem& problem = specimen.problem();
  const Points& source = problem.source;
  const Index size = source.size();
  const int steps = problem.grid.steps;
  bumps_ = bump_fields(*model.system.noise);
  if (!bumps_) {
    const Index count = specimen.channels();
    of_q_.resize(size, count);
    of_p_.resize(size, count);
    const PhaseState rest{source, Points::Zero(source.rows(), source.cols())};
    for (Index i = 0; i < count; ++i) {
      const PhaseState field = model.system.noise->gradient(rest, VectorXd::Unit(count, i));
      of_q_.col(i) = field.q.reshaped();
      of_p_.col(i) = field.p.reshaped();
    }
  }
  if (chord == nullptr) return;
  const Index n = specimen.data();
  by_start_ = chord->momentum_changes(model);
  const MatrixXd of_increments = std::sqrt(problem.grid.dt()) * chord->increment_changes();
  (bumps_ ? by_weights_ : by_q_).resize(bumps_ ? channels() : size, n * steps);
  if (!bumps_) by_p_.resize(size, n * steps);
  for (int k = 0; k < steps && channels() > 0; ++k) {
    const auto part = of_increments.middleRows(k * channels(), channels());
    if (bumps_) {
      by_weights_.middleCols(k * n, n) = part;
    } else {
      by_q_.middleCols(k * n, n) = of_p_ * part;
      by_p_.middleCols(k * n, n) = -of_q_ * part;
    }
  }
}

Specimen::Slopes LaneShots::slopes_of(const Rows& rows, Index lane, const VectorXd& end_of_path) const {
  const Index size = end_of_path.size();
  const Index steps = specimen_.problem().grid.steps;
  const double root = std::sqrt(specimen_.problem().grid.dt());
  const int lanes = LaneShots::lanes();
  using Strides = Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>;
  const auto of_step = [&](const std::vector<double>& values, Index height, Index step) {
    return MatrixXd(Eigen::Map<const MatrixXd, 0, Strides>(values.data() + step * height * size * lanes + lane, height,
                                                           size, Strides(height * lanes, lanes))
                        .transpose());
  };
  MatrixXd end = MatrixXd::Zero(size, steps * channels());
  for (Index k = 0; k < steps && channels() > 0; ++k) {
    auto part = end.middleCols(k * channels(), channels());
    if (!rows.by_weights.empty()) part = root * of_step(rows.by_weights, channels(), k);
    if (!rows.by_q.empty()) part.noalias() += root * of_step(rows.by_q, size, k) * of_p_;
    if (!rows.by_p.empty()) part.noalias() -= root * of_step(rows.by_p, size, k) * of_q_;
  }
  return {of_step(rows.by_start, size, 0), {{specimen_.projection(end_of_path), std::move(end)}}};
}

LaneShots::Shots LaneShots::shoot(const MatrixXd& z, With with) const {
  const matching::MatchingProblem& problem = specimen_.problem();
  const NoiseTraits traits = model_.system.noise->traits();
  const int lanes = LaneShots::lanes();
  const Index size = problem.source.size();
  const Index n = specimen_.data();
  const int steps = problem.grid.steps;
  MatrixXd momenta(size, z.cols());
  for (Index l = 0; l < z.cols(); ++l) momenta.col(l) = specimen_.momenta(model_, z.col(l)).reshaped();
  const std::vector<double> p0 = in_lanes(momenta, lanes);
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
  std::vector<double> ends(static_cast<std::size_t>(size) * lane_size), middles(ends.size()), found(lane_size);
  std::vector<double> slopes(with == With::kProducts ? static_cast<std::size_t>(size * n) * lane_size : 0);
  const auto rows_of_lanes = static_cast<std::size_t>(with == With::kSlopes ? size : 0) * lane_size;
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
  arguments.heun = problem.integrator->name() == "heun";
  arguments.keeps_order = channels() == 0;
  arguments.derivatives = with != With::kNothing;
  arguments.columns = static_cast<int>(n);
  arguments.half = problem.grid.dt() / 2;
  arguments.terms = &model_.system.kernel.terms();
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
  arguments.by_q = by_q_.data();
  arguments.by_p = by_p_.data();
  arguments.by_start = by_start_.data();
  arguments.ends = ends.data();
  arguments.middles = middles.data();
  arguments.found = found.data();
  arguments.slopes = with == With::kProducts ? slopes.data() : nullptr;
  arguments.rows_by_q = rows.by_q.data();
  arguments.rows_by_p = rows.by_p.data();
  arguments.rows_by_start = rows.by_start.data();
  arguments.rows_by_weights = rows.by_weights.data();
  arguments.workspace = &workspace;
  HWY_DYNAMIC_DISPATCH(ShootLanes)(arguments);
  Shots shots{of_lanes(ends, size, z.cols(), lanes),
              of_lanes(middles, size, z.cols(), lanes),
              std::vector<char>(static_cast<std::size_t>(z.cols())),
              {},
              {}};
  for (std::size_t l = 0; l < shots.found.size(); ++l) shots.found[l] = found[l] != 0 ? 1 : 0;
  for (Index l = 0; with == With::kSlopes && l < z.cols(); ++l)
    shots.slopes.push_back(slopes_of(rows, l, shots.ends.col(l)));
  for (Index l = 0; with == With::kProducts && l < z.cols(); ++l) {
    MatrixXd of_end(size, n);
    for (Index i = 0; i < size * n; ++i) of_end.reshaped()[i] = slopes[static_cast<std::size_t>(i * lanes + l)];
    shots.products.emplace_back(specimen_.units(model_).cwiseInverse().asDiagonal() *
                                (specimen_.projection(shots.ends.col(l)) * of_end));
  }
  return shots;
}

}  // namespace pulson::posterior

#endif  // HWY_ONCE
