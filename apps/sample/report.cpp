#include "report.hpp"

#include <cmath>

#include <fmt/format.h>

#include "core/undefined.hpp"
#include "picture.hpp"
#include "pulson/core/name_table.hpp"
#include "shell/messages.hpp"
#include "shell/report_parts.hpp"

namespace pulson {
namespace {

html::ReportTable parameter_table(const inference::PosteriorProblem& problem, const PosteriorSummary& summary) {
  html::ReportTable table{
      {"parameter", "prior median", "mean", "sd", "5 %", "50 %", "95 %", "MCSE", "R-hat", "bulk ESS", "tail ESS"},
      {},
      ""};
  for (std::size_t j = 0; j < summary.parameters.size(); ++j) {
    const auto& [name, numbers] = summary.parameters[j];
    const std::string median = j < problem.parameters.size() ? report_number(problem.parameters[j].median) : "–";
    table.rows.push_back({{name},
                          {median},
                          {report_number(numbers.mean)},
                          {report_number(numbers.sd)},
                          {report_number(numbers.q05)},
                          {report_number(numbers.q50)},
                          {report_number(numbers.q95)},
                          {report_number(numbers.mcse, 2)},
                          {report_number(numbers.rhat)},
                          {ess_text(numbers.ess_bulk)},
                          {ess_text(numbers.ess_tail)}});
  }
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

html::ReportTable nodes(const inference::PosteriorProblem& problem, const PosteriorSummary& summary) {
  html::ReportTable table{{"node", "parent", "time from it", "observed", "sd of a coordinate", "least ESS"}, {}, ""};
  for (std::size_t b = 0; b < summary.ends.size(); ++b) {
    const inference::Branch& branch = problem.tree[b];
    double variance = 0, ess = INFINITY;
    for (const inference::DrawSummary& at : summary.ends[b]) {
      variance += at.sd * at.sd / static_cast<double>(summary.ends[b].size());
      ess = min_or_undefined(ess, min_or_undefined(at.ess_bulk, at.ess_tail));
    }
    table.rows.push_back({{node_name(problem, b)},
                          {branch.parent < 0 ? "root" : node_name(problem, static_cast<std::size_t>(branch.parent))},
                          {report_number(branch.grid.time)},
                          {branch.data ? "yes" : "no"},
                          {report_number(std::sqrt(variance))},
                          {ess_text(ess)}});
  }
  table.caption = "Posterior deviations are root mean squares over the coordinates; nodes.csv has all of them.";
  return table;
}

FactTable model_facts(const inference::PosteriorProblem& problem) {
  FactTable table("setting");
  table.add("noise", problem.specimens.front().system.noise->spec());
  table.add("kernel", problem.specimens.front().system.kernel.spec(6));
  table.add("sigma", problem.specimens.front().sigma);
  table.add("lambda", problem.specimens.front().lambda);
  table.add("steps", fmt::format("{} of {}", problem.specimens.front().grid.steps,
                                 problem.specimens.front().integrator->name()));
  return table;
}

html::ReportTable facts(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws,
                        const PosteriorSummary& summary) {
  FactTable table = model_facts(problem);
  table.add("chains", fmt::format("{} of {} draws", draws.chains, draws.draws));
  table.add("acceptance of paths", draws.acceptance);
  if (!draws.names.empty()) table.add("acceptance of parameters", draws.parameter_acceptance);
  table.add("modes found", fmt::to_string(draws.modes));
  table.add("log evidence", evidence_text(draws));
  table.add("the same by Laplace's approximation", fmt::format("{:.3f}", draws.laplace_log_evidence));
  table.add("confirmed", confirmation_text(draws));
  if (!std::isnan(draws.of_finer_steps.value)) table.add("error of the steps", steps_text(draws));
  table.add("least ESS of a position", ess_text(summary.ess_min));
  table.add("seconds", fmt::format("{:.1f}", draws.seconds));
  return std::move(table).table();
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

std::string evidence_text(const inference::PosteriorDraws& draws) {
  const Estimate& evidence = draws.log_evidence;
  if (!std::isfinite(evidence.standard_error)) return "undetermined";
  return fmt::format("{:.3f} ± {:.2g}", evidence.value, evidence.standard_error);
}

std::string pareto_text(const inference::PosteriorDraws& draws) {
  const double k = max_or_undefined(draws.pareto_k, draws.chain_pareto_k);
  return std::isnan(k) ? "undefined" : fmt::format("{:.2f}", k);
}

std::string confirmed_by_words(const inference::Confirmation& confirmation) {
  return confirmation.by == inference::Confirmation::By::kImportance ? "weighted draws" : "tempered chains";
}

std::string confirmation_text(const inference::PosteriorDraws& draws) {
  const inference::Confirmation& confirmation = draws.confirmation;
  if (confirmation.by == inference::Confirmation::By::kNothing)
    return draws.powers.empty() ? fmt::format("by nothing else; Pareto k of the weights {}", pareto_text(draws))
                                : "by nothing else";
  return fmt::format("{}by {}: log p(y) = {:.3f} ± {:.2g}, {} {:.1f} standard errors apart",
                     confirmation.agrees ? "" : "not ", confirmed_by_words(confirmation),
                     confirmation.log_evidence.value, confirmation.log_evidence.standard_error,
                     confirmation.furthest_of, confirmation.furthest);
}

std::string steps_text(const inference::PosteriorDraws& draws) {
  return fmt::format("with twice as many log p(y) changes by {:+.3f} ± {:.2g}", draws.of_finer_steps.value,
                     draws.of_finer_steps.standard_error);
}

std::string model_words(const inference::PosteriorProblem& problem) {
  const matching::MatchingProblem& first = problem.specimens.front();
  const std::string noise = first.system.noise->spec();
  return fmt::format("{}, {}, lambda {:.4g}, sigma {:.4g}, {} in {} steps",
                     noise == "none" ? "no noise" : shortened_spec(noise), first.system.kernel.spec(4), first.lambda,
                     first.sigma, first.integrator->name(), first.grid.steps);
}

html::HtmlReport sample_report(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws,
                               const PosteriorSummary& summary, const std::vector<std::string>& warnings,
                               const std::vector<std::string>& notes, const std::filesystem::path& paths,
                               const std::filesystem::path& chains) {
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
  report.sections.push_back({"Parameters", {parameter_table(problem, summary)}});
  add_still(report, "Chains", chains);
  report.sections.push_back({"Numbers", {facts(problem, draws, summary)}});
  report.sections.push_back(problem.tree.empty() ? html::ReportSection{"Landmarks", {landmarks(problem, summary)}}
                                                 : html::ReportSection{"Nodes", {nodes(problem, summary)}});
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
