#include "tempering.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace pulson::inference {

namespace {
constexpr double kLeastPower = 1e-3;
constexpr double kLeastRejected =
    1e-3;  // probability of a pair, so that all powers differ where no exchange is rejected
}  // namespace

std::vector<double> first_powers(int count) {
  std::vector<double> powers(static_cast<std::size_t>(count), 1);
  for (std::size_t l = 1; l + 1 < powers.size(); ++l)
    powers[l] = std::pow(kLeastPower, static_cast<double>(count - 1 - static_cast<int>(l)) / (count - 2));
  if (count > 1) powers[0] = 0;
  return powers;
}

std::vector<double> retuned(const std::vector<double>& powers, const std::vector<double>& rejected) {
  std::vector<double> barrier{0};
  for (const double r : rejected) barrier.push_back(barrier.back() + std::max(r, kLeastRejected));
  std::vector<double> made = powers;
  std::size_t below = 0;
  for (std::size_t l = 1; l + 1 < made.size(); ++l) {
    const double level = barrier.back() * static_cast<double>(l) / static_cast<double>(rejected.size());
    while (barrier[below + 1] < level) ++below;
    const double fraction = (level - barrier[below]) / (barrier[below + 1] - barrier[below]);
    made[l] = std::lerp(powers[below], powers[below + 1], fraction);
  }
  return made;
}

Replicas::Replicas(const ChainSetting& setting, int number, const std::vector<double>& powers)
    : rejected_(powers.size() - 1, 0), tried_(powers.size() - 1, 0) {
  const int count = static_cast<int>(powers.size());
  for (int l = 0; l < count; ++l)
    chains_.emplace_back(setting, number * count + l, powers[static_cast<std::size_t>(l)]);
}

void Replicas::advance(int warmup) {
  for (Chain& chain : chains_) chain.advance(warmup);
  for (auto l = static_cast<std::size_t>(iteration_ % 2); l + 1 < chains_.size(); l += 2) {
    rejected_[l] += 1 - chains_[l + 1].exchange(chains_[l]);
    ++tried_[l];
  }
  ++iteration_;
}

void Replicas::set_powers(const std::vector<double>& powers) {
  for (std::size_t l = 0; l < chains_.size(); ++l) chains_[l].set_power(powers[l]);
  std::fill(rejected_.begin(), rejected_.end(), 0);
  std::fill(tried_.begin(), tried_.end(), 0);
}

void Replicas::write(StateWriter& to) const {
  for (const Chain& chain : chains_) chain.write(to);
  to(rejected_, tried_, iteration_);
}

void Replicas::read(StateReader& from) {
  for (Chain& chain : chains_) chain.read(from);
  from(rejected_, tried_, iteration_);
}

std::vector<double> Replicas::rejected() const {
  std::vector<double> mean = rejected_;
  for (std::size_t l = 0; l < mean.size(); ++l) mean[l] /= std::max(tried_[l], 1);
  return mean;
}

}  // namespace pulson::inference
