#include "sampled.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/undefined.hpp"
#include "posterior/fitted_draws.hpp"
#include "pulson/core/parallel.hpp"
#include "random/normals.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using posterior::LinearAt;
using posterior::ShotBatch;
using posterior::Specimen;

constexpr Index kLeastSets = 4;  // of which a variance is known to half of itself
// Of ε + r(z) − v, in standard deviations of the data. What is missing varies with the draw, so that a draw has not
// quite the density it is weighed with. Where up to 1 was missing the evidence of 20 ovals was 0.1 nats too great,
// where up to 3, 0.6.
constexpr double kAccuracy = 1e-2;
// Of the samples by which numbers are searched: of the log evidence of a shape, mean over the shapes. What the draws
// gain at a maximum of theirs grows with it and not with the number of shapes, to which errors and curvature of the
// cohort's evidence are both proportional. On the leaves, with 0.10, the maximum was that of a few draws; 287
// salamanders have 0.03.
constexpr double kMostShapeVariance = 0.05;
constexpr std::uint64_t kDistant = 1U << 20, kRefined = 1U << 21;  // of the streams of random numbers

// (ζ, ε) of normal numbers for the data, the momenta and the noise: in that order, so that with and without noise those
// of the others are the same.
VectorXd drawn_normals(const Specimen& specimen, std::uint64_t seed, std::uint64_t path, int refinements) {
  const Index data = specimen.data(), momenta = specimen.momentum_unknowns();
  const Index controls = (specimen.unknowns() - momenta) >> refinements;
  const VectorXd normals = standard_normals(seed, path, static_cast<int>(data + momenta + controls), 1);
  VectorXd zeta = normals.tail(momenta + controls);
  for (int i = 1; i <= refinements; ++i)
    zeta = posterior::refined(
        specimen, zeta,
        standard_normals(seed, path + static_cast<std::uint64_t>(i) * kRefined, static_cast<int>(zeta.size()), 1));
  VectorXd of_draw(specimen.unknowns() + data);
  of_draw << zeta, normals.head(data);
  return of_draw;
}

// Without noise draws that differ in its sign are alike, and are left out: the evidence of noise that vanishes is that
// of none.
MatrixXd with_all_signs(const VectorXd& normals, Index momenta, Index controls) {
  MatrixXd columns(normals.size(), controls > 0 ? kMostOfOneSet : 2);
  columns.leftCols(2) << normals, -normals;
  if (controls == 0) return columns;
  columns.rightCols(2) = columns.leftCols(2);
  columns.block(momenta, 2, controls, 2) *= -1;
  return columns;
}

// Of the weights of draws, a set of signs in each column.
ImportanceEstimate of_weights(const Eigen::Ref<const MatrixXd>& log_weights) {
  const double largest = log_weights.maxCoeff();
  const auto samples = static_cast<int>(log_weights.size());
  if (!std::isfinite(largest) || log_weights.hasNaN())
    return {largest, 0, samples, 0, samples, VectorXd::Constant(log_weights.cols(), largest)};
  const Eigen::ArrayXXd weights = (log_weights.array() - largest).exp();
  const Eigen::ArrayXd of_sets = weights.colwise().mean();
  const double mean = of_sets.mean();
  const auto count = static_cast<double>(of_sets.size());
  ImportanceEstimate found;
  found.variance = (of_sets / mean - 1).square().sum() / (count * std::max(1.0, count - 1));
  found.log_evidence = largest + std::log(mean) + 0.5 * found.variance;
  found.samples = samples;
  found.effective_samples = weights.sum() * weights.sum() / weights.square().sum();
  found.log_sets = largest + of_sets.log();
  found.lost = static_cast<int>((log_weights.array() == kImpossible).count());
  return found;
}

// Logs of the weights of draws. @param starts v of each, which are replaced by where the iterations end
VectorXd log_weights(const ShotBatch& shots, const LinearAt& linear, const MatrixXd& normals,
                     Eigen::Ref<MatrixXd> starts) {
  posterior::FittedDraws draws = fitted_draws(shots, linear, normals, kAccuracy, starts);
  // Where the iteration leads nowhere from the end of an earlier one it begins as if there were none.
  std::vector<Index> again;
  for (Index l = 0; l < normals.cols(); ++l)
    if (!draws.found[static_cast<std::size_t>(l)] && !std::isnan(starts(0, l))) again.push_back(l);
  if (!again.empty()) {
    const posterior::FittedDraws anew = fitted_draws(shots, linear, normals(Eigen::all, again), kAccuracy);
    for (std::size_t i = 0; i < again.size(); ++i) {
      const auto from = static_cast<Index>(i);
      draws.z.col(again[i]) = anew.z.col(from);
      draws.residuals.col(again[i]) = anew.residuals.col(from);
      draws.v.col(again[i]) = anew.v.col(from);
      draws.found[static_cast<std::size_t>(again[i])] = anew.found[i];
    }
  }
  VectorXd weights = VectorXd::Constant(normals.cols(), kImpossible);
  starts.setConstant(std::numeric_limits<double>::quiet_NaN());
  std::vector<Index> found;
  for (Index l = 0; l < normals.cols(); ++l)
    if (draws.found[static_cast<std::size_t>(l)]) found.push_back(l);
  if (found.empty()) return weights;
  const MatrixXd residuals = draws.residuals(Eigen::all, found);
  const VectorXd densities = fitted_log_densities(shots, linear, draws.z(Eigen::all, found), residuals);
  for (std::size_t i = 0; i < found.size(); ++i) {
    const auto from = static_cast<Index>(i);
    starts.col(found[i]) = draws.v.col(found[i]);
    if (std::isfinite(densities[from]))
      weights[found[i]] = shots.specimen().log_likelihood(shots.model(), residuals.col(from)) - densities[from];
  }
  return weights;
}

}  // namespace

ImportanceEstimate sample_shape(const CohortModel& cohort, int shape, const Specimen::Model& model,
                                const posterior::LinearModel& chord, int samples, double enough, DrawStarts& starts,
                                int refinements) {
  const Specimen& specimen = cohort.specimen(shape);
  const LinearAt linear(chord, model);
  const ShotBatch shots(specimen, model, &linear);
  const Index momenta = specimen.momentum_unknowns(), controls = specimen.unknowns() - momenta;
  const auto size = static_cast<int>(specimen.unknowns() + specimen.data());
  const Index of_set = controls > 0 ? kMostOfOneSet : 2;
  const Index sets = (samples + kMostOfOneSet - 1) / kMostOfOneSet;
  if (starts.cols() != of_set * sets)
    starts = MatrixXd::Constant(specimen.data(), of_set * sets, std::numeric_limits<double>::quiet_NaN());
  MatrixXd weights = MatrixXd::Constant(of_set, sets, kImpossible);
  const Index sets_at_once = enough > 0 ? std::max<Index>(1, shots.at_once() / of_set) : sets;
  const std::uint64_t seed = cohort.settings().seed + static_cast<std::uint64_t>(shape);
  for (Index i = 0; i < sets; i += sets_at_once) {
    const Index some = std::min(sets_at_once, sets - i);
    MatrixXd normals(size, of_set * some);
    for (Index j = 0; j < some; ++j)
      normals.middleCols(of_set * j, of_set) = with_all_signs(
          drawn_normals(specimen, seed, static_cast<std::uint64_t>(i + j), refinements), momenta, controls);
    weights.middleCols(i, some).reshaped() =
        log_weights(shots, linear, normals, starts.middleCols(of_set * i, of_set * some));
    if (i + some < kLeastSets) continue;
    ImportanceEstimate so_far = of_weights(weights.leftCols(i + some));
    if (std::isfinite(so_far.log_evidence) && so_far.variance <= enough) return so_far;
  }
  return of_weights(weights);
}

SampledCohort sample_cohort(const CohortModel& cohort, const VectorXd& x, const Matches& chords, int samples,
                            std::vector<DrawStarts>& starts) {
  const Specimen::Model model = cohort.model(x, chords);
  SampledCohort all{0, 0, std::vector<VectorXd>(static_cast<std::size_t>(cohort.shapes())), true};
  std::vector<ImportanceEstimate> of_shapes(all.log_sets.size());
  starts.resize(all.log_sets.size());
  const double most = kMostShapeVariance * cohort.shapes();
  for (int first = 0; first < cohort.shapes() && all.variance <= most; first += kShapesAtOnce) {
    const int some = std::min(kShapesAtOnce, cohort.shapes() - first);
    parallel_for(some, [&](int i) {
      const auto s = static_cast<std::size_t>(first + i);
      of_shapes[s] = sample_shape(cohort, first + i, model, *chords.minima[s].linear, samples, 0, starts[s]);
    });
    for (int i = 0; i < some; ++i) all.variance += of_shapes[static_cast<std::size_t>(first + i)].variance;
  }
  all.enough = all.variance <= most;
  if (!all.enough) return all;
  for (std::size_t s = 0; s < of_shapes.size(); ++s) all.log_sets[s] = std::move(of_shapes[s].log_sets);
  all.log_evidence = sum_of_log_means(all.log_sets);
  all.enough = std::isfinite(all.log_evidence);
  return all;
}

namespace {

// log of the mean of e^l over the sets of other groups, and half of its variance, which the logarithm takes off.
double log_mean(const VectorXd& logs, Index first_group, int left_out) {
  const double largest = logs.maxCoeff();
  if (!std::isfinite(largest)) return largest;
  double sum = 0, squares = 0, count = 0;
  for (Index i = 0; i < logs.size(); ++i) {
    if ((first_group + i) % kDrawGroups == left_out) continue;
    const double weight = std::exp(logs[i] - largest);
    sum += weight;
    squares += weight * weight;
    ++count;
  }
  const double mean = sum / count;
  const double variance = (squares / count - mean * mean) / (mean * mean * std::max(1.0, count - 1));
  return largest + std::log(mean) + 0.5 * variance;
}

}  // namespace

double sum_of_log_means(const std::vector<VectorXd>& log_sets, int left_out) {
  double sum = 0;
  Index first_group = 0;
  for (const VectorXd& logs : log_sets) {
    sum += log_mean(logs, first_group, left_out);
    first_group += logs.size();
  }
  return sum;
}

namespace {

constexpr double kWider = 2;               // than the linear posterior
constexpr double kNegligibleWeight = -14;  // nats, beside the evidence
constexpr double kExactRoot = 1e-3;        // as kAccuracy, where it is asked to what root the iteration leads
constexpr double kSamePlace = 0.1;         // in white unknowns; roots that differ are farther apart

// z of a draw from the linear posterior twice as wide: of (ζ, ε), z − mean = A(ζ, ε) is its deviation.
VectorXd wide_draw(const LinearAt& linear, const VectorXd& normals) {
  const VectorXd mean = linear.mean();
  return mean + kWider * (linear.draw(normals) - mean);
}

// The weight of z as a draw of half prior, half wide, if the draws about the match do not come to it.
double distant_weight(const Specimen& specimen, const Specimen::Model& model, const LinearAt& linear,
                      const VectorXd& z) {
  const auto shot = specimen.shoot(model, z);
  bool contracts = shot.has_value();
  VectorXd residual;
  if (shot) {
    residual = shot->residual;
  } else {
    // Of the path from z, wherever there is one: a search among those whose steps contract does not come to the others.
    const matching::MatchingProblem& problem = specimen.problem();
    try {
      residual = specimen.residual(model, problem.integrator
                                              ->integrate(model.system, {problem.source, specimen.momenta(model, z)},
                                                          problem.grid, specimen.increments(0, z))
                                              .final()
                                              .q.reshaped());
    } catch (const StepError&) {
      return 0;
    }
  }
  const VectorXd off = (z - linear.mean()) / kWider;
  const double of_prior = -0.5 * z.squaredNorm();
  const double of_wide = -0.5 * (off.squaredNorm() + linear.apply(off).squaredNorm()) + linear.half_log_determinant() -
                         static_cast<double>(z.size()) * std::log(kWider);
  const double larger = std::max(of_prior, of_wide);
  const double density = larger + std::log(0.5 * (std::exp(of_prior - larger) + std::exp(of_wide - larger)));
  const double weight = specimen.log_likelihood(model, residual) - 0.5 * z.squaredNorm() - density - linear.laplace();
  if (!(weight > kNegligibleWeight)) return 0;
  if (contracts) {  // the iteration of the draw of η ends there: it depends on ζ and ε by η = ζ − Jᵀε alone
    VectorXd normals = VectorXd::Zero(specimen.unknowns() + specimen.data());
    normals.head(specimen.unknowns()) = z + linear.transposed(residual);
    const ShotBatch shots(specimen, model, &linear);
    const posterior::FittedDraws end = fitted_draws(shots, linear, normals, kExactRoot);
    if (end.found.front() && (end.z.col(0) - z).norm() <= kSamePlace) return 0;
  }
  return std::exp(weight);
}

}  // namespace

DistantEvidence sample_distant(const CohortModel& cohort, int shape, const Matches& matches, int samples) {
  const Specimen& specimen = cohort.specimen(shape);
  const LinearAt linear(*matches.minima[static_cast<std::size_t>(shape)].linear, matches.model);
  const std::uint64_t seed = cohort.settings().seed + static_cast<std::uint64_t>(shape);
  VectorXd weights(samples);
  for (Index i = 0; i < samples; ++i) {
    const VectorXd normals = standard_normals(seed, kDistant + static_cast<std::uint64_t>(i),
                                              static_cast<int>(specimen.unknowns() + specimen.data()), 1);
    const VectorXd z = i % 2 == 0 ? VectorXd(normals.head(specimen.unknowns())) : wide_draw(linear, normals);
    weights[i] = distant_weight(specimen, matches.model, linear, z);
  }
  const auto count = static_cast<double>(samples);
  const double mean = weights.mean();
  return {mean, (weights.array() - mean).square().sum() / (count * std::max(1.0, count - 1))};
}

}  // namespace pulson::compare
