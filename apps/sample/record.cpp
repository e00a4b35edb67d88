#include "record.hpp"

#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/csv_table.hpp"
#include "core/text.hpp"
#include "core/undefined.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/core/version.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "records/record_text.hpp"
#include "sample/facts.hpp"
#include "shell/options.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Json = nlohmann::ordered_json;

// The error of a mean knows, as that of the evidence, how far what confirms the chains is from it: chains that came to
// a part of the posterior hardly, or not, do not show it. @param differences [path] of the confirmation, or none
std::vector<inference::DrawSummary> summaries(const inference::PosteriorDraws& draws, const Eigen::MatrixXd& rows,
                                              const std::vector<Eigen::VectorXd>& differences, std::size_t path) {
  std::vector<inference::DrawSummary> all(static_cast<std::size_t>(rows.rows()));
  parallel_for(static_cast<int>(rows.rows()), [&](int i) {
    inference::DrawSummary& numbers = all[static_cast<std::size_t>(i)];
    numbers = inference::summarise(draws.by_chain(rows.row(i)));
    if (path < differences.size()) numbers.mcse = std::hypot(numbers.mcse, differences[path][i]);
  });
  return all;
}

Json coordinates(const PosteriorResults& results, const std::vector<std::vector<inference::DrawSummary>>& specimens) {
  Json rows = Json::array();
  const auto d = static_cast<std::size_t>(results.problem.sources.front().dimension());
  for (std::size_t s = 0; s < specimens.size(); ++s)
    for (std::size_t i = 0; i < specimens[s].size(); ++i) {
      Json row{{"specimen", s + 1}};
      if (!results.problem.tree.empty()) row = {{"node", node_name(results.problem, s)}};
      row.update({{"landmark", i / d + 1}, {"axis", i % d + 1}});
      add_facts(row, draw_facts(), specimens[s][i]);
      rows.push_back(std::move(row));
    }
  return rows;
}

Json priors(const inference::PosteriorProblem& problem) {
  Json all = Json::object();
  for (const inference::ParameterPrior& prior : problem.parameters)
    all[prior.name] = {{"median", prior.median}, {"log_deviation", prior.log_deviation}};
  return all;
}

Json tree_rows(const PosteriorResults& results) {
  Json rows = Json::array();
  for (const NodeRow& node : node_rows(results)) {
    Json row;
    add_facts(row, node_facts(), node);
    if (results.problem.tree[node.branch].parent < 0) row["parent"] = nullptr;
    rows.push_back(std::move(row));
  }
  return rows;
}

// The model and the shapes, to `json`.
void add_model(const inference::PosteriorProblem& problem, const inference::SamplerOptions& options, Json& json) {
  add_facts(json, posterior_model_facts(), problem);
  for (const Landmarks& target : problem.targets) {
    json["targets"].push_back(target.source);
    json["specimens"].push_back(target.name);
  }
  json["priors"] = priors(problem);
  json.update({{"method", options.method}, {"warmup", options.warmup}, {"seed", options.seed}});
}

}  // namespace

std::string node_name(const inference::PosteriorProblem& problem, std::size_t branch) {
  const std::string& name = problem.tree[branch].name;
  return name.empty() ? fmt::format("node {}", branch + 2) : name;
}

PosteriorSummary summarise_posterior(const inference::PosteriorDraws& draws) {
  PosteriorSummary summary;
  const inference::Confirmation& confirmation = draws.confirmation;
  for (std::size_t j = 0; j < draws.names.size(); ++j) {
    const auto row = static_cast<Index>(j);
    inference::DrawSummary numbers = inference::summarise(draws.by_chain(draws.parameters.row(row)));
    if (confirmation.parameters.size() > row)
      numbers.mcse = std::hypot(numbers.mcse, numbers.mean * confirmation.parameters[row]);
    summary.parameters.push_back({draws.names[j], numbers});
  }
  summary.parameters.push_back(
      {"log_likelihood", inference::summarise(draws.by_chain(draws.log_likelihood.transpose()))});
  const auto consider = [&](const inference::DrawSummary& numbers, const std::string& name, double& rhat, double& ess) {
    const double least = min_or_undefined(numbers.ess_bulk, numbers.ess_tail);
    rhat = max_or_undefined(rhat, numbers.rhat);
    ess = min_or_undefined(ess, least);
    if (summary.undefined.empty() && (std::isnan(numbers.rhat) || std::isnan(least))) summary.undefined = name;
    if (!(numbers.rhat <= summary.worst_rhat) && !std::isnan(summary.worst_rhat)) {
      summary.worst_rhat = numbers.rhat;
      summary.worst = name;
    }
  };
  double unused_rhat = 0, unused_ess = INFINITY;
  for (const NamedSummary& parameter : summary.parameters)
    consider(parameter.numbers, parameter.name, unused_rhat, unused_ess);
  for (std::size_t s = 0; s < draws.momenta.size(); ++s) {
    summary.momenta.push_back(summaries(draws, draws.momenta[s], confirmation.momenta, s));
    for (const inference::DrawSummary& numbers : summary.momenta.back())
      consider(numbers, "momenta", summary.momenta_rhat_max, summary.momenta_ess_min);
  }
  for (std::size_t s = 0; s < draws.ends.size(); ++s) {
    summary.middles.push_back(summaries(draws, draws.middles[s], confirmation.middles, s));
    summary.ends.push_back(summaries(draws, draws.ends[s], confirmation.ends, s));
    for (const auto* of_path : {&summary.middles.back(), &summary.ends.back()})
      for (const inference::DrawSummary& numbers : *of_path)
        consider(numbers, "paths", summary.rhat_max, summary.ess_min);
  }
  const bool is_confirmed = confirmation.by != inference::Confirmation::By::kNothing;
  summary.refuted = is_confirmed && !confirmation.agrees;
  summary.heavy_tail = !is_confirmed && draws.powers.empty() &&
                       !(max_or_undefined(draws.pareto_k, draws.chain_pareto_k) <= inference::kHighParetoK);
  summary.converged = summary.undefined.empty() && summary.worst_rhat <= inference::kHighRhat && !summary.refuted &&
                      !summary.heavy_tail;
  return summary;
}

std::string confirmed_by_words(const inference::Confirmation& confirmation) {
  return confirmation.by == inference::Confirmation::By::kImportance ? "weighted draws" : "tempered chains";
}

std::string rhat_text(double rhat) { return std::isnan(rhat) ? "undefined" : fmt::format("{:.3f}", rhat); }

std::string ess_text(double ess) { return std::isfinite(ess) ? fmt::format("{:.0f}", ess) : "undefined"; }

std::string summary_json(const PosteriorResults& results) {
  const auto& [problem, options, draws, summary, notes, warnings] = results;
  Json json;
  add_facts(json, posterior_facts(), draws);
  add_facts(json, convergence_facts(), summary);
  json["confirmation"] = nullptr;
  if (draws.confirmation.by != inference::Confirmation::By::kNothing)
    add_facts(json["confirmation"], confirmation_facts(), draws.confirmation);
  json["parameters"] = Json::object();
  for (const NamedSummary& parameter : summary.parameters)
    add_facts(json["parameters"][parameter.name], draw_facts(), parameter.numbers);
  json["momenta"] = coordinates(results, summary.momenta);
  json["path"]["middle"] = coordinates(results, summary.middles);
  json["path"]["end"] = coordinates(results, summary.ends);
  if (!draws.powers.empty())
    json["tempering"] = {{"powers", draws.powers}, {"exchanged", draws.exchanged}, {"prior_lost", draws.lost_fraction}};
  add_model(problem, options, json);
  if (problem.weights.size() > 0) json["weights"] = std::vector<double>(problem.weights.begin(), problem.weights.end());
  if (!problem.tree.empty()) {
    json["tree"] = tree_rows(results);
    for (const auto& landmark : problem.sources.front().points.colwise())
      json["root"].push_back(std::vector<double>(landmark.begin(), landmark.end()));
  }
  json["notes"] = in_option_words(notes);
  json["version"] = version();
  return records::record_text(json);
}

std::string draws_csv(const inference::PosteriorDraws& draws) {
  text::CsvTable table;
  table.words({"chain", "draw"});
  for (const std::string& name : draws.names) table.word(name);
  table.word("log_likelihood").end_row();
  for (int c = 0; c < draws.chains; ++c)
    for (int i = 0; i < draws.draws; ++i) {
      const Index column = static_cast<Index>(i) * draws.chains + c;
      table.numbers(c + 1, i + 1).numbers(draws.parameters.col(column));
      table.number(draws.log_likelihood[column]).end_row();
    }
  return std::move(table).take();
}

namespace {

// [chain][draw][path][landmark][axis]
std::string numbers_of_all(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws,
                           const std::vector<Eigen::MatrixXd>& of_paths) {
  std::vector<double> numbers;
  for (int c = 0; c < draws.chains; ++c)
    for (int i = 0; i < draws.draws; ++i)
      for (const Eigen::MatrixXd& of_path : of_paths) {
        const auto column = of_path.col(static_cast<Index>(i) * draws.chains + c);
        numbers.insert(numbers.end(), column.begin(), column.end());
      }
  const Landmarks& source = problem.sources.front();
  return formats::npy_bytes(
      numbers, {static_cast<std::size_t>(draws.chains), static_cast<std::size_t>(draws.draws), of_paths.size(),
                static_cast<std::size_t>(source.count()), static_cast<std::size_t>(source.dimension())});
}

}  // namespace

std::string momenta_npy(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws) {
  return numbers_of_all(problem, draws, draws.momenta);
}

std::string paths_npy(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws) {
  std::vector<double> numbers;
  for (std::size_t m = 0; m < draws.kept.size(); ++m)
    for (const auto& of_specimen : draws.paths)
      for (const Points& q : of_specimen[m]) numbers.insert(numbers.end(), q.data(), q.data() + q.size());
  const Landmarks& source = problem.sources.front();
  return formats::npy_bytes(
      numbers,
      {draws.kept.size(), draws.paths.size(), static_cast<std::size_t>(problem.specimens.front().grid.steps) + 1,
       static_cast<std::size_t>(source.count()), static_cast<std::size_t>(source.dimension())});
}

std::string nodes_csv(const PosteriorResults& results) {
  const auto nodes = chosen(node_facts(), {"node", "parent", "observed"});
  const auto numbers = chosen(draw_facts(), {"mean", "sd", "q05", "q50", "q95", "rhat", "ess_bulk"});
  const auto d = static_cast<std::size_t>(results.problem.sources.front().dimension());
  text::CsvTable table;
  for (const auto& fact : nodes) table.word(fact.key);
  table.words({"landmark", "axis"});
  for (const auto& fact : numbers) table.word(fact.key);
  table.end_row();
  for (const NodeRow& row : node_rows(results)) {
    const std::vector<inference::DrawSummary>& ends = results.summary.ends[row.branch];
    for (std::size_t i = 0; i < ends.size(); ++i) {
      add_facts(table, nodes, row);
      table.number(i / d + 1).word(text::kAxisLetters.substr(i % d, 1));
      add_facts(table, numbers, ends[i]);
      table.end_row();
    }
  }
  return std::move(table).take();
}

std::string nodes_npy(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws) {
  return numbers_of_all(problem, draws, draws.ends);
}

std::string calibration_json(const inference::PosteriorProblem& problem, const inference::CalibrationOptions& options,
                             const inference::Calibration& calibration) {
  Json ranks = Json::object(), inside = Json::object(), p_values = Json::object();
  bool all = true;
  for (const inference::CalibratedQuantity& quantity : calibration.quantities) {
    ranks[quantity.name] = quantity.ranks;
    inside[quantity.name] = quantity.inside_band;
    p_values[quantity.name] = quantity.deviation;
    all = all && quantity.inside_band;
  }
  Json json{{"ranks", std::move(ranks)},
            {"bins", calibration.ranks + 1},
            {"inside_band", all},
            {"inside", std::move(inside)},
            {"p_values", std::move(p_values)},
            {"band",
             {{"level", 0.95},
              {"pointwise", 1 - calibration.pointwise},
              {"lower", calibration.lower},
              {"upper", calibration.upper}}},
            {"simulations", calibration.simulations},
            {"failed", calibration.failed},
            {"seconds", calibration.seconds},
            {"draws", options.sampler.draws}};
  if (!options.fault_name.empty()) json["fault"] = {{options.fault_name, options.fault_factor}};
  add_model(problem, options.sampler, json);
  json["version"] = version();
  return records::record_text(json);
}

}  // namespace pulson
