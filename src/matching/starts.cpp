#include "starts.hpp"

#include <cmath>
#include <numbers>
#include <numeric>
#include <set>

#include "flow_start.hpp"
#include "pulson/matching/landmark_term.hpp"
#include "ways.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Landmarks that the start by flows takes: beyond, its dense matrices cost more than all that follows.
constexpr Index kFlowLandmarks = 250;

// Of so many landmarks a search begins with so few of them: these tell nearly all of the smooth momenta.
constexpr Index kManyLandmarks = 4000;
constexpr Index kFewLandmarks = 1000;

int channels(const MatchingProblem& problem) {
  return problem.system.noise->channels(static_cast<int>(problem.source.rows()),
                                        static_cast<int>(problem.source.cols()));
}

// A target for every landmark: its own place where nothing was observed.
FlowProblem flow_problem(const MatchingProblem& problem, const std::vector<Index>& landmarks) {
  const LandmarkTerm& data = *problem.data->landmarks();
  FlowProblem flow{problem.system.kernel,
                   problem.grid,
                   problem.lambda,
                   problem.source(Eigen::all, landmarks),
                   data.target()(Eigen::all, landmarks),
                   {}};
  for (std::size_t a = 0; a < landmarks.size(); ++a) {
    flow.precisions.push_back(data.precision(landmarks[a]));
    for (Index axis = 0; axis < flow.source.rows(); ++axis) {
      const auto column = static_cast<Index>(a);
      if (flow.precisions.back()(axis, axis) == 0) flow.target(axis, column) = flow.source(axis, column);
    }
  }
  return flow;
}

Points observed_target(const MatchingProblem& problem) {
  std::vector<Index> all(static_cast<std::size_t>(problem.source.cols()));
  std::iota(all.begin(), all.end(), 0);
  return flow_problem(problem, all).target;
}

// Equal increments in all steps that carry each landmark straight to its target, as far as the noise can move it. K
// equal increments ΔW act as (K − ½)ΔW, since half of the last is lost: w_k = ½(ΔW_{k−1} + ΔW_k).
MatrixXd straight_increments(const MatchingProblem& problem, const Points& target) {
  const PhaseState rest{problem.source, Points::Zero(problem.source.rows(), problem.source.cols())};
  const Points way = (target - problem.source) / (problem.grid.steps - 0.5);
  const NoiseModel& noise = *problem.system.noise;
  // With B the map from increments to displacements: along Bᵀ·way, scaled so that B takes it to `way` where it can.
  VectorXd increments = noise.contract(rest, {Points::Zero(way.rows(), way.cols()), way});
  const double reached = noise.gradient(rest, increments).p.squaredNorm();
  if (reached > 0) increments *= increments.squaredNorm() / reached;
  return increments.replicate(1, problem.grid.steps);
}

}  // namespace

Start start_by_flow(const MatchingObjective& objective, int way, std::uint64_t seed) {
  const MatchingProblem& problem = objective.problem();
  const std::vector<Index> spread = objective.basis().spread(kFlowLandmarks);
  const FlowProblem flow = flow_problem(problem, spread);
  const Points via = way > 0 ? halfway(flow.source, flow.target, way, seed) : Points();
  const FlowStart start = flow_start(flow, way > 0 ? &via : nullptr);
  Points momenta = Points::Zero(problem.source.rows(), problem.source.cols());
  momenta(Eigen::all, spread) = start.momenta;
  return {way > 0 ? "way " + std::to_string(way + 1) : "flow", without_noise(objective, momenta), start.iterations};
}

Start start_by_noise(const MatchingObjective& objective) {
  const MatchingProblem& problem = objective.problem();
  const Points rest = Points::Zero(problem.source.rows(), problem.source.cols());
  return {"noise", objective.white(rest, straight_increments(problem, observed_target(problem)))};
}

VectorXd without_noise(const MatchingObjective& objective, const Points& p) {
  const MatchingProblem& problem = objective.problem();
  return objective.white(p, MatrixXd::Zero(channels(problem), problem.grid.steps));
}

// The steps go by the golden ratio, which no pattern in the order of the landmarks falls in with.
std::vector<Index> representatives(const MatchingObjective& objective) {
  const MatchingProblem& problem = objective.problem();
  if (channels(problem) > 0 || problem.source.cols() < kManyLandmarks) return {};
  std::vector<Index> observed;
  for (Index a = 0; a < problem.source.cols(); ++a)
    if (!problem.data->landmarks()->precision(a).isZero(0)) observed.push_back(a);
  if (std::ssize(observed) < kManyLandmarks) return {};
  const std::vector<Index> spread = objective.basis().spread(kFlowLandmarks);
  std::set<Index> chosen(spread.begin(), spread.end());
  double place = 0;  // in observed, as a part of it
  while (std::ssize(chosen) < kFewLandmarks) {
    chosen.insert(observed[static_cast<std::size_t>(place * static_cast<double>(observed.size()))]);
    place += std::numbers::phi - 1;
    place -= std::floor(place);
  }
  return {chosen.begin(), chosen.end()};
}

}  // namespace pulson
