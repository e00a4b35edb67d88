#include "sampled_evidence.hpp"

#include <cmath>

#include "cohort_model.hpp"
#include "core/undefined.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/inference/posterior.hpp"

namespace pulson::compare {

namespace {

constexpr int kChains = 2, kWarmup = 200, kDraws = 400;

struct ShapeEvidence {
  Estimate evidence{kUndefined, kUndefined};
  double rhat = kUndefined;
};

ShapeEvidence evidence_of(matching::MatchingProblem problem, AlignmentKind pose, std::uint64_t seed) {
  inference::PosteriorProblem posterior;
  posterior.specimens.push_back(std::move(problem));
  posterior.pose = pose;
  inference::SamplerOptions options;
  options.chains = kChains;
  options.warmup = kWarmup;
  options.draws = kDraws;
  options.paths_kept = 0;
  options.searches = 1;
  options.seed = seed;
  try {
    const inference::PosteriorDraws draws = sample_posterior(posterior, options);
    return {draws.log_evidence, inference::summarise(draws.by_chain(draws.log_likelihood.transpose())).rhat};
  } catch (const NumericalError&) {
    return {};
  }
}

}  // namespace

SampledEvidence sample_evidence(const Cohort& cohort, const CohortFit& fit, const CohortSettings& settings) {
  const auto shapes = static_cast<int>(cohort.targets.size());
  std::vector<ShapeEvidence> found(cohort.targets.size());
  parallel_for(shapes, [&](int s) {
    found[static_cast<std::size_t>(s)] = evidence_of(shape_problem(cohort, fit, settings, s), cohort.alignment,
                                                     settings.seed + static_cast<std::uint64_t>(s));
  });
  SampledEvidence sampled;
  sampled.total.value = fit.of_own_mean;
  double variance = 0;
  for (const ShapeEvidence& shape : found) {
    sampled.shapes.push_back(shape.evidence);
    sampled.total.value += shape.evidence.value;
    variance += shape.evidence.standard_error * shape.evidence.standard_error;
    sampled.worst_rhat = max_or_undefined(sampled.worst_rhat, shape.rhat);
  }
  sampled.total.standard_error = std::sqrt(variance);
  return sampled;
}

}  // namespace pulson::compare
