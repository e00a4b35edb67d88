#include "pulson/noise/ch_sd.hpp"

#include <cassert>

#include <fmt/core.h>

#include "pulson/core/errors.hpp"

namespace pulson {

std::string ChSd::spec() const {
  std::string text = fmt::format("ch-sd:beta={}", beta_);
  for (std::size_t i = 0; i < on_.size(); ++i) text += fmt::format("{}{}", i == 0 ? ",on=" : "/", on_[i] + 1);
  return text;
}

int ChSd::channels(int dimension, int count) const {
  return dimension * (on_.empty() ? count : static_cast<int>(on_.size()));
}

Points ChSd::position_noise(const PhaseState& state, const Eigen::VectorXd& increments) const {
  const Eigen::Index d = state.q.rows();
  assert(increments.size() == channels(static_cast<int>(d), static_cast<int>(state.q.cols())));
  if (on_.empty()) return beta_ * Eigen::Map<const Points>(increments.data(), d, state.q.cols());
  Points noise = Points::Zero(d, state.q.cols());
  for (std::size_t i = 0; i < on_.size(); ++i)
    noise.col(on_[i]) = beta_ * increments.segment(static_cast<Eigen::Index>(i) * d, d);
  return noise;
}

Eigen::VectorXd ChSd::position_noise_transposed(const PhaseState& /*state*/, const Points& q_bar) const {
  const Eigen::Index d = q_bar.rows();
  if (on_.empty()) return beta_ * q_bar.reshaped();
  Eigen::VectorXd w_bar(d * static_cast<Eigen::Index>(on_.size()));
  for (std::size_t i = 0; i < on_.size(); ++i)
    w_bar.segment(static_cast<Eigen::Index>(i) * d, d) = beta_ * q_bar.col(on_[i]);
  return w_bar;
}

void ChSd::check(int /*dimension*/, int count) const {
  if (!on_.empty() && on_.back() >= count)
    throw InputError(fmt::format("noise '{}': on={} names a landmark beyond the last; the shape has {}", spec(),
                                 on_.back() + 1, count));
}

Points NoNoise::position_noise(const PhaseState& state, const Eigen::VectorXd& /*increments*/) const {
  return Points::Zero(state.q.rows(), state.q.cols());
}

Eigen::VectorXd NoNoise::position_noise_transposed(const PhaseState& /*state*/, const Points& /*q_bar*/) const {
  return {};
}

}  // namespace pulson
