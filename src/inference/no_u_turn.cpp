#include "no_u_turn.hpp"

#include <algorithm>
#include <cmath>

namespace pulson::inference {

using Eigen::VectorXd;

namespace {

constexpr double kLost = 1000;  // nats above the first energy, where steps are too long to go on

double log_sum(double a, double b) {
  const double larger = std::max(a, b);
  return larger + std::log1p(std::exp(std::min(a, b) - larger));
}

bool points_back(const VectorXd& sum, const TrajectoryPoint& first, const TrajectoryPoint& last) {
  return !(first.eta.dot(sum) > 0 && last.eta.dot(sum) > 0);
}

}  // namespace

NoUTurn::NoUTurn(Step step, VectorXd uniforms, int most_doublings)
    : step_(std::move(step)), uniforms_(std::move(uniforms)), most_doublings_(most_doublings) {}

std::optional<NoUTurn::Tree> NoUTurn::leaf(const TrajectoryPoint& from, int direction) {
  ++tried_;
  std::optional<TrajectoryPoint> next = step_(from, direction);
  if (!next || !(next->energy - energy_ < kLost)) return std::nullopt;
  accepted_ += std::min(1.0, std::exp(energy_ - next->energy));
  return Tree{*next, *next, next->at, energy_ - next->energy, next->eta};
}

bool NoUTurn::turn(const Tree& before, const Tree& after) {
  return points_back(before.sum + after.sum, before.first, after.last) ||
         points_back(before.sum + after.first.eta, before.first, after.first) ||
         points_back(before.last.eta + after.sum, before.last, after.last);
}

NoUTurn::Tree NoUTurn::joined(Tree before, Tree after, bool takes_after) {
  return {std::move(before.first), std::move(after.last),
          takes_after ? std::move(after.drawn) : std::move(before.drawn), log_sum(before.log_weight, after.log_weight),
          before.sum + after.sum};
}

// 2^doublings points after `from`; none where one of them has no path, or a part turns.
std::optional<NoUTurn::Tree> NoUTurn::grown(const TrajectoryPoint& from, int direction, int doublings) {
  if (doublings == 0) return leaf(from, direction);
  std::optional<Tree> near = grown(from, direction, doublings - 1);
  if (!near) return std::nullopt;
  std::optional<Tree> far = grown(direction > 0 ? near->last : near->first, direction, doublings - 1);
  if (!far) return std::nullopt;
  const bool takes_far = std::log(uniform()) < far->log_weight - log_sum(near->log_weight, far->log_weight);
  if (direction < 0) std::swap(near, far);
  if (turn(*near, *far)) return std::nullopt;
  return joined(std::move(*near), std::move(*far), takes_far == (direction > 0));
}

ChainPoint NoUTurn::draw(const TrajectoryPoint& start) {
  energy_ = start.energy;
  Tree tree{start, start, start.at, 0, start.eta};
  for (int doublings = 0; doublings < most_doublings_; ++doublings) {
    const int direction = uniform() < 0.5 ? -1 : 1;
    std::optional<Tree> more = grown(direction > 0 ? tree.last : tree.first, direction, doublings);
    if (!more) break;
    const bool takes_more = std::log(uniform()) < more->log_weight - tree.log_weight;
    const bool ends = direction > 0 ? turn(tree, *more) : turn(*more, tree);
    tree = direction > 0 ? joined(std::move(tree), std::move(*more), takes_more)
                         : joined(std::move(*more), std::move(tree), !takes_more);
    if (ends) break;
  }
  return std::move(tree.drawn);
}

}  // namespace pulson::inference
