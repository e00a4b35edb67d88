#include "report.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "pulson/core/name_table.hpp"
#include "records/registration_facts.hpp"
#include "registration_warnings.hpp"
#include "shell/facts.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/probability_text.hpp"
#include "shell/program.hpp"
#include "shell/report_parts.hpp"
#include "surface.hpp"
#include "verdict_texts.hpp"

namespace pulson {
namespace {

std::string percent(double part) { return fmt::format("{:.0f} %", 100 * part); }

std::string sentence(std::string text) {
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text + ".";
}

std::string lead(const matching::Registration& registration, const records::RegistrationFacts& facts,
                 std::size_t doubted) {
  std::string text = fmt::format(
      "{}: {} landmarks in {}D. Root mean square distance to the target: {} before, {} after.",
      registration.matched() ? "Matched" : "Not matched", registration.source.count(), registration.source.dimension(),
      report_number(registration.initial_rms(), 3), report_number(registration.rms(), 3));
  if (const auto part = noise_fraction(registration, facts.shares); registration.noise != "none" && part)
    text += fmt::format(" The flow accounts for {} of the displacement, the noise for {}.", percent(1 - *part),
                        percent(*part));
  if (const auto pairs = facts.counts.order_inversions)
    text += *pairs > 0 ? fmt::format(" {} of landmarks changed order.", counted(*pairs, "pair"))
                       : " The landmarks kept their order.";
  if (const auto triangles = facts.counts.flipped_triangles;
      triangles && *triangles > 0 && flips_matter(registration, facts))
    text += fmt::format(" {} between landmarks {} flipped.", counted(*triangles, "triangle"),
                        *triangles == 1 ? "is" : "are");
  if (const std::string target = topology_of_target(registration, facts); !target.empty())
    text += " " + sentence(target);
  if (const std::string where = place_of_noise(registration, facts); !where.empty()) text += " " + sentence(where);
  if (doubted > 0)
    text +=
        " Prediction doubts " + count_in_words(static_cast<int>(doubted), "landmark", "landmarks") + ", marked below.";
  if (!registration.converged) text += " The search did not converge.";
  return text;
}

html::ReportTable numbers_table(const matching::Registration& registration, const records::RegistrationFacts& facts) {
  html::ReportTable table =
      report_facts(chosen(records::registration_facts(),
                          {"matched", "original_rms", "initial_rms", "rms", "max_residual", "cost.total", "cost.energy",
                           "cost.action", "cost.data", "converged", "stop_reason", "iterations", "seconds"}),
                   registration, "quantity");
  if (registration.alignment.kind == AlignmentKind::kNone) table.rows.erase(table.rows.begin() + 1);
  const auto add = [&](const std::string& name, const std::string& value) { table.rows.push_back({{name}, {value}}); };
  if (const auto& prediction = facts.verdicts.prediction) {
    add("leave-one-out error", report_number(prediction->predictions.error()));
    add("leave-one-out error of the alignment", report_number(prediction->aligned.error()));
  } else if (registration.data.kind == matching::DataKind::kLandmarks) {
    add("leave-one-out error", "undetermined");
  }
  if (registration.uncertainty) add("log evidence", report_number(registration.uncertainty->log_evidence));
  if (facts.counts.order_inversions) add("pairs that changed order", fmt::to_string(*facts.counts.order_inversions));
  if (facts.counts.flipped_triangles) add("triangles flipped", fmt::to_string(*facts.counts.flipped_triangles));
  if (const auto& fitted = facts.fitted)
    for (std::size_t i = 0; i < fitted->names.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      add(fitted->names[i] + ", fitted", positive_number_text(fitted->values[row], fitted->log_deviations[row]));
    }
  return table;
}

html::ReportTable model_table(const matching::Registration& registration) {
  Facts<matching::Registration> facts =
      chosen(records::registration_facts(),
             {"kernel", "noise", "mode", "sigma", "lambda", "integrator", "time", "steps", "solver"});
  if (registration.mode == matching::MatchingMode::kPathwise || registration.samples > 1)
    std::ranges::copy(chosen(records::registration_facts(), {"samples", "seed"}), std::back_inserter(facts));
  html::ReportTable table = report_facts(facts, registration, "setting");
  const auto add = [&](const std::string& name, const std::string& value) { table.rows.push_back({{name}, {value}}); };
  add("source", registration.original.source);
  add("target", registration.target.source);
  if (registration.alignment.kind != AlignmentKind::kNone)
    add("aligned", fmt::format("{}, scale {}", alignment_name(registration.alignment.kind),
                               report_number(registration.alignment.scale)));
  if (registration.data.kind != matching::DataKind::kLandmarks)
    add("data", fmt::format("{} of width {}", data_kind_name(registration.data.kind),
                            report_number(registration.data.width.value_or(std::nan("")))));
  return table;
}

// Of each landmark, the fraction of its displacement that the noise did; NaN without a displacement. Empty where
// nothing is known of it.
Eigen::VectorXd noise_shares(const matching::Registration& registration, const matching::LandmarkShares& shares) {
  if (registration.noise == "none" || shares.noise.size() == 0) return {};
  const Points displacement = registration.result - registration.source.points;
  return (shares.noise.cwiseProduct(displacement).colwise().sum().array() /
          displacement.colwise().squaredNorm().array())
      .transpose();
}

std::string residuals_caption(const matching::Registration& registration, const records::RegistrationFacts& facts,
                              std::size_t listed) {
  std::string text = registration.data.kind == matching::DataKind::kLandmarks
                         ? "Distance of each landmark to its target where the flow ends. "
                         : "Distance of each landmark to the nearest point of the target where the flow ends. ";
  if (const auto& prediction = facts.verdicts.prediction) {
    const std::size_t doubted = prediction->doubted.size();
    text += fmt::format(
        "Predicted: the target's distance from where the other landmarks predict it, in standard deviations of the "
        "prediction. ▲ marks those above {:.3g}, which the largest of so many exceeds once in a thousand if the model "
        "holds; {} "
        "here. ",
        prediction->limit, doubted == 0 ? "none" : fmt::to_string(doubted));
    if (!facts.finding.empty()) text += "No landmark is cleared by this: see the warning. ";
  }
  if (listed < static_cast<std::size_t>(registration.source.count()))
    text += fmt::format("Of {} landmarks, the {} with the largest distances are listed; residuals.csv has all. ",
                        registration.source.count(), listed);
  return text + "Click a column heading to sort.";
}

// A column for what is known of each landmark.
struct LandmarkColumn {
  std::string name;
  Eigen::VectorXd values;
  std::string (*text)(double);
};

std::vector<LandmarkColumn> landmark_columns(const matching::Registration& registration,
                                             const records::RegistrationFacts& facts) {
  const auto three_digits = [](double value) { return report_number(value, 3); };
  std::vector<LandmarkColumn> columns;
  const auto add = [&](const char* name, const Eigen::VectorXd& values, std::string (*text)(double)) {
    if (values.size() > 0) columns.push_back({name, values, text});
  };
  add("distance", registration.distances(), [](double value) { return report_number(value); });
  add("in sigma", facts.verdicts.residual, three_digits);
  add("predicted", facts.verdicts.predicted, three_digits);
  add("energy", facts.shares.energy, three_digits);
  add("action", facts.shares.action, three_digits);
  add("weight", facts.verdicts.weight, three_digits);
  add("displacement by the noise", noise_shares(registration, facts.shares), percent);
  return columns;
}

html::ReportTable residual_table(const matching::Registration& registration, const records::RegistrationFacts& facts) {
  const std::vector<int>& doubted = facts.verdicts.doubted();
  const std::vector<LandmarkColumn> columns = landmark_columns(registration, facts);
  html::ReportTable table = landmark_table(registration.source);
  for (const LandmarkColumn& column : columns) table.header.push_back(column.name);
  for (const int a : listed_landmarks(columns.front().values)) {
    std::vector<html::ReportCell> row = landmark_cells(registration.source, a);
    for (const LandmarkColumn& column : columns)
      row.push_back({.text = std::isfinite(column.values[a]) ? column.text(column.values[a]) : "",
                     .outlier = column.name == "predicted" && std::binary_search(doubted.begin(), doubted.end(), a)});
    table.rows.push_back(std::move(row));
  }
  table.caption = residuals_caption(registration, facts, table.rows.size());
  return table;
}

}  // namespace

html::HtmlReport registration_report(const matching::Registration& registration, const Trajectory& path,
                                     const records::RegistrationFacts& facts, const std::vector<std::string>& notes,
                                     const std::filesystem::path& picture, const BelowLandmarks& below) {
  const std::vector<int>& doubted = facts.verdicts.doubted();
  html::HtmlReport report = new_report(short_name(registration.original) + " → " + short_name(registration.target),
                                       lead(registration, facts, doubted.size()), result_warnings(registration), notes);
  if (std::optional<html::ReportMotion> motion = registration_motion(registration, path, doubted, below.image)) {
    add_surface(below.still, registration, path, *motion);
    report.sections.push_back({"Motion", {std::move(*motion)}});
  }
  add_still(report, "The registration", picture, below.image.has_value() || !below.still.triangles.empty());
  report.sections.push_back({"Numbers", {numbers_table(registration, facts), model_table(registration)}});
  report.sections.push_back({"Landmarks", {residual_table(registration, facts)}});
  return report;
}

}  // namespace pulson
