#include "compare/notes.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

#include "compare/sampled.hpp"
#include "compare/statistics.hpp"
#include "matching/cometric.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;

constexpr double kMuchDistant = 0.1;  // of a shape's evidence: 0.1 nat, as much as two evidences may differ by

// What so few shapes, or such, cannot say.
void add_notes_of_data(Comparison& comparison) {
  const std::size_t shapes = comparison.cohort.targets.size();
  if (std::ssize(comparison.cohort.targets) < kFewestToJudge)
    comparison.notes.push_back(
        fmt::format("{} {}: too few to tell models apart; the numbers describe {}, and say nothing of others", shapes,
                    shapes == 1 ? "shape" : "shapes", shapes == 1 ? "it" : "them"));
  double square = 0;
  double count = 0;
  for (const Landmarks& target : comparison.cohort.targets)
    for (Index i = 0; i < target.points.size(); ++i)
      if (const double off = target.points.reshaped()[i] - comparison.cohort.source.points.reshaped()[i];
          !std::isnan(off)) {
        square += off * off;
        ++count;
      }
  const double sigma = comparison.settings.sigma.in(0);
  if (!comparison.settings.fit_sigma && square < count * sigma * sigma)
    comparison.notes.push_back(fmt::format(
        "the shapes differ from their source by {:.3g} (root mean square of a coordinate), less than sigma, "
        "{:.3g}: they say nothing of any model; a measured sigma may be smaller",
        std::sqrt(square / count), sigma));
}

// Standard deviation of a coordinate at the end by σ and by the noise at rest, length units.
double independent_variation(const Comparison& comparison, const CohortFit& fit) {
  const matching::MatchingProblem problem = shape_problem(comparison.cohort, fit, comparison.settings, 0);
  const Eigen::VectorXd of_noise = matching::noise_cometric(*problem.system.noise, problem.source).matrix.diagonal();
  return std::sqrt(problem.sigma * problem.sigma + problem.grid.time * of_noise.mean());
}

}  // namespace

int without_samples(const ComparedModel& model) {
  const auto& shapes = model.fit.shapes;
  return static_cast<int>(std::count_if(shapes.begin(), shapes.end(), [](const auto& s) { return !is_sampled(s); }));
}

void add_notes(Comparison& comparison, const CompareOptions& options) {
  auto& notes = comparison.notes;
  add_notes_of_data(comparison);
  for (const ComparedModel& model : comparison.models) {
    if (!model.fit.converged) notes.push_back(fmt::format("{}: the fit did not converge", model.noise));
    for (const FittedNumber& number : model.fit.fitted) {
      if (number.vanishes && number.name == "lambda")
        notes.push_back(fmt::format(
            "{}: no smooth deformation is detectable (the momenta vanish, lambda is at its upper limit)", model.noise));
      else if (comparison.settings.fit_sigma && number.acts_as_sigma() && number.correlation_with_sigma > 0)
        notes.push_back(fmt::format(
            "{}: {} has the same effect as sigma, which is fitted: the independent variation of landmarks, "
            "{:.3g}, may be either; only a measured sigma distinguishes them, or landmarks that change order",
            model.noise, number.name, independent_variation(comparison, model.fit)));
      else if (number.vanishes)
        notes.push_back(fmt::format("{}: the fit sets {} to zero ({} vanishes)", model.noise,
                                    model.fit.noise_vanishes() ? "this noise" : "a term of this noise", number.name));
      else if (number.acts_as_sigma())
        notes.push_back(
            fmt::format("{}: {} and sigma have nearly the same effect (correlation {:.2f}): too small a sigma looks "
                        "like this noise, too large a sigma hides it",
                        model.noise, number.name, number.correlation_with_sigma));
    }
    if (options.settings.importance_samples == 0) continue;
    int lost = 0;
    for (const ShapeFit& shape : model.fit.shapes) lost += shape.lost_samples;
    if (lost > 0)
      notes.push_back(fmt::format("{}: {} of the importance samples have no path and count as 0; try more `grid.steps`",
                                  model.noise, lost));
    const auto most_distant = std::max_element(model.fit.shapes.begin(), model.fit.shapes.end(),
                                               [](const auto& a, const auto& b) { return a.distant < b.distant; });
    if (most_distant->distant > kMuchDistant)
      notes.push_back(
          fmt::format("{}: up to {:.0f} % of the evidence of a shape is far from its match, which the search "
                      "for the numbers left out",
                      model.noise, 100 * most_distant->distant));
    if (const int few = without_samples(model); few > 0 && !model.fit.sampled)
      notes.push_back(
          fmt::format("{}: of {} of the {} shapes too few importance samples are effective (of one only {:.0f} %); the "
                      "evidence of these is that of Laplace's approximation, in every model",
                      model.noise, few, model.fit.shapes.size(), 100 * model.fit.effective_part));
  }
}

}  // namespace pulson::compare
