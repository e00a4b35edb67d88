#include "finer_steps.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "core/undefined.hpp"
#include "normal_quantile.hpp"
#include "posterior/shot_batch.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::inference {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::uint64_t kRefinements = 1ULL << 22U;
constexpr double kNoLikelihood = -std::numeric_limits<double>::infinity();

// An increment in two halves, whose difference is `normals`.
VectorXd refined(const Specimen& specimen, const VectorXd& z, const VectorXd& normals) {
  VectorXd fine(2 * z.size() - specimen.momentum_unknowns());
  fine.head(specimen.momentum_unknowns()) = z.head(specimen.momentum_unknowns());
  const Index channels = specimen.channels();
  for (Index to = specimen.momentum_unknowns(), from = to; channels > 0 && from < z.size(); from += channels) {
    const auto whole = z.segment(from, channels), apart = normals.segment(from, channels);
    fine.segment(to, channels) = (whole + apart) / std::numbers::sqrt2;
    fine.segment(to + channels, channels) = (whole - apart) / std::numbers::sqrt2;
    to += 2 * channels;
  }
  return fine;
}

double log_likelihood(const Specimen& specimen, const Specimen::Model& model, const VectorXd& z) {
  const posterior::ShotBatch::Ends ends = posterior::ShotBatch(specimen, model).ends(z);
  if (ends.found.front() == 0) return kNoLikelihood;
  const double value =
      -0.5 * specimen.residual(model, ends.positions.col(0)).squaredNorm() - specimen.log_volume(model);
  return std::isfinite(value) ? value : kNoLikelihood;
}

Estimate of_specimen(const ChainSetting& setting, const ThetaPoint& theta, std::size_t s, const Specimen& finer,
                     int draws) {
  const Specimen& specimen = setting.specimens[s];
  const Specimen::Model model = finer.model(setting.space.at(setting.reference.centre));
  const VectorXd& log_weights = setting.reference.log_weights[s];
  const VectorXd often = tilted(log_weights, setting.reference.components[s]);
  VectorXd coarse(draws), fine(draws);
  parallel_for(draws, [&](int i) {
    const auto number = static_cast<std::uint64_t>(i);
    const std::size_t kind = 3 * s;
    const std::size_t component =
        drawn_component(often, normal_probability(drawn(setting.seed, kRefinements, number, kind, 1)[0]));
    const VectorXd z = theta.linear[s][component].draw(
        drawn(setting.seed, kRefinements, number, kind + 1, specimen.unknowns() + specimen.data()));
    const double of_prior = log_weights[static_cast<Index>(component)] - often[static_cast<Index>(component)] -
                            log_mixture_of(setting, s, theta, 1, z).value;
    const VectorXd apart = drawn(setting.seed, kRefinements, number, kind + 2, specimen.unknowns());
    coarse[i] = of_prior + log_likelihood(specimen, theta.models[s], z);
    fine[i] = of_prior + log_likelihood(finer, model, refined(specimen, z, apart));
  });
  const double largest = coarse.maxCoeff();
  if (!(largest > kNoLikelihood) || !(fine.maxCoeff() > kNoLikelihood)) return {kUndefined, kUndefined};
  const ArrayXd of_coarse = (coarse.array() - largest).exp(), of_fine = (fine.array() - largest).exp();
  const double difference = std::log(of_fine.mean() / of_coarse.mean());
  const ArrayXd influence = of_fine / of_fine.mean() - of_coarse / of_coarse.mean();
  return {difference, std::sqrt(influence.square().mean() / static_cast<double>(draws))};
}

}  // namespace

Estimate evidence_of_finer_steps(const ChainSetting& setting, const std::vector<Specimen>& finer, int draws) {
  const ThetaPoint theta = make_theta(setting, setting.reference.centre, 1);
  Estimate sum;
  for (std::size_t s = 0; s < finer.size(); ++s) {
    const Estimate one = of_specimen(setting, theta, s, finer[s], draws);
    sum.value += one.value;
    sum.standard_error = std::hypot(sum.standard_error, one.standard_error);
  }
  return sum;
}

Specimen with_finer_steps(const PosteriorProblem& problem, std::size_t specimen) {
  matching::MatchingProblem finer = problem.specimens[specimen];
  finer.grid.steps *= 2;
  std::vector<Branch> tree = problem.tree;
  for (Branch& branch : tree) branch.grid.steps *= 2;
  return problem.motions.empty() ? Specimen(std::move(finer), std::move(tree))
                                 : Specimen(std::move(finer), problem.motions[specimen]);
}

}  // namespace pulson::inference
