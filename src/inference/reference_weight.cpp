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
constexpr std::size_t kWhetherWide = (1U << 10U) - 1;  // the last of the kinds of random numbers
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
    if (power == 0) continue;
    std::vector<std::size_t> first;  // component of each mode
    const std::vector<Component>& components = setting.reference.components[i];
    for (std::size_t c = 0; c < components.size(); ++c) {
      const auto [mode, width] = components[c];
      if (mode < first.size()) {
        linear.push_back(linear[first[mode]].wider(width / components[first[mode]].width));
        continue;
      }
      first.push_back(c);
      Specimen::Model wide = theta.models.back();
      wide.sigma *= width / std::sqrt(power);
      linear.emplace_back(*setting.reference.minima[i][mode].linear, wide);
    }
  }
  return theta;
}

// Of one mode the linear models differ by σ alone, and so do their residuals.
LogMixture log_mixture_of(const ChainSetting& setting, std::size_t specimen, const ThetaPoint& theta, double power,
                          const VectorXd& z, std::size_t first) {
  const std::vector<LinearAt>& linear = theta.linear[specimen];
  const std::vector<Component>& components = setting.reference.components[specimen];
  const Specimen& of = setting.specimens[specimen];
  const double volume = of.log_volume(theta.models[specimen]);
  LogMixture mixture{0, VectorXd::Constant(std::ssize(linear), kNoPath), {}};
  for (std::size_t c = 0; c < linear.size(); ++c) {
    const double width = components[c].width / std::sqrt(power);
    if (components[c].mode == mixture.residuals.size()) mixture.residuals.push_back(width * linear[c].residual(z));
    if (c < first) continue;
    mixture.log_parts[static_cast<Index>(c)] =
        setting.reference.log_weights[specimen][static_cast<Index>(c)] -
        0.5 * mixture.residuals[components[c].mode].squaredNorm() / (width * width) - volume -
        static_cast<double>(of.data()) * std::log(width) - linear[c].log_evidence();
  }
  const double largest = mixture.log_parts.maxCoeff();
  mixture.value = largest + std::log((mixture.log_parts.array() - largest).exp().sum());
  return mixture;
}

LogWeight log_weight_of(const ChainSetting& setting, std::size_t specimen, const ThetaPoint& theta, double power,
                        const VectorXd& z, const Specimen::Shot& shot) {
  const std::vector<LinearAt>& linear = theta.linear[specimen];
  LogWeight weight;
  LogMixture mixture = log_mixture_of(setting, specimen, theta, power, z, setting.move.fits_data ? 1 : 0);
  if (setting.move.fits_data) {
    const posterior::ShotBatch shots(setting.specimens[specimen], theta.models[specimen], &linear.front());
    mixture.log_parts[0] =
        setting.reference.log_weights[specimen][0] + fitted_log_densities(shots, linear.front(), z, shot.residual)[0];
    const double larger = std::max(mixture.log_parts[0], mixture.value);
    mixture.value = larger + std::log(std::exp(mixture.log_parts[0] - larger) + std::exp(mixture.value - larger));
    const VectorXd lacks = shot.residual - linear.front().apply(z);
    weight.kicked = -0.5 * lacks.dot(linear.front().solve(lacks));
  }
  weight.value = power * shot.log_likelihood - mixture.value;
  if (!setting.move.fits_data) weight.kicked = weight.value;
  weight.responsibilities = (mixture.log_parts.array() - mixture.value).exp();
  weight.residuals = std::move(mixture.residuals);
  return weight;
}

std::optional<VectorXd> draw_of(const ChainSetting& setting, std::size_t specimen, const ThetaPoint& theta,
                                std::size_t component, const VectorXd& normals, bool passing) {
  const LinearAt& linear = theta.linear[specimen][component];
  if (!setting.is_fitted(component)) return linear.draw(normals);
  const posterior::ShotBatch shots(setting.specimens[specimen], theta.models[specimen], &linear);
  const posterior::FittedDraws draws = fitted_draws(shots, linear, normals, passing ? kPassing : kFitted);
  if (!draws.found.front()) return std::nullopt;
  return draws.z.col(0);
}

std::size_t drawn_component(const VectorXd& log_weights, double uniform) {
  double below = 0;
  for (Index c = 0; c + 1 < log_weights.size(); ++c) {
    below += std::exp(log_weights[c]);
    if (uniform < below) return static_cast<std::size_t>(c);
  }
  return static_cast<std::size_t>(log_weights.size() - 1);
}

VectorXd tilted(const VectorXd& log_weights, const std::vector<Component>& components) {
  VectorXd weights = log_weights.array().exp();
  VectorXd wide = VectorXd::Zero(weights.size());
  for (std::size_t c = 1; c < components.size(); ++c)
    if (components[c].mode == components[c - 1].mode || components[c].width == kOfPrior)
      wide[static_cast<Index>(c)] = 1;
  const double part = weights.dot(wide);
  weights = weights.array() * (wide.array() * (0.5 / part) + (1 - wide.array()) * (0.5 / (1 - part)));
  return weights.array().log();
}

ReferenceDraw reference_draw(const ChainSetting& setting, std::uint64_t number) {
  const std::uint64_t chain = kReferenceChains;
  const Index k = setting.space.count();
  try {
    const VectorXd phi =
        setting.reference.draw(drawn(setting.seed, chain, number, 0, k),
                               normal_probability(drawn(setting.seed, chain, number, kWhetherWide, 1)[0]));
    const ThetaPoint theta = make_theta(setting, phi, 1);
    ReferenceDraw draw{log_standard_normal(phi) - setting.reference.log_density(phi)};
    for (std::size_t i = 0; i < setting.specimens.size(); ++i) {
      const Specimen& specimen = setting.specimens[i];
      const VectorXd& log_weights = setting.reference.log_weights[i];
      const VectorXd often =
          setting.specimens.size() == 1 ? tilted(log_weights, setting.reference.components[i]) : log_weights;
      const double uniform = normal_probability(drawn(setting.seed, chain, number, 2 * i + 1, 1)[0]);
      const std::size_t component = drawn_component(often, uniform);
      draw.log_part += log_weights[static_cast<Index>(component)] - often[static_cast<Index>(component)];
      const auto z = draw_of(setting, i, theta, component,
                             drawn(setting.seed, chain, number, 2 * i + 2, specimen.unknowns() + specimen.data()));
      if (!z) return {kNoPath, draw.log_part};
      const auto shot = specimen.shoot(theta.models[i], *z);
      if (!shot) return {kNoPath, draw.log_part};
      draw.log_weight += log_weight_of(setting, i, theta, 1, *z, *shot).value;
    }
    return draw;
  } catch (const Error&) {
    return {kNoPath};
  }
}

}  // namespace pulson::inference
