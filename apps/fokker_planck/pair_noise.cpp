#include "pair_noise.hpp"

#include <cmath>

namespace pulson {

std::optional<std::array<double, 2>> independent_amplitudes(const NoiseModel& noise, const PhaseState& pair) {
  const NoiseTraits traits = noise.traits();
  if (!traits.additive || traits.moves_momenta) return std::nullopt;
  const int channels = noise.channels(1, 2);
  std::array<double, 2> betas{};
  for (int i = 0; i < channels; ++i) {
    const PhaseState load = noise.gradient(pair, Eigen::VectorXd::Unit(channels, i));
    if (load.p(0) * load.p(1) != 0) return std::nullopt;
    for (std::size_t a = 0; a < 2; ++a) betas.at(a) = std::hypot(betas.at(a), load.p(static_cast<Eigen::Index>(a)));
  }
  return betas;
}

}  // namespace pulson
