#include "homotopy.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "charts/chart.hpp"
#include "core/csv_table.hpp"
#include "verdict_texts.hpp"

namespace pulson {
namespace {

template <class Value>
charts::Series over_beta(const std::string& name, const std::vector<matching::HomotopyStep>& steps,
                         const Value& value) {
  charts::Series series{.name = name, .x = {}, .y = {}, .style = charts::SeriesStyle::kLineAndPoints};
  for (const matching::HomotopyStep& step : steps) {
    series.x.push_back(step.beta);
    series.y.push_back(value(step));
  }
  return series;
}

// Those whose residual does not vanish with the noise.
std::string landmarks_left(const matching::HomotopyStep& last, const Landmarks& shape) {
  if (last.unmatched.empty()) return {};
  return fmt::format("; without noise no path takes {} {} there", last.unmatched.size() == 1 ? "landmark" : "landmarks",
                     landmark_list(shape, last.unmatched));
}

// Flows may come within σ of what none does exactly.
std::string impossible_left(const matching::Registration& registration) {
  if (registration.data.kind != matching::DataKind::kLandmarks) return {};
  const std::vector<int> landmarks =
      matching::impossible_landmarks(registration.source.points, registration.target.points);
  if (landmarks.empty()) return {};
  const std::string names = landmark_list(registration.source, landmarks);
  return registration.source.dimension() == 1
             ? " within sigma, but for the order of landmarks " + names
             : fmt::format(" within sigma, but no flow parts or joins landmarks {}, at one place in one shape only",
                           names);
}

}  // namespace

std::string homotopy_csv(const std::vector<matching::HomotopyStep>& steps) {
  text::CsvTable table{"beta", "J", "energy", "action", "data", "rms", "matched", "converged", "iterations"};
  for (const matching::HomotopyStep& step : steps) {
    table.numbers(step.beta, step.cost.total(), step.cost.energy, step.cost.action, step.cost.data, step.rms);
    table.words({step.matched ? "true" : "false", step.converged ? "true" : "false"});
    table.number(step.iterations).end_row();
  }
  return std::move(table).take();
}

std::string homotopy_line(const std::vector<matching::HomotopyStep>& steps,
                          const matching::Registration& registration) {
  const matching::HomotopyStep& asked = steps.front();
  const auto least = least_needed(steps);
  const std::string left = landmarks_left(steps.back(), registration.source);
  if (least == steps.end()) return fmt::format("beta = {:.4g} does not match these shapes{}", asked.beta, left);
  const std::string costs = fmt::format("J = {:.4g} at beta = {:.4g}, {:.4g} at beta = {:.4g}", asked.cost.total(),
                                        asked.beta, least->cost.total(), least->beta);
  if (reaches_diffeomorphism(steps))
    return costs + ": a diffeomorphism matches these shapes" + impossible_left(registration);
  if (least + 1 != steps.end()) return costs + ", the smallest that matches" + left;
  return fmt::format("{}, and grows by {:.3g} % if beta is halved: not diffeomorphic", costs, 100 * least->growth());
}

void write_homotopy_picture(const std::vector<matching::HomotopyStep>& steps,
                            const matching::Registration& registration, const draw::PictureFiles& files) {
  charts::ChartPanel costs{.heading = "Cost J and its parts over β", .log_x = true, .log_y = true};
  costs.series = {
      over_beta("J", steps, [](const matching::HomotopyStep& s) { return s.cost.total(); }),
      over_beta("energy of the flow", steps, [](const matching::HomotopyStep& s) { return s.cost.energy; }),
      over_beta("action of the noise", steps, [](const matching::HomotopyStep& s) { return s.cost.action; })};
  charts::ChartPanel distances{.heading = "Root mean square distance to the target over β",
                               .x_label = "β of the noise",
                               .log_x = true,
                               .log_y = true};
  distances.series = {over_beta("distance", steps, [](const matching::HomotopyStep& s) { return s.rms; })};
  distances.reference_lines = {{3 * registration.sigma, "3σ"}};
  for (charts::ChartPanel* panel : {&costs, &distances})
    for (charts::Series& series : panel->series)
      for (double& y : series.y) y = std::max(y, 1e-300);
  charts::write_chart({.title = "How far from a diffeomorphism",
                       .subtitle = homotopy_line(steps, registration),
                       .rows = {{costs}, {distances}}},
                      files);
}

}  // namespace pulson
