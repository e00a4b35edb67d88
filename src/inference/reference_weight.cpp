#include "reference_weight.hpp"

#include <cmath>
#include <limits>

#include "normal_quantile.hpp"
#include "posterior/fitted_draws.hpp"
#include "pulson/core/errors.hpp"
#include "random/normals.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr std::uint64_t kReferenceChains = 1ULL << 20U;
// How well draws fit their data, in standard deviations: those that are weighed, and those between them.
constexpr double kFitted = 1e-2;
constexpr double kPassing = 0.5;
constexpr double kNoPath = -std::numeric_limits<double>::infinity();

}  // namespace

VectorXd drawn(std::uint64_t seed, std::uint64_t chain, std::uint64_t iteration, std::size_t kind, Index count) {
  constexpr std::uint64_t kKinds = 1ULL << 10U, kIterations = 1ULL << 31U;
  const std::uint64_t path = (chain * kIterations + iteration) * kKinds + kind;
  // Steps are drawn four at a time.
  const auto channels = static_cast<int>((count + 3) / 4);
  return standard_normals(seed, path, channels, 4).reshaped().head(count);
}

ThetaPoint make_theta(const ChainSetting& setting, const VectorXd& phi, double power) {
  ThetaPoint theta{phi, {}, {}};
  const posterior::Numbers numbers = setting.space.at(phi);
  for (std::size_t i = 0; i < setting.specimens.size(); ++i) {
    theta.models.push_back(setting.specimens[i].model(numbers));
    std::vector<LinearAt>& linear = theta.linear.emplace_back();
    Specimen::Model wider = theta.models.back();
    wider.sigma *= setting.inflation / std::sqrt(power);
    if (power == 0) continue;
    for (const Minimum& minimum : setting.reference.minima[i]) linear.emplace_back(*minimum.linear, wider);
  }
  return theta;
}

LogWeight log_weight_of(const ChainSetting& setting, std::size_t specimen, const ThetaPoint& theta, double power,
                        const VectorXd& z, const Specimen::Shot& shot) {
  const std::vector<LinearAt>& linear = theta.linear[specimen];
  const Specimen& of = setting.specimens[specimen];
  LogWeight weight;
  if (setting.move.fits_data) {
    const posterior::ShotBatch shots(of, theta.models[specimen], &linear.front());
    weight.value = shot.log_likelihood - fitted_log_densities(shots, linear.front(), z, shot.residual)[0];
    const VectorXd lacks = shot.residual - linear.front().apply(z);
    weight.kicked = -0.5 * lacks.dot(linear.front().solve(lacks));
    return weight;
  }
  const double volume = of.log_volume(theta.models[specimen]) +
                        static_cast<double>(of.data()) * std::log(setting.inflation / std::sqrt(power));
  VectorXd logs(std::ssize(linear));
  for (std::size_t m = 0; m < linear.size(); ++m) {
    weight.residuals.push_back(linear[m].residual(z));
    const auto index = static_cast<Index>(m);
    logs[index] = setting.reference.log_weights[specimen][index] - 0.5 * weight.residuals[m].squaredNorm() - volume -
                  linear[m].log_evidence();
  }
  const double largest = logs.maxCoeff();
  const VectorXd parts = (logs.array() - largest).exp();
  weight.responsibilities = parts / parts.sum();
  weight.value = weight.kicked = power * shot.log_likelihood - largest - std::log(parts.sum());
  return weight;
}

std::optional<VectorXd> draw_of(const ChainSetting& setting, std::size_t specimen, const ThetaPoint& theta,
                                std::size_t mode, const VectorXd& normals, bool passing) {
  const LinearAt& linear = theta.linear[specimen][mode];
  if (!setting.move.fits_data) return linear.draw(normals);
  const posterior::ShotBatch shots(setting.specimens[specimen], theta.models[specimen], &linear);
  const posterior::FittedDraws draws = fitted_draws(shots, linear, normals, passing ? kPassing : kFitted);
  if (!draws.found.front()) return std::nullopt;
  return draws.z.col(0);
}

std::size_t drawn_mode(const VectorXd& log_weights, double uniform) {
  double below = 0;
  for (Index m = 0; m + 1 < log_weights.size(); ++m) {
    below += std::exp(log_weights[m]);
    if (uniform < below) return static_cast<std::size_t>(m);
  }
  return static_cast<std::size_t>(log_weights.size() - 1);
}

double reference_log_weight(const ChainSetting& setting, std::uint64_t number) {
  const std::uint64_t chain = kReferenceChains;
  const Index k = setting.space.count();
  try {
    VectorXd phi = drawn(setting.seed, chain, number, 0, k);
    if (k > 0) phi = setting.reference.centre + VectorXd(setting.reference.root.triangularView<Eigen::Lower>() * phi);
    const ThetaPoint theta = make_theta(setting, phi, 1);
    double sum = log_standard_normal(phi) - setting.reference.log_density(phi);
    for (std::size_t i = 0; i < setting.specimens.size(); ++i) {
      const Specimen& specimen = setting.specimens[i];
      const double uniform = normal_probability(drawn(setting.seed, chain, number, 2 * i + 1, 1)[0]);
      const std::size_t mode = drawn_mode(setting.reference.log_weights[i], uniform);
      const auto z = draw_of(setting, i, theta, mode,
                             drawn(setting.seed, chain, number, 2 * i + 2, specimen.unknowns() + specimen.data()));
      if (!z) return kNoPath;
      const auto shot = specimen.shoot(theta.models[i], *z);
      if (!shot) return kNoPath;
      sum += log_weight_of(setting, i, theta, 1, *z, *shot).value;
    }
    return sum;
  } catch (const Error&) {
    return kNoPath;
  }
}

}  // namespace pulson::inference
