#include "localisation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/factorisations.hpp"
#include "pulson/core/parallel.hpp"
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

LocalWeights::LocalWeights(const matching::LandmarkTerm& data, Points q0) : q0_(std::move(q0)), first_{0} {
  for (Index a = 0; a < q0_.cols(); ++a)
    first_.push_back(first_.back() + (data.precision(a).diagonal().array() > 0).count());
}

LocalData LocalWeights::near(Index landmark, double radius) const {
  LocalData local;
  std::vector<double> roots;
  for (Index b = 0; b < q0_.cols(); ++b) {
    const double weight = gaspari_cohn((q0_.col(b) - q0_.col(landmark)).norm(), radius);
    if (!(weight > 0)) continue;
    for (Index row = first_[static_cast<std::size_t>(b)]; row < first_[static_cast<std::size_t>(b) + 1]; ++row) {
      local.rows.push_back(row);
      roots.push_back(std::sqrt(weight));
    }
  }
  local.roots = Eigen::Map<const VectorXd>(roots.data(), std::ssize(roots));
  return local;
}

LocalData LocalWeights::all(double weight) const {
  LocalData all{std::vector<Index>(static_cast<std::size_t>(first_.back())),
                VectorXd::Constant(first_.back(), std::sqrt(weight))};
  std::iota(all.rows.begin(), all.rows.end(), Index(0));
  return all;
}

double resolved_data(const LocalData& local, const MatrixXd& anomalies) {
  const MatrixXd predicted = anomalies(Eigen::all, local.rows) * local.roots.asDiagonal();
  MatrixXd gram = predicted.rows() < predicted.cols() ? MatrixXd(predicted * predicted.transpose())
                                                      : MatrixXd(predicted.transpose() * predicted);
  gram /= static_cast<double>(anomalies.rows() - 1);
  gram.diagonal().array() += 1;
  const Index size = gram.rows();
  const Eigen::LLT<MatrixXd> factors(gram);
  return static_cast<double>(size) - MatrixXd(factors.matrixL().solve(MatrixXd::Identity(size, size))).squaredNorm();
}

double wanted_data(Index members, Index dimension) {
  constexpr double kMembersPerDatum = 8;
  return std::max(static_cast<double>(members) / kMembersPerDatum, 2.0 * static_cast<double>(dimension));
}

double automatic_localisation(const LocalWeights& data, const MatrixXd& anomalies) {
  constexpr Index kMostCentres = 8;
  constexpr int kHalvings = 8;
  const Points& q0 = data.source();
  const double wanted = wanted_data(anomalies.rows(), q0.rows());
  if (resolved_data(data.all(1), anomalies) <= wanted) return std::numeric_limits<double>::infinity();
  const Index every = std::max<Index>(1, (q0.cols() + kMostCentres - 1) / kMostCentres);
  const Index centres = (q0.cols() + every - 1) / every;
  VectorXd resolved(centres);
  const auto mean_resolved = [&](double radius) {
    parallel_for(static_cast<int>(centres),
                 [&](int c) { resolved[c] = resolved_data(data.near(c * every, radius), anomalies); });
    return resolved.mean();
  };
  double low = median_nearest_distance(q0), high = low;
  while (mean_resolved(high) < wanted) {
    low = std::exchange(high, 2 * high);
    if (low > 2 * diameter(q0)) return std::numeric_limits<double>::infinity();
  }
  for (int i = 0; i < kHalvings && high > low; ++i) {
    const double middle = (low + high) / 2;
    (mean_resolved(middle) < wanted ? low : high) = middle;
  }
  return high;
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
    const Points signs =
        standard_normals(kSeed, static_cast<std::uint64_t>(t), static_cast<int>(d), static_cast<int>(n))
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
