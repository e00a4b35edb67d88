#include "pulson/compare/cohort_fit.hpp"

#include <cmath>

#include "amplitudes.hpp"
#include "fitter.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson {

double CohortFit::score() const {
  return log_evidence - 0.5 * static_cast<double>(fitted.size()) * std::log(static_cast<double>(shapes.size()));
}

CohortFit fit_cohort(const Cohort& cohort, const NoiseChoice& noise, const CohortSettings& settings) {
  const SerialBlas serial;
  return Fitter(cohort, make_open_noise(noise, cohort.source), settings).run();
}

bool is_complete(const NoiseChoice& noise, const Landmarks& shape) {
  return make_open_noise(noise, shape).open.empty();
}

MatchingProblem shape_problem(const Cohort& cohort, const CohortFit& fit, const CohortSettings& settings, int target) {
  const double sigma = settings.sigma.in(diameter(cohort.source.points));
  return {{make_kernel(fit.kernel, cohort.source.points),
           fit.own_noise ? fit.own_noise : make_noise(fit.noise, cohort.source)},
          make_integrator(settings.integrator),
          settings.grid,
          cohort.source.points,
          std::make_shared<LandmarkTerm>(
              LandmarkObservations{cohort.targets[static_cast<std::size_t>(target)].points, sigma, {}, {}}),
          sigma,
          fit.lambda,
          {}};
}

}  // namespace pulson
