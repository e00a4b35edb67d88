#include "report.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "pulson/core/name_table.hpp"
#include "registration_warnings.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/program.hpp"
#include "shell/report_parts.hpp"
#include "surface.hpp"

namespace pulson {
namespace {

constexpr double kDeviations = 5;        // above the median, from which on a landmark stands out
constexpr double kNormalScale = 1.4826;  // standard deviation over median absolute deviation of normal numbers
constexpr double kLeastSigmas = 2;       // what σ allows is no outlier

std::string percent(double part) { return fmt::format("{:.0f} %", 100 * part); }

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

std::string lead(const matching::Registration& registration, const records::RegistrationFacts& facts,
                 std::size_t outliers) {
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
  if (const auto triangles = facts.counts.flipped_triangles; triangles && *triangles > 0)
    text += fmt::format(" {} between landmarks {} flipped.", counted(*triangles, "triangle"),
                        *triangles == 1 ? "is" : "are");
  if (outliers > 0)
    text += " Outliers: " + count_in_words(static_cast<int>(outliers), "landmark", "landmarks") + ", marked below.";
  if (!registration.converged) text += " The search did not converge.";
  return text;
}

html::ReportTable numbers_table(const matching::Registration& registration, const records::RegistrationFacts& facts) {
  FactTable table("quantity");
  const auto add = [&](const std::string& name, const std::string& value) { table.add(name, value); };
  add("matched", registration.matched() ? "yes" : "no");
  if (registration.alignment.kind != AlignmentKind::kNone)
    add("rms distance before the alignment", report_number(registration.original_rms()));
  add("rms distance before", report_number(registration.initial_rms()));
  add("rms distance after", report_number(registration.rms()));
  add("largest distance", report_number(registration.max_residual()));
  add("cost", report_number(registration.cost.total()));
  add("energy", report_number(registration.cost.energy));
  add("action", report_number(registration.cost.action));
  add("data", report_number(registration.cost.data));
  if (registration.uncertainty) add("log evidence", report_number(registration.uncertainty->log_evidence));
  if (facts.counts.order_inversions) add("pairs that changed order", fmt::to_string(*facts.counts.order_inversions));
  if (facts.counts.flipped_triangles) add("triangles flipped", fmt::to_string(*facts.counts.flipped_triangles));
  if (facts.fitted)
    for (std::size_t i = 0; i < facts.fitted->names.size(); ++i)
      add(facts.fitted->names[i] + ", fitted", report_number(facts.fitted->values[static_cast<Eigen::Index>(i)]));
  add("converged", registration.converged ? "yes" : "no: " + registration.stop_reason);
  add("iterations", fmt::to_string(registration.iterations));
  add("seconds", fmt::format("{:.2f}", registration.seconds));
  return std::move(table).table();
}

html::ReportTable model_table(const matching::Registration& registration) {
  FactTable table("setting");
  const auto add = [&](const std::string& name, const std::string& value) { table.add(name, value); };
  add("source", registration.original.source);
  add("target", registration.target.source);
  if (registration.alignment.kind != AlignmentKind::kNone)
    add("aligned", fmt::format("{}, scale {}", alignment_name(registration.alignment.kind),
                               report_number(registration.alignment.scale)));
  add("kernel", registration_system(registration).kernel.spec(4));
  if (registration.fitted_kernel)
    add("leave-one-out error", report_number(registration.fitted_kernel->prediction_error));
  add("noise", registration.noise);
  add("mode", mode_name(registration.mode));
  if (registration.data.kind != matching::DataKind::kLandmarks)
    add("data", fmt::format("{} of width {}", data_kind_name(registration.data.kind),
                            report_number(registration.data.width.value_or(std::nan("")))));
  add("sigma", report_number(registration.sigma));
  add("lambda", report_number(registration.lambda));
  add("integrator", registration.integrator);
  add("time", report_number(registration.grid.time));
  add("steps", fmt::to_string(registration.grid.steps));
  add("search", solver_name(registration.solver));
  if (registration.samples > 1) add("realisations", fmt::to_string(registration.samples));
  if (registration.mode == matching::MatchingMode::kPathwise || registration.samples > 1)
    add("seed", fmt::to_string(registration.seed));
  return std::move(table).table();
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

std::string residuals_caption(const matching::Registration& registration, std::size_t listed, std::size_t outliers) {
  std::string text = registration.data.kind == matching::DataKind::kLandmarks
                         ? "Distance of each landmark to its target where the flow ends. "
                         : "Distance of each landmark to the nearest point of the target where the flow ends. ";
  text += fmt::format(
      "▲ marks outliers, {} here: a distance above the median by more than {} × {} median absolute deviations, and "
      "above {} sigma.",
      outliers == 0 ? "none" : fmt::to_string(outliers), kDeviations, kNormalScale, kLeastSigmas);
  if (listed < static_cast<std::size_t>(registration.source.count()))
    text += fmt::format(" Of {} landmarks, the {} with the largest distances are listed; residuals.csv has all.",
                        registration.source.count(), listed);
  return text + " Click a column heading to sort.";
}

html::ReportTable residual_table(const matching::Registration& registration, const matching::LandmarkShares& shares,
                                 const std::vector<int>& outliers) {
  const Landmarks& source = registration.source;
  const Eigen::VectorXd distances = registration.distances(), noise = noise_shares(registration, shares);
  html::ReportTable table = landmark_table(source);
  table.header.insert(table.header.end(), {"distance", "in sigma"});
  if (noise.size() > 0) table.header.emplace_back("displacement by the noise");
  for (const int a : listed_landmarks(distances)) {
    const bool outlier = std::binary_search(outliers.begin(), outliers.end(), a);
    const double distance = distances[a];
    std::vector<html::ReportCell> row = landmark_cells(source, a);
    row.push_back({.text = std::isfinite(distance) ? report_number(distance) : "", .outlier = outlier});
    row.push_back({std::isfinite(distance) ? report_number(distance / registration.sigma, 3) : ""});
    if (noise.size() > 0) row.push_back({std::isfinite(noise[a]) ? percent(noise[a]) : ""});
    table.rows.push_back(std::move(row));
  }
  table.caption = residuals_caption(registration, table.rows.size(), outliers.size());
  return table;
}

}  // namespace

std::vector<int> outlying_landmarks(const Eigen::VectorXd& distances, double sigma) {
  std::vector<double> known;
  std::copy_if(distances.begin(), distances.end(), std::back_inserter(known),
               [](double d) { return std::isfinite(d); });
  if (known.empty()) return {};
  const double middle = median(known);
  std::vector<double> deviations = known;
  for (double& deviation : deviations) deviation = std::abs(deviation - middle);
  const double least = std::max(middle + kDeviations * kNormalScale * median(deviations), kLeastSigmas * sigma);
  std::vector<int> outliers;
  for (int a = 0; a < distances.size(); ++a)
    if (distances[a] > least) outliers.push_back(a);
  return outliers;
}

html::HtmlReport registration_report(const matching::Registration& registration, const Trajectory& path,
                                     const records::RegistrationFacts& facts, const std::vector<std::string>& notes,
                                     const std::filesystem::path& picture, const BelowLandmarks& below) {
  const std::vector<int> outliers = outlying_landmarks(registration.distances(), registration.sigma);
  html::HtmlReport report =
      new_report(short_name(registration.original) + " → " + short_name(registration.target),
                 lead(registration, facts, outliers.size()), result_warnings(registration), notes);
  if (std::optional<html::ReportMotion> motion = registration_motion(registration, path, outliers, below.image)) {
    add_surface(below.still, registration, path, *motion);
    report.sections.push_back({"Motion", {std::move(*motion)}});
  }
  add_still(report, "The registration", picture, below.image.has_value() || !below.still.triangles.empty());
  report.sections.push_back({"Numbers", {numbers_table(registration, facts), model_table(registration)}});
  report.sections.push_back({"Landmarks", {residual_table(registration, facts.shares, outliers)}});
  return report;
}

}  // namespace pulson
