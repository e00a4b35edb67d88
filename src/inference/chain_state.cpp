// What a chain goes on from, written and read.

#include <cstdint>
#include <utility>

#include "chain.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::inference {

using Eigen::VectorXd;

template <class State, class Self>
void Chain::pass_counts(State& state, Self& chain) {
  state(chain.log_angle_, chain.log_scale_, chain.centre_, chain.root_, chain.visited_);
  state(chain.accepted_, chain.theta_accepted_, chain.moves_, chain.theta_moves_, chain.evaluations_);
  state(chain.lost_draws_, chain.jumps_, chain.jumped_);
}

void Chain::write(StateWriter& to) const {
  to(power_, iteration_, theta_.phi);
  for (const ChainPoint& point : points_) {
    to(static_cast<std::int64_t>(point.component), point.v, point.z);
  }
  pass_counts(to, *this);
}

void Chain::read(StateReader& from) {
  const auto require = [](bool is_so) {
    if (!is_so) throw InputError("the saved state of the chains is of another posterior");
  };
  VectorXd phi;
  from(power_, iteration_, phi);
  require(phi.size() == setting_.space.count());
  theta_ = make_theta(setting_, phi, power_);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Specimen& specimen = setting_.specimens[i];
    ChainPoint& point = points_[i];
    std::int64_t component = 0;
    from(component, point.v, point.z);
    point.component = static_cast<std::size_t>(component);
    require(point.z.size() == specimen.unknowns() && (power_ == 0 || point.component < theta_.linear[i].size()));
    auto shot = specimen.shoot(theta_.models[i], point.z);
    require(shot.has_value());
    point.shot = std::move(*shot);
    point.weight =
        power_ == 0 ? LogWeight() : log_weight_of(setting_, i, theta_, power_, point.component, point.z, point.shot);
  }
  pass_counts(from, *this);
}

}  // namespace pulson::inference
