#include "sampled_evidence.hpp"

#include <cmath>

#include "core/undefined.hpp"
#include "posterior.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/inference/posterior.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::compare {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kChains = 2, kWarmup = 200, kDraws = 400;

// An observation of a shape as data.
class ProjectedTerm final : public matching::DataTerm {
 public:
  explicit ProjectedTerm(Observation observation) : observation_(std::move(observation)) {}

  double value(const Points& q) const override { return 0.5 * residual(q).squaredNorm(); }
  Points gradient(const Points& q) const override {
    return (observation_.projection.transpose() * residual(q)).reshaped(q.rows(), q.cols());
  }
  Linearisation linearise(const Points& q, const MatrixXd& changes) const override {
    return {residual(q), observation_.projection * changes};
  }
  bool is_least_squares() const override { return true; }
  VectorXd residual(const Points& q) const override { return -observation_.residual(q); }
  double log_determinant() const override { return 2 * observation_.log_volume; }

 private:
  Observation observation_;
};

struct ShapeEvidence {
  Estimate evidence{kUndefined, kUndefined};
  double rhat = kUndefined;
};

ShapeEvidence evidence_of(matching::MatchingProblem problem, Observation observation, std::uint64_t seed) {
  inference::PosteriorProblem posterior;
  problem.data = std::make_shared<ProjectedTerm>(std::move(observation));
  posterior.specimens.push_back(std::move(problem));
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
  const double sigma = settings.sigma.in(diameter(cohort.source.points));
  const auto shapes = static_cast<int>(cohort.targets.size());
  std::vector<ShapeEvidence> found(cohort.targets.size());
  parallel_for(shapes, [&](int s) {
    found[static_cast<std::size_t>(s)] = evidence_of(shape_problem(cohort, fit, settings, s), observe(cohort, s, sigma),
                                                     settings.seed + static_cast<std::uint64_t>(s));
  });
  SampledEvidence sampled;
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
