// A comparison in words.

#include "sentences.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/core.h>
#include <fmt/ranges.h>

#include "compare/facts.hpp"
#include "pulson/core/name_table.hpp"
#include "shell/messages.hpp"
#include "summary.hpp"

namespace pulson {
namespace {

using compare::ComparedModel;
using compare::Comparison;

std::string range_name(const Comparison& comparison, const compare::SigmaProfile::Range& range) {
  if (range.is_favoured) return "noise is favoured but not distinguished from none";
  if (!range.has_noise) return "noise is not distinguished from none";
  std::vector<std::string> names;
  for (const std::size_t m : range.models) names.push_back(shortened_spec(comparison.models[m].noise));
  return fmt::format("{}", fmt::join(names, " or "));
}

std::string asked(const Comparison& comparison) {
  std::vector<std::string> names;
  for (const ComparedModel& model : comparison.models) names.push_back(shortened_spec(model.noise));
  return fmt::format("Asked: which of {} best explains {} of {}, aligned by {}, with {}", joined_words(names),
                     counted(static_cast<std::int64_t>(comparison.cohort.targets.size()), "shape"),
                     counted(comparison.cohort.source.count(), "landmark"), alignment_name(comparison.cohort.alignment),
                     comparison.settings.fit_sigma
                         ? "sigma fitted in each"
                         : fmt::format("sigma {:.4g} known", comparison.settings.sigma.in(0)));
}

std::string found(const Comparison& comparison) {
  const bool is_explained = comparison.models[comparison.best].checks && misfit(comparison).empty();
  return fmt::format("Found: {}{}", finding(comparison),
                     is_explained ? ", and cohorts drawn from the best model look like these shapes" : "");
}

std::string certainty(const Comparison& comparison) {
  const std::vector<ModelRow> rows = ranked_rows(comparison);
  if (rows.size() < 2) return "How sure: one model alone has no rival";
  if (comparison.cohort.targets.size() == 1) return "How sure: of the paths alone, as evidence needs several shapes";
  const ComparedModel& second = *rows[1].model;
  const double error = second.difference.standard_error;
  std::string text = fmt::format(
      "How sure: the best model is {:.1f}{} nats ahead of {}, of which 3 and two standard errors are decisive",
      -second.difference.value, std::isfinite(error) ? fmt::format(" ± {:.1f}", error) : "",
      shortened_spec(second.noise));
  if (const std::string range = sigma_range(comparison); !range.empty()) text += "; the verdict " + range;
  if (const std::string power = recognition_words(comparison); !power.empty()) text += "; " + power;
  return text;
}

// By the least certain of what the verdict rests on.
std::string what_would_change(const Comparison& comparison) {
  std::vector<std::string> ways;
  const bool depends = comparison.profile && comparison.profile->ranges(comparison).size() > 1;
  if (depends || comparison.settings.fit_sigma)
    ways.emplace_back("a measured sigma (the same specimens digitised twice)");
  const std::vector<ModelRow> rows = ranked_rows(comparison);
  if (rows.size() > 1 && !rows[1].model->is_behind()) ways.emplace_back("more shapes");
  if (!misfit(comparison).empty())
    ways.emplace_back(
        "another kernel family (matern52:alpha=fit), models that allow landmarks to vary by different amounts, or "
        "specimens that were mended or left out");
  if (ways.empty()) ways.emplace_back("another kernel family or alignment");
  return fmt::format("What would change it: {}", fmt::join(ways, "; "));
}

}  // namespace

std::string misfit(const Comparison& comparison) {
  const ComparedModel& best = comparison.models[comparison.best];
  if (!best.checks) return {};
  const std::vector<std::string> unexplained = best.checks->unexplained();
  if (unexplained.empty()) return {};
  std::vector<std::string> better;
  for (const ComparedModel& model : comparison.models)
    if (model.checks && model.checks->unexplained().empty()) better.push_back(shortened_spec(model.noise));
  if (comparison.models.size() == 1)
    return fmt::format("{} does not explain {}", shortened_spec(best.noise), joined_words(unexplained));
  if (better.empty()) return fmt::format("none of these models explains {}", joined_words(unexplained));
  return fmt::format("{}, which has the best score, does not explain {}, and {} {}", shortened_spec(best.noise),
                     joined_words(unexplained), joined_words(better), better.size() == 1 ? "does" : "do");
}

std::string finding(const Comparison& comparison) {
  const std::string wrong = misfit(comparison);
  if (wrong.empty()) return verdict(comparison);
  return fmt::format("{}; {}{}", wrong, comparison.models.size() > 1 ? "among them " : "", verdict(comparison));
}

std::string headline(const Comparison& comparison) {
  const std::string wrong = misfit(comparison);
  return wrong.empty() ? verdict(comparison) : wrong;
}

std::string sigma_range(const Comparison& comparison) {
  if (!comparison.profile) return {};
  const auto ranges = comparison.profile->ranges(comparison);
  if (ranges.empty()) return {};
  if (ranges.size() == 1)
    return fmt::format("is the same for sigma from {:.3g} to {:.3g} ({})", ranges.front().low, ranges.front().high,
                       range_name(comparison, ranges.front()));
  std::vector<std::string> parts;
  for (const auto& range : ranges)
    parts.push_back(fmt::format("{} from {:.3g} to {:.3g}", range_name(comparison, range), range.low, range.high));
  return fmt::format("depends on sigma: {}", fmt::join(parts, ", "));
}

std::string recognition_words(const Comparison& comparison) {
  std::vector<std::string> parts;
  for (const ComparedModel& model : comparison.models)
    if (model.recognition && model.recognition->noise_share > 0)
      parts.push_back(fmt::format("{} of {:.0f} % of the variance in {:.0f} %", shortened_spec(model.noise),
                                  100 * model.recognition->noise_share, 100 * model.recognition->part));
  if (parts.empty()) return {};
  return fmt::format("of cohorts like this one, noise would be recognised: {}", fmt::join(parts, ", "));
}

std::string steps_words(const Comparison& comparison) {
  double low = std::numeric_limits<double>::infinity(), high = -low, apart = 0;
  for (const ComparedModel& model : comparison.models) {
    if (!std::isfinite(model.score)) continue;
    const double error = model.fit.step_error.value;
    if (std::isnan(error)) return "the error of the steps is not determined";
    low = std::min(low, error);
    high = std::max(high, error);
    apart = std::max(apart, std::abs(comparison.step_error(model)));
  }
  const std::string by = high > low ? fmt::format("{:+.3f} to {:+.3f}", low, high) : fmt::format("{:+.3f}", low);
  return fmt::format("log evidences are corrected by {} to the limit of fine steps, scores by at most {:.3f}", by,
                     apart);
}

std::string steps_warning(const Comparison& comparison) {
  const std::optional<int> wanted = comparison.steps_wanted();
  if (!wanted) return {};
  return fmt::format("the steps are too long for this verdict: {}; take --steps {}", steps_words(comparison), *wanted);
}

std::vector<std::string> four_sentences(const Comparison& comparison) {
  return {asked(comparison) + ".", found(comparison) + ".", certainty(comparison) + ".",
          what_would_change(comparison) + "."};
}

}  // namespace pulson
