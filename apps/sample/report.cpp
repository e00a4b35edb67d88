#include "report.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "core/undefined.hpp"
#include "facts.hpp"
#include "picture.hpp"
#include "pulson/core/name_table.hpp"
#include "shell/messages.hpp"
#include "shell/report_parts.hpp"

namespace pulson {
namespace {

html::ReportTable parameter_table(const PosteriorResults& results) {
  std::vector<inference::DrawSummary> rows;
  for (const NamedSummary& parameter : results.summary.parameters) rows.push_back(parameter.numbers);
  html::ReportTable table = report_table(draw_facts(), rows, "");
  table.header.insert(table.header.begin(), {"parameter", "prior median"});
  const std::vector<inference::ParameterPrior>& priors = results.problem.parameters;
  for (std::size_t j = 0; j < rows.size(); ++j)
    table.rows[j].insert(table.rows[j].begin(), {{results.summary.parameters[j].name},
                                                 {j < priors.size() ? report_number(priors[j].median) : ""}});
  return table;
}

html::ReportTable landmarks(const inference::PosteriorProblem& problem, const PosteriorSummary& summary) {
  const Landmarks& source = problem.sources.front();
  html::ReportTable table = landmark_table(source);
  const char* const axes[] = {"x", "y", "z"};
  for (int i = 0; i < source.dimension(); ++i) {
    table.header.push_back(fmt::format("p0 {}", axes[i]));
    table.header.emplace_back("sd");
  }
  table.header.insert(table.header.end(), {"sd of q(T/2)", "R-hat", "least ESS"});
  const auto d = static_cast<std::size_t>(source.dimension());
  Eigen::VectorXd deviations(source.count());
  for (int a = 0; a < source.count(); ++a) {
    double square = 0;
    for (std::size_t i = 0; i < d; ++i)
      square += std::pow(summary.middles.front()[static_cast<std::size_t>(a) * d + i].sd, 2);
    deviations[a] = std::sqrt(square);
  }
  for (const int a : listed_landmarks(deviations)) {
    std::vector<html::ReportCell> row = landmark_cells(source, a);
    double rhat = 0, ess = INFINITY;
    for (std::size_t i = 0; i < d; ++i) {
      const std::size_t at = static_cast<std::size_t>(a) * d + i;
      const inference::DrawSummary& momentum = summary.momenta.front()[at];
      row.push_back({report_number(momentum.mean)});
      row.push_back({report_number(momentum.sd)});
      for (const auto* of : {&momentum, &summary.middles.front()[at], &summary.ends.front()[at]}) {
        rhat = max_or_undefined(rhat, of->rhat);
        ess = min_or_undefined(ess, min_or_undefined(of->ess_bulk, of->ess_tail));
      }
    }
    row.insert(row.end(), {{report_number(deviations[a])}, {report_number(rhat)}, {ess_text(ess)}});
    table.rows.push_back(std::move(row));
  }
  table.caption =
      "The first target's path: momenta, and the position at half of the time. summary.json has all targets and times.";
  return table;
}

// Of the model, the draws and their convergence.
html::ReportTable numbers_table(const PosteriorResults& results) {
  html::ReportTable table = report_facts(posterior_model_facts(), results.problem, "setting");
  const auto add = [&](const html::ReportTable& more) { std::ranges::copy(more.rows, std::back_inserter(table.rows)); };
  add(report_facts(posterior_facts(), results.draws, ""));
  add(report_facts(convergence_facts(), results.summary, ""));
  table.rows.push_back({{"confirmed"}, {confirmation_text(results.draws)}});
  return table;
}

std::optional<html::ReportMotion> motion_of(const inference::PosteriorProblem& problem,
                                            const inference::PosteriorDraws& draws) {
  const std::size_t path = shown_path(problem);
  const std::vector<Points> mean = mean_path(draws, path);
  const TimeGrid& grid = grid_of(problem, path);
  html::ReportMotion motion;
  motion.source = problem.sources.front();
  motion.target = problem.tree.empty() ? problem.targets.front() : Landmarks{};
  const std::vector<int> shown = shown_frames(grid.steps, motion.source.points.size());
  for (const int k : shown) {
    motion.times.push_back(grid.at(k));
    motion.frames.push_back(mean[static_cast<std::size_t>(k)]);
  }
  constexpr std::size_t kMostOthers = 20;
  const auto& paths = draws.paths[path];
  for (std::size_t m = 0; m < paths.size(); m += std::max<std::size_t>(1, paths.size() / kMostOthers)) {
    std::vector<Points> frames;
    for (const int k : shown) frames.push_back(paths[m][static_cast<std::size_t>(k)]);
    motion.others.push_back(std::move(frames));
  }
  if (motion.frames.size() < 2 || !can_be_drawn(motion.frames)) return std::nullopt;
  motion.others_name = fmt::format("{} posterior paths", motion.others.size());
  motion.caption = fmt::format("The posterior mean path to {}, and faintly draws of it.", end_name(problem, path));
  return motion;
}

}  // namespace

std::string pareto_text(const inference::PosteriorDraws& draws) {
  const double k = max_or_undefined(draws.pareto_k, draws.chain_pareto_k);
  return std::isnan(k) ? "undefined" : fmt::format("{:.2f}", k);
}

std::string confirmation_text(const inference::PosteriorDraws& draws) {
  const inference::Confirmation& by = draws.confirmation;
  if (by.by == inference::Confirmation::By::kNothing)
    return draws.powers.empty() ? fmt::format("by nothing else; Pareto k of the weights {}", pareto_text(draws))
                                : "by nothing else";
  const auto text = [&](std::string_view key) { return text_of(confirmation_facts(), key, by); };
  return fmt::format("{}by {}: log p(y) = {}, {} {} standard errors apart", by.agrees ? "" : "not ", text("by"),
                     text("log_evidence.value"), by.furthest_of, text("furthest"));
}

std::string model_words(const inference::PosteriorProblem& problem) {
  const matching::MatchingProblem& first = problem.specimens.front();
  const std::string noise = first.system.noise->spec();
  return fmt::format("{}, {}, lambda {:.4g}{}, sigma {:.4g}, {} in {} steps",
                     noise == "none" ? "no noise" : shortened_spec(noise), first.system.kernel.spec(4), first.lambda,
                     problem.momenta == inference::MomentumPrior::kSmooth ? " of smooth momenta" : "", first.sigma,
                     first.integrator->name(), first.grid.steps);
}

html::HtmlReport sample_report(const PosteriorResults& results, const std::filesystem::path& paths,
                               const std::filesystem::path& chains) {
  const auto& [problem, options, draws, summary, notes, warnings] = results;
  const std::string lead =
      fmt::format("{} of {}, {} in {}D: {}. Largest R-hat {}, least effective sample size of a position {}.",
                  counted(draws.chains * static_cast<std::int64_t>(draws.draws), "draw"),
                  problem.tree.empty() ? counted(static_cast<std::int64_t>(problem.targets.size()), "path")
                                       : fmt::format("{} branches", problem.tree.size()),
                  counted(problem.sources.front().count(), "landmark"), problem.sources.front().dimension(),
                  model_words(problem), rhat_text(summary.worst_rhat), ess_text(summary.ess_min));
  html::HtmlReport report = new_report("Posterior of " + start_name(problem.sources.front()), lead, warnings, notes);
  if (std::optional<html::ReportMotion> motion = motion_of(problem, draws))
    report.sections.push_back({"Motion", {std::move(*motion)}});
  add_still(report, "Paths", paths);
  report.sections.push_back({"Parameters", {parameter_table(results)}});
  add_still(report, "Chains", chains);
  report.sections.push_back({"Numbers", {numbers_table(results)}});
  if (problem.tree.empty())
    report.sections.push_back({"Landmarks", {landmarks(problem, summary)}});
  else
    report.sections.push_back(
        {"Nodes",
         {report_table(node_facts(), node_rows(results),
                       "Nodes without a parent follow the root. Posterior deviations are root mean squares over the "
                       "coordinates; nodes.csv has all of them.")}});
  return report;
}

html::HtmlReport calibration_report(const inference::PosteriorProblem& problem,
                                    const inference::Calibration& calibration, const std::vector<std::string>& notes,
                                    const std::filesystem::path& picture) {
  html::HtmlReport report =
      new_report("Calibration of the posterior",
                 fmt::format("Ranks of true values among {} posterior draws in each of {} simulations: {}.",
                             calibration.ranks, calibration.simulations, model_words(problem)),
                 {}, notes);
  html::ReportTable table{{"quantity", "within the band of 95 %", "p-value"}, {}, ""};
  for (const inference::CalibratedQuantity& quantity : calibration.quantities)
    table.rows.push_back({{quantity.name},
                          {quantity.inside_band ? "yes" : "no",
                           quantity.inside_band ? html::Verdict::kHolds : html::Verdict::kDoesNotHold},
                          {report_number(quantity.deviation, 3)}});
  report.sections.push_back({"Ranks", {std::move(table)}});
  add_still(report, "Rank histograms", picture);
  return report;
}

}  // namespace pulson
