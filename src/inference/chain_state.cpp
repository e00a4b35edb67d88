// What a chain goes on from, written and read.

#include <utility>

#include "chain.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::inference {

using Eigen::VectorXd;

void Chain::write(StateWriter& to) const {
  to(power_);
  to(iteration_);
  to(theta_.phi);
  for (const ChainPoint& point : points_) {
    to(static_cast<std::int64_t>(point.mode));
    to(point.v);
    to(point.z);
  }
  to(log_angle_);
  to(log_scale_);
  to(centre_);
  to(root_);
  to(visited_);
  to(accepted_);
  to(theta_accepted_);
  to(moves_);
  to(theta_moves_);
  to(evaluations_);
  to(lost_draws_);
}

void Chain::read(StateReader& from) {
  const auto require = [](bool is_so) {
    if (!is_so) throw InputError("the saved state of the chains is of another posterior");
  };
  from(power_);
  from(iteration_);
  VectorXd phi;
  from(phi);
  require(phi.size() == setting_.space.count());
  theta_ = make_theta(setting_, phi, power_);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Specimen& specimen = setting_.specimens[i];
    ChainPoint& point = points_[i];
    std::int64_t mode = 0;
    from(mode);
    from(point.v);
    from(point.z);
    point.mode = static_cast<std::size_t>(mode);
    require(point.z.size() == specimen.unknowns() && (power_ == 0 || point.mode < theta_.linear[i].size()));
    auto shot = specimen.shoot(theta_.models[i], point.z);
    require(shot.has_value());
    point.shot = std::move(*shot);
    point.weight = power_ == 0 ? LogWeight() : log_weight_of(setting_, i, theta_, power_, point.z, point.shot);
  }
  from(log_angle_);
  from(log_scale_);
  from(centre_);
  from(root_);
  from(visited_);
  from(accepted_);
  from(theta_accepted_);
  from(moves_);
  from(theta_moves_);
  from(evaluations_);
  from(lost_draws_);
}

}  // namespace pulson::inference
