#include "reference_weight.hpp"

#include <cmath>

#include "core/undefined.hpp"
#include "normal_quantile.hpp"
#include "posterior/fitted_draws.hpp"
#include "pulson/core/errors.hpp"
#include "random/normals.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::uint64_t kReferenceChains = 1ULL << 20U;
// How well draws fit their data, in standard deviations: those that are weighed, and those between them.
constexpr double kFitted = 1e-2;
constexpr double kPassing = 0.5;
// Nats below the evidence of the linear model: all draws of such weights together have e⁻⁴⁰ of it. Whether fitted draws
// come there, too, which only takes from them, is not searched.
constexpr double kNegligible = 40;
constexpr std::size_t kWhetherWide = (1U << 10U) - 1;  // the last of the kinds of random numbers

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
      linear.emplace_back(*setting.reference.minima[i][mode].linear, theta.models.back(), width / std::sqrt(power));
    }
  }
  return theta;
}

void LogMixture::join(double log_part) {
  log_parts[0] = log_part;
  const double larger = std::max(log_part, value);
  value = larger + std::log(std::exp(log_part - larger) + std::exp(value - larger));
}

// Of one mode the linear models differ by σ alone, and so do their residuals.
LogMixture log_mixture_of(const ChainSetting& setting, std::size_t specimen, const ThetaPoint& theta, double power,
                          const VectorXd& z, std::size_t first) {
  const std::vector<LinearAt>& linear = theta.linear[specimen];
  const std::vector<Component>& components = setting.reference.components[specimen];
  const Specimen& of = setting.specimens[specimen];
  const double volume = of.log_volume(theta.models[specimen]);
  LogMixture mixture{0, VectorXd::Constant(std::ssize(linear), kImpossible), {}};
  for (std::size_t c = 0; c < linear.size(); ++c) {
    const double width = components[c].width / std::sqrt(power);
    if (components[c].mode == mixture.residuals.size()) mixture.residuals.emplace_back(width * linear[c].residual(z));
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
                        std::size_t component, const VectorXd& z, const Specimen::Shot& shot) {
  const std::vector<LinearAt>& linear = theta.linear[specimen];
  LogWeight weight;
  LogMixture mixture = log_mixture_of(setting, specimen, theta, power, z, setting.move.fits_data ? 1 : 0);
  if (setting.move.fits_data) {
    const posterior::ShotBatch shots(setting.specimens[specimen], theta.models[specimen], &linear.front());
    if (component == 0 || are_fitted_draws(shots, linear.front(), z, shot.residual, kFitted).front() != 0)
      mixture.join(setting.reference.log_weights[specimen][0] +
                   fitted_log_densities(shots, linear.front(), z, shot.residual)[0]);
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

SpecimenDraws specimen_draws(const ChainSetting& setting, std::size_t s, const ThetaPoint& theta, double power,
                             const VectorXd& often, const VectorXd& uniforms, const MatrixXd& normals) {
  const Specimen& specimen = setting.specimens[s];
  const std::vector<LinearAt>& linear = theta.linear[s];
  const Index count = normals.cols();
  const posterior::ShotBatch shots(specimen, theta.models[s], setting.move.fits_data ? &linear.front() : nullptr);
  SpecimenDraws draws{{}, MatrixXd::Zero(specimen.unknowns(), count), {}, VectorXd::Constant(count, kImpossible)};
  std::vector<Index> to_fit;
  for (Index i = 0; i < count; ++i) {
    const std::size_t component = drawn_component(often, uniforms[i]);
    draws.components.push_back(component);
    if (setting.is_fitted(component))
      to_fit.push_back(i);
    else
      draws.z.col(i) = linear[component].draw(normals.col(i));
  }
  std::vector<char> found(static_cast<std::size_t>(count), 1);
  if (!to_fit.empty()) {
    const posterior::FittedDraws fitted = fitted_draws(shots, linear.front(), normals(Eigen::all, to_fit), kFitted);
    for (std::size_t j = 0; j < to_fit.size(); ++j) {
      found[static_cast<std::size_t>(to_fit[j])] = fitted.found[j];
      if (fitted.found[j] != 0) draws.z.col(to_fit[j]) = fitted.z.col(static_cast<Index>(j));
    }
  }
  draws.ends = shots.ends(draws.z);
  const VectorXd log_likelihoods = shots.log_likelihoods(draws.ends);
  std::vector<LogMixture> mixtures(static_cast<std::size_t>(count));
  std::vector<Index> to_weigh;  // by the density of fitted draws, too
  for (Index i = 0; i < count; ++i) {
    if (found[static_cast<std::size_t>(i)] == 0 || !(log_likelihoods[i] > kImpossible)) continue;
    LogMixture& mixture = mixtures[static_cast<std::size_t>(i)];
    mixture = log_mixture_of(setting, s, theta, power, draws.z.col(i), setting.move.fits_data ? 1 : 0);
    const double log_weight = power * log_likelihoods[i] - mixture.value;  // at most: fitted draws may come here, too
    if (!std::isnan(log_weight)) draws.log_weights[i] = log_weight;
    if (setting.move.fits_data && (setting.is_fitted(draws.components[static_cast<std::size_t>(i)]) ||
                                   log_weight > linear.front().log_evidence() - kNegligible))
      to_weigh.push_back(i);
  }
  if (to_weigh.empty()) return draws;
  MatrixXd residuals(specimen.data(), std::ssize(to_weigh));
  std::vector<Index> others;  // of those that are weighed
  for (Index j = 0; j < residuals.cols(); ++j) {
    const Index i = to_weigh[static_cast<std::size_t>(j)];
    residuals.col(j) = specimen.residual(theta.models[s], draws.ends.positions.col(i));
    if (!setting.is_fitted(draws.components[static_cast<std::size_t>(i)])) others.push_back(j);
  }
  const MatrixXd z = draws.z(Eigen::all, to_weigh);
  VectorXd densities = fitted_log_densities(shots, linear.front(), z, residuals);
  if (!others.empty()) {
    const std::vector<char> are =
        are_fitted_draws(shots, linear.front(), z(Eigen::all, others), residuals(Eigen::all, others), kFitted);
    for (std::size_t j = 0; j < others.size(); ++j)
      if (are[j] == 0) densities[others[j]] = kImpossible;
  }
  for (Index j = 0; j < residuals.cols(); ++j) {
    const Index i = to_weigh[static_cast<std::size_t>(j)];
    LogMixture& mixture = mixtures[static_cast<std::size_t>(i)];
    mixture.join(setting.reference.log_weights[s][0] + densities[j]);
    const double log_weight = power * log_likelihoods[i] - mixture.value;
    draws.log_weights[i] = std::isnan(log_weight) ? kImpossible : log_weight;
  }
  return draws;
}

namespace {

// Adds those of one specimen at one θ.
void add_draws(const ChainSetting& setting, const ThetaPoint& theta, std::size_t s, std::uint64_t first,
               ReferenceDraws& to) {
  const VectorXd& log_weights = setting.reference.log_weights[s];
  const VectorXd often =
      setting.specimens.size() == 1 ? tilted(log_weights, setting.reference.components[s]) : log_weights;
  const Index count = to.log_weights.size(), size = setting.specimens[s].unknowns() + setting.specimens[s].data();
  VectorXd uniforms(count);
  MatrixXd normals(size, count);
  for (Index i = 0; i < count; ++i) {
    const std::uint64_t number = first + static_cast<std::uint64_t>(i);
    uniforms[i] = normal_probability(drawn(setting.seed, kReferenceChains, number, 2 * s + 1, 1)[0]);
    normals.col(i) = drawn(setting.seed, kReferenceChains, number, 2 * s + 2, size);
  }
  const SpecimenDraws draws = specimen_draws(setting, s, theta, 1, often, uniforms, normals);
  to.log_weights += draws.log_weights;
  for (Index i = 0; i < count; ++i) {
    const auto component = static_cast<Index>(draws.components[static_cast<std::size_t>(i)]);
    to.log_parts[i] += log_weights[component] - often[component];
  }
}

}  // namespace

ReferenceDraws reference_draws(const ChainSetting& setting, std::uint64_t first, Index count) {
  ReferenceDraws draws{VectorXd::Zero(count), VectorXd::Zero(count)};
  const Index k = setting.space.count();
  if (k == 0) {
    const ThetaPoint theta = make_theta(setting, {}, 1);
    for (std::size_t s = 0; s < setting.specimens.size(); ++s) add_draws(setting, theta, s, first, draws);
    return draws;
  }
  for (Index i = 0; i < count; ++i) {
    const std::uint64_t number = first + static_cast<std::uint64_t>(i);
    ReferenceDraws one{VectorXd::Zero(1), VectorXd::Zero(1)};
    try {
      const VectorXd phi =
          setting.reference.draw(drawn(setting.seed, kReferenceChains, number, 0, k),
                                 normal_probability(drawn(setting.seed, kReferenceChains, number, kWhetherWide, 1)[0]));
      const ThetaPoint theta = make_theta(setting, phi, 1);
      one.log_weights[0] = log_standard_normal(phi) - setting.reference.log_density(phi);
      for (std::size_t s = 0; s < setting.specimens.size(); ++s) add_draws(setting, theta, s, number, one);
    } catch (const Error&) {
      one = {VectorXd::Constant(1, kImpossible), VectorXd::Zero(1)};
    }
    draws.log_weights[i] = one.log_weights[0];
    draws.log_parts[i] = one.log_parts[0];
  }
  return draws;
}

}  // namespace pulson::inference
