#include <cmath>
#include <cstdint>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

#include <fmt/core.h>

#include "compare/forward_samples.hpp"
#include "pulson/compare/comparison.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kSamples = 1000;  // for the share of the noise
// Between the seeds of cohorts' importance samples: with the same samples all cohorts would have the same errors.
constexpr std::uint64_t kSeedsOfCohort = 1ULL << 32U;

matching::MatchingProblem problem_of(const Cohort& cohort, const TrueModel& truth, const CohortSettings& settings) {
  CohortFit fit;
  fit.kernel = truth.kernel.empty() ? settings.kernel.spec() : truth.kernel;
  fit.noise = truth.noise.spec();
  if (truth.noise.is_own()) fit.own_noise = truth.noise.make(cohort.source);
  fit.lambda = truth.lambda;
  fit.sigma = truth.sigma;
  return shape_problem(cohort, fit, settings, 0);
}

// Mean square of a coordinate of the displacements.
double mean_square(const MatrixXd& ends, const Points& source) {
  return (ends.colwise() - source.reshaped()).squaredNorm() / static_cast<double>(ends.size());
}

// Draws that have a path are taken until there are enough.
std::vector<Landmarks> draw_cohort(const Landmarks& source, const matching::MatchingProblem& problem, int shapes,
                                   std::uint64_t seed) {
  const ForwardSamples drawn = draw_shapes(problem, 2 * shapes, seed);
  if (drawn.ends.cols() < shapes)
    throw NumericalError(fmt::format(
        "of {} shapes drawn from noise '{}', only {} could be computed; use more `grid.steps` or less noise",
        drawn.drawn, problem.system.noise->spec(), drawn.ends.cols()));
  std::vector<Landmarks> targets(static_cast<std::size_t>(shapes), source);
  for (int s = 0; s < shapes; ++s) {
    Landmarks& target = targets[static_cast<std::size_t>(s)];
    target.points = drawn.ends.col(s).reshaped(source.points.rows(), source.points.cols());
    target.source = fmt::format("shape {} drawn", s + 1);
  }
  return targets;
}

// What each candidate makes of the cohort.
RecoveredCohort fit_all(const Cohort& cohort, const std::vector<NoiseChoice>& candidates,
                        const CohortSettings& settings) {
  RecoveredCohort recovered{{candidates.size(), {{}, std::numeric_limits<double>::quiet_NaN()}}, -1};
  double score = -std::numeric_limits<double>::infinity();
  std::optional<CohortFit> none;
  for (std::size_t i = 0; i < candidates.size(); ++i) try {
      const CohortFit fit = fit_cohort(cohort, candidates[i], settings, none ? &*none : nullptr);
      if (candidates[i].spec() == "none") none = fit;
      recovered.fits[i] = {fit.fitted, fit.log_evidence};
      if (!(fit.score() > score)) continue;
      score = fit.score();
      recovered.chosen = static_cast<int>(i);
    } catch (const Error&) {
      // a model that these shapes cannot have
    }
  return recovered;
}

}  // namespace

RecoveryStudy::RecoveryStudy(const Landmarks& source, const std::vector<TrueModel>& truths,
                             const std::vector<NoiseChoice>& candidates, const RecoveryOptions& options)
    : source_(source), candidates_(candidates), options_(options) {
  const SerialBlas serial;
  if (options.cohorts < 1 || options.shapes < 1)
    throw InputError(
        fmt::format("{} cohorts of {} shapes; there must be one of each at least", options.cohorts, options.shapes));
  const Cohort alone = make_cohort(source, {source}, AlignmentKind::kNone);
  CohortSettings& settings = options_.settings;
  settings.kernel = settings.kernel.make(source.points).spec();
  settings.upper_ends = false;
  for (const TrueModel& truth : truths) {
    if (!is_complete(truth.noise, source))
      throw InputError(
          fmt::format("noise '{}' lacks parameters; drawing shapes needs all of them", truth.noise.spec()));
    problems_.push_back(problem_of(alone, truth, settings));
    RecoveryRow row{truth, std::vector<int>(candidates.size()), {}, 0, 0, 0};
    const double with = mean_square(draw_shapes(problems_.back(), kSamples, options.seed).ends, source.points);
    const double without =
        mean_square(draw_shapes(problem_of(alone, {"none", truth.lambda, truth.kernel, truth.sigma}, settings),
                                kSamples, options.seed)
                        .ends,
                    source.points);
    row.noise_share = 1 - without / with;
    row.displacement = std::sqrt(with);
    rows_.push_back(std::move(row));
  }
}

RecoveredCohort RecoveryStudy::cohort(int index) const {
  const SerialBlas serial;
  const matching::MatchingProblem& problem = problems_[static_cast<std::size_t>(index / options_.cohorts)];
  const std::vector<Landmarks> targets =
      draw_cohort(source_, problem, options_.shapes, options_.seed + 1000 + static_cast<std::uint64_t>(index));
  CohortSettings settings = options_.settings;
  settings.seed += kSeedsOfCohort * (static_cast<std::uint64_t>(index) + 1);
  CohortShapes shapes{source_, targets, options_.alignment};
  if (options_.about_own_mean) shapes.source.reset();
  return fit_all(shapes.cohort(), candidates_, settings);
}

std::vector<RecoveryRow> RecoveryStudy::rows(const std::vector<RecoveredCohort>& cohorts) const {
  std::vector<RecoveryRow> rows = rows_;
  for (std::size_t i = 0; i < cohorts.size(); ++i) {
    RecoveryRow& row = rows[i / static_cast<std::size_t>(options_.cohorts)];
    row.fits.push_back(cohorts[i].fits);
    ++(cohorts[i].chosen < 0 ? row.unfit : row.chosen[static_cast<std::size_t>(cohorts[i].chosen)]);
  }
  return rows;
}

std::vector<RecoveryRow> study_recovery(const Landmarks& source, const std::vector<TrueModel>& truths,
                                        const std::vector<NoiseChoice>& candidates, const RecoveryOptions& options) {
  const SerialBlas serial;
  const RecoveryStudy study(source, truths, candidates, options);
  std::vector<RecoveredCohort> cohorts(static_cast<std::size_t>(study.cohorts()));
  int done = 0;
  std::mutex mutex;
  parallel_for(study.cohorts(), [&](int i) {
    cohorts[static_cast<std::size_t>(i)] = study.cohort(i);
    const std::scoped_lock lock(mutex);
    if (options.on_cohort) options.on_cohort(++done, study.cohorts());
  });
  return study.rows(cohorts);
}

}  // namespace pulson::compare
