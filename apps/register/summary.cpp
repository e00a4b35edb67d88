#include "summary.hpp"

#include <cmath>

#include <fmt/core.h>

#include "records/registration_facts.hpp"
#include "registration_warnings.hpp"
#include "shell/messages.hpp"
#include "shell/probability_text.hpp"
#include "verdict_texts.hpp"

namespace pulson {
namespace {

std::string as_read(const matching::Registration& registration, std::string_view key) {
  return text_of(records::registration_facts(), key, registration);
}

void print_alignment(const matching::Registration& registration) {
  if (registration.alignment.kind == AlignmentKind::kNone) return;
  const double scale = registration.alignment.scale, before = registration.original_rms();
  const double removed = before > 0 ? 1 - registration.initial_rms() / before : 0;
  print_text("aligned    by {}{}{}\n", alignment_name(registration.alignment.kind),
             scale == 1 ? "" : fmt::format(", scale {:.4g}", scale),
             removed >= 0 ? fmt::format(", which removes {:.0f} % of the distance", 100 * removed) : "");
}

void print_kernel(const matching::Registration& registration, const std::string& asked) {
  print_text("kernel     {}", registration_system(registration).kernel.spec(4));
  if (registration.fitted_kernel)
    print_text(", by maximum likelihood");
  else if (asked == "auto")
    print_text("{}", registration.data.kind == matching::DataKind::kLandmarks
                         ? ", as wide as the shape: too few landmarks to fit a width"
                         : ", a quarter of the diameter");
  print_text("\n");
}

void print_model(const matching::Registration& registration) {
  print_text("model      noise {}, mode {}, {} steps, sigma {}, lambda {}\n", as_read(registration, "noise"),
             as_read(registration, "mode"), as_read(registration, "steps"), as_read(registration, "sigma"),
             as_read(registration, "lambda"));
  if (registration.data.kind != matching::DataKind::kLandmarks)
    print_text("data       {} of width {:.4g}, {} of the target\n", data_kind_name(registration.data.kind),
               *registration.data.width, counted(registration.target.count(), "point"));
  if (registration.noise_displacement)
    print_text("noise      {}, seed {}: moves a landmark at rest by {:.3g}, {:.3g} sigma\n",
               counted(registration.samples, "realisation"), registration.seed, *registration.noise_displacement,
               *registration.noise_displacement / registration.sigma);
}

void print_suspects(const matching::Registration& registration) {
  if (!registration.robust) return;
  const std::string suspects = suspects_text(registration);
  print_text("suspects   {}\n", suspects.empty() ? "none, by loss " + registration.robust->loss : suspects);
}

void print_search(const matching::Registration& registration) {
  print_text("{} {} of solver {} in {} s: {} (relative gradient {})\n",
             registration.converged ? "converged " : "STOPPED   ", counted(registration.iterations, "iteration"),
             as_read(registration, "solver"), as_read(registration, "seconds"), registration.stop_reason,
             as_read(registration, "relative_gradient"));
}

// Nothing where all searches agree.
void print_minima(const matching::Registration& registration) {
  const auto& minima = registration.minima;
  if (minima.size() < 2) return;
  print_text("minima     {} were found: J = {:.4g} by {} {}, the next best, J = {:.4g}, by {}\n", minima.size(),
             minima[0].total, minima[0].found, minima[0].found == 1 ? "search" : "searches", minima[1].total,
             minima[1].found);
}

void print_fitted(const inference::FittedParameters& fitted) {
  print_text("fitted    ");
  for (std::size_t i = 0; i < fitted.names.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    print_text("{} {} = {}", i == 0 ? "" : ",", fitted.names[i],
               positive_number_text(fitted.values[row], fitted.log_deviations[row]));
  }
  print_text("; log evidence {:.4g} after {} matches{}\n", fitted.log_evidence, fitted.evaluations,
             fitted.converged ? "" : "; NOT CONVERGED");
  if (!fitted.note.empty()) print_text("           {}\n", fitted.note);
}

void print_uncertainty(const matching::LaplaceApproximation& uncertainty) {
  print_text("deviations of the end points up to {:.3g}, of the momenta up to {:.3g}; log evidence {:.4g}\n",
             uncertainty.end_deviation.maxCoeff(), uncertainty.momentum_deviation.maxCoeff(), uncertainty.log_evidence);
}

void print_distances(const matching::Registration& registration) {
  int worst = 0;
  const Eigen::VectorXd distances = registration.distances();
  distances.array().isNaN().select(-1, distances).maxCoeff(&worst);
  print_text("rms        {} before, {} after, largest {} at landmark {}: {}\n", as_read(registration, "initial_rms"),
             as_read(registration, "rms"), as_read(registration, "max_residual"), registration.source.describe(worst),
             registration.matched() ? "matched" : "NOT MATCHED");
}

void print_costs(const matching::Registration& registration, const records::RegistrationFacts& facts) {
  print_text("cost       {} = energy {} + action {} + data {}\n", as_read(registration, "cost.total"),
             as_read(registration, "cost.energy"), as_read(registration, "cost.action"),
             as_read(registration, "cost.data"));
  if (const auto& limit = registration.extrapolated)
    print_text("limit      J = {:.4g} as steps tend to 0, from {} and {} steps\n", limit->cost.total(),
               limit->coarse_steps, registration.grid.steps);
  if (const std::string text = accuracy_text(registration); !text.empty()) print_text("accuracy   {}\n", text);
  const auto part = noise_fraction(registration, facts.shares);
  if (registration.noise != "none" && part) {
    const double by_noise = std::round(100 * *part) + 0.0;  // which makes −0 a 0
    print_text("moved      {:.0f} % by the flow, {:.0f} % by the noise\n", 100 - by_noise, by_noise);
  }
  if (facts.counts.order_inversions)
    print_text("topology   {} changed order\n", counted(*facts.counts.order_inversions, "pair", "of landmarks"));
  if (facts.counts.flipped_triangles && flips_matter(registration, facts))
    print_text("topology   {} flipped\n", counted(*facts.counts.flipped_triangles, "Delaunay triangle"));
  if (const std::string text = topology_of_target(registration, facts); !text.empty())
    print_text("target     {}\n", text);
  if (const std::string text = place_of_noise(registration, facts); !text.empty()) print_text("noise      {}\n", text);
}

}  // namespace

std::string suspects_text(const matching::Registration& registration) {
  std::vector<std::string> suspects;
  for (int a = 0; registration.robust && a < registration.source.count(); ++a)
    if (const double weight = registration.robust->weights[a]; weight < matching::kSuspectWeight)
      suspects.push_back(
          fmt::format("{} ({}{:.2f})", registration.source.describe(a), suspects.empty() ? "weight " : "", weight));
  if (suspects.empty()) return {};
  return (suspects.size() == 1 ? "landmark " : "landmarks ") + joined_words(suspects);
}

void print_registration(const matching::Registration& registration, const records::RegistrationFacts& facts,
                        const std::string& asked_kernel) {
  print_text("{} → {}: {} in {}D\n", registration.original.source, registration.target.source,
             counted(registration.source.count(), "landmark"), registration.source.dimension());
  print_alignment(registration);
  print_kernel(registration, asked_kernel);
  print_distances(registration);
  if (const std::string text = prediction_text(registration, facts); !text.empty()) print_text("predicted  {}\n", text);
  print_suspects(registration);
  print_model(registration);
  if (facts.fitted) print_fitted(*facts.fitted);
  print_search(registration);
  print_minima(registration);
  print_costs(registration, facts);
  if (registration.uncertainty) print_uncertainty(*registration.uncertainty);
}

}  // namespace pulson
