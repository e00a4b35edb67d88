#include "pulson/compare/cohort_fit.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

#include "cohort_model.hpp"
#include "core/determined.hpp"
#include "fit.hpp"
#include "forward_samples.hpp"
#include "open_noise.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::compare {

double CohortFit::score() const {
  return log_evidence - 0.5 * static_cast<double>(fitted.size()) * std::log(static_cast<double>(shapes.size()));
}

Eigen::VectorXd CohortFit::log_evidences() const {
  Eigen::VectorXd evidences(std::ssize(shapes));
  std::transform(shapes.begin(), shapes.end(), evidences.begin(), [](const ShapeFit& fit) { return fit.log_evidence; });
  return evidences;
}

bool CohortFit::noise_vanishes() const {
  const auto scales = [](const FittedNumber& number) { return number.scales_noise; };
  return std::any_of(fitted.begin(), fitted.end(), scales) &&
         std::all_of(fitted.begin(), fitted.end(),
                     [&](const FittedNumber& number) { return number.vanishes || !scales(number); });
}

bool CohortFit::momenta_vanish() const {
  return std::any_of(fitted.begin(), fitted.end(),
                     [](const FittedNumber& number) { return number.vanishes && number.name == "lambda"; });
}

namespace {

// Momenta and noise have priors; numbers that are fitted have none.
void require_determined_numbers(const CohortModel& cohort, const std::string& name) {
  Eigen::Index coordinates = 0;
  for (int s = 0; s < cohort.shapes(); ++s) coordinates += cohort.specimen(s).coordinates();
  require_determined_parameters(fmt::format("noise '{}' is", name), cohort.count(), coordinates,
                                "give more shapes or landmarks, or numbers such as lambda");
}

}  // namespace

CohortFit fit_cohort(const Cohort& cohort, const NoiseChoice& noise, const CohortSettings& settings,
                     const CohortFit* none) {
  const SerialBlas serial;
  const CohortModel model(cohort, make_open_noise(noise, cohort.source), settings);
  require_determined_numbers(model, noise.spec());
  if (!model.may_lack_noise()) return fit_model(model);
  if (none != nullptr) return fit_model(model, none);
  const CohortFit found = fit_model(CohortModel(cohort, make_open_noise("none", cohort.source), settings));
  return fit_model(model, &found);
}

int sufficient_steps(const Cohort& cohort, CohortSettings settings) {
  const SerialBlas serial;
  constexpr int kFewest = 5, kMost = 80;
  constexpr double kExact = 0.1;  // of σ
  constexpr int kDrawn = 100;
  constexpr int kWithPath = 98;
  settings.importance_samples = 0;
  const auto integrator = make_integrator(settings.integrator);
  int steps = kFewest;
  for (; steps < kMost; steps *= 2) try {
      settings.grid.steps = steps;
      const CohortFit fit = fit_roughly(CohortModel(cohort, make_open_noise("none", cohort.source), settings));
      const matching::MatchingProblem problem = shape_problem(cohort, fit, settings, 0);
      const StochasticSystem& system = problem.system;
      const TimeGrid finer{settings.grid.time, 2 * steps};
      const bool exact = std::all_of(fit.shapes.begin(), fit.shapes.end(), [&](const ShapeFit& shape) {
        const Points end =
            integrator
                ->integrate(system, {cohort.source.points, shape.momenta}, finer, Eigen::MatrixXd::Zero(0, finer.steps))
                .final()
                .q;
        return (end - shape.end).norm() <= kExact * fit.sigma * std::sqrt(static_cast<double>(end.size()));
      });
      const ForwardSamples drawn = draw_shapes(problem, kDrawn, settings.seed);
      if (exact && fit.converged && drawn.ends.cols() >= kWithPath) break;
    } catch (const NumericalError&) {
      // too few for these shapes
    }
  return steps;
}

bool is_complete(const NoiseChoice& noise, const Landmarks& shape) {
  return make_open_noise(noise, shape).open.empty();
}

matching::MatchingProblem shape_problem(const Cohort& cohort, const CohortFit& fit, const CohortSettings& settings,
                                        int target) {
  const double sigma = fit.sigma > 0 ? fit.sigma : settings.sigma.in(diameter(cohort.source.points));
  return {{make_kernel(fit.kernel, cohort.source.points),
           fit.own_noise ? fit.own_noise : make_noise(fit.noise, cohort.source)},
          make_integrator(settings.integrator),
          settings.grid,
          cohort.source.points,
          std::make_shared<matching::LandmarkTerm>(
              matching::LandmarkObservations{cohort.targets[static_cast<std::size_t>(target)].points,
                                             sigma,
                                             cohort.weights_of(static_cast<std::size_t>(target)),
                                             {}}),
          sigma,
          fit.lambda,
          {},
          kFaint};
}

}  // namespace pulson::compare
