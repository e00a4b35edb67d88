#include "localisation.hpp"

#include <cmath>
#include <numeric>

#include "pulson/inference/ensemble_kalman.hpp"
#include "random/normals.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double gaspari_cohn(double distance, double radius) {
  if (std::isinf(radius)) return 1;
  const double z = 2 * distance / radius;
  if (z >= 2) return 0;
  if (z <= 1) return 1 + z * z * (-5.0 / 3 + z * (5.0 / 8 + z * (0.5 - z / 4)));
  return 4 - 5 * z + z * z * (5.0 / 3 + z * (5.0 / 8 + z * (-0.5 + z / 12))) - 2 / (3 * z);
}

ChannelSites channel_sites(const NoiseModel& noise, const Points& q0, double reach) {
  constexpr int kProbes = 32;
  constexpr std::uint64_t kSeed = 0x6c6f63616c;
  const Index d = q0.rows(), n = q0.cols();
  const Index channels = noise.channels(static_cast<int>(d), static_cast<int>(n));
  ChannelSites sites{std::vector<std::vector<Index>>(static_cast<std::size_t>(n)), {}};
  if (std::isinf(reach)) {
    sites.wide.resize(static_cast<std::size_t>(channels));
    std::iota(sites.wide.begin(), sites.wide.end(), Index(0));
    return sites;
  }
  if (channels == 0) return sites;
  const Eigen::VectorXd origin = q0.rowwise().mean();
  const PhaseState rest{q0, Points::Zero(d, n)};
  VectorXd mass = VectorXd::Zero(channels), squares = VectorXd::Zero(channels);
  MatrixXd moments = MatrixXd::Zero(d, channels);
  for (int t = 0; t < kProbes; ++t) {
    const Points signs = standard_normals(kSeed, static_cast<std::uint64_t>(t), static_cast<int>(d), static_cast<int>(n))
                             .unaryExpr([](double x) { return x < 0 ? -1.0 : 1.0; });
    const VectorXd plain = noise.contract(rest, {signs, signs});
    mass += plain.cwiseAbs2();
    for (Index k = 0; k < d; ++k) {
      const Points weighted = signs * (q0.row(k).array() - origin[k]).matrix().asDiagonal();
      const VectorXd moment = noise.contract(rest, {weighted, weighted});
      moments.row(k) += plain.cwiseProduct(moment).transpose();
      squares += moment.cwiseAbs2();
    }
  }
  for (Index i = 0; i < channels; ++i) {
    if (!(mass[i] > 0)) {
      sites.wide.push_back(i);
      continue;
    }
    const VectorXd centre = moments.col(i) / mass[i];
    Index nearest = 0;
    (q0.colwise() - (origin + centre)).colwise().squaredNorm().minCoeff(&nearest);
    const bool is_wide = squares[i] / mass[i] - centre.squaredNorm() > reach * reach;
    (is_wide ? sites.wide : sites.of_landmark[static_cast<std::size_t>(nearest)]).push_back(i);
  }
  return sites;
}

}  // namespace pulson::inference
