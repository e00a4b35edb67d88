// Figures 1 and 4: a few sample paths, and the claims about them.

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/csv_table.hpp"
#include "laboratory.hpp"

namespace pulson {
namespace {

constexpr int kPaths = 3;
constexpr double kSampleBeta = 4;
// Paths of the compensated integrator with screened noise, which lanes do not know: 20 ms each.
constexpr std::int64_t kCompensated = 4096, kQuickCompensated = 256;
constexpr double kTelling = 0.005;  // a standard error that would show a difference of two probabilities

charts::Series coordinate_over_time(const ensemble::SamplePath& sample, int landmark, bool momentum) {
  charts::Series series;
  series.name = landmark == 0 ? "faster pulson: q₁, p₁" : "slower pulson: q₂, p₂";
  for (std::size_t k = 0; k < sample.path.states.size(); ++k) {
    const PhaseState& state = sample.path.states[k];
    series.x.push_back(sample.path.grid.at(static_cast<int>(k)));
    series.y.push_back((momentum ? state.p : state.q)(landmark));
  }
  return series;
}

/// Positions above, momenta below, a column for each path.
charts::Chart chart_of_paths(const std::vector<ensemble::SamplePath>& samples, const std::string& title,
                             const std::string& subtitle) {
  charts::Chart chart{title, subtitle, {{}, {}}, false};
  for (std::size_t m = 0; m < samples.size(); ++m) {
    const std::string end = samples[m].status == ensemble::PathStatus::kClean
                                ? ""
                                : fmt::format(", ends at t = {:.3g}", samples[m].path.grid.time);
    for (const bool momentum : {false, true}) {
      charts::ChartPanel panel;
      panel.heading = fmt::format("{} over time t, path {}{}", momentum ? "Momenta p" : "Positions q", m + 1, end);
      for (int a = 0; a < 2; ++a) panel.series.push_back(coordinate_over_time(samples[m], a, momentum));
      if (momentum) show_early_times(panel, samples[m].path.grid);
      chart.rows[momentum ? 1 : 0].push_back(std::move(panel));
    }
  }
  return chart;
}

std::string csv_of_paths(const std::vector<ensemble::SamplePath>& samples) {
  text::CsvTable table{"path", "time", "q1", "q2", "p1", "p2"};
  for (std::size_t m = 0; m < samples.size(); ++m)
    for (std::size_t k = 0; k < samples[m].path.states.size(); ++k) {
      const PhaseState& s = samples[m].path.states[k];
      table.numbers(m + 1, samples[m].path.grid.at(static_cast<int>(k)), s.q(0), s.q(1), s.p(0), s.p(1)).end_row();
    }
  return std::move(table).take();
}

void add_paths(html::ReportSection& section, const Laboratory& laboratory, const PaperPair& pair,
               const std::string& name, const std::string& title) {
  const std::vector<ensemble::SamplePath> samples = laboratory.paths(pair, kPaths);
  laboratory.write_csv(name + ".csv", csv_of_paths(samples));
  const TimeGrid& grid = laboratory.options().grid;
  laboratory.add_chart(section, name,
                       chart_of_paths(samples, title,
                                      fmt::format("{}  ·  {}  ·  dt = {:.3g}  ·  seed {}, paths 1 to {}", pair.noise,
                                                  pair.kernel.spec, grid.dt(), laboratory.options().seed, kPaths)),
                       title);
}

/// The pair of a figure, with the values that were asked for.
PaperPair chosen_pair(const OwnValues& own, const std::string& noise_of_paper) {
  const bool is_complete = own.betas.empty() && !own.noise.empty();
  const std::string noise = own.noise_or(noise_of_paper);
  return {own.kernels_or({paper_kernels().front()}).front(),
          is_complete ? noise : noise_at(noise, own.betas_or({kSampleBeta}).front()), 4};
}

void add_own_sample(html::ReportSection& section, const Laboratory& laboratory, const PaperPair& pair,
                    const std::string& what) {
  add_own_results(section, laboratory.own(), {{pair, laboratory.sample(pair, what)}});
}

void add_crossing_claims(html::ReportSection& section, const Laboratory& laboratory, const PaperPair& pair) {
  html::ReportClaims claims;
  const ensemble::EnsembleSums sums = laboratory.sample(pair, "figure1");
  const Estimate crossing = sums.crossing_probability();
  claims.push_back({"The faster pulson may in fact cross the slower one.",
                    crossing.value > 4 * crossing.standard_error ? html::Verdict::kHolds : html::Verdict::kDoesNotHold,
                    fmt::format("crossed at t = {:.3g}: {} of {} paths", laboratory.options().grid.time,
                                text_of(crossing), sums.samples)});
  std::string others;
  bool all_cross = true;
  for (const PaperKernel& kernel : paper_kernels())
    for (const double p1 : {8.0, 2.0}) {
      const Estimate other = laboratory.sample({kernel, pair.noise, p1}, "figure1").crossing_probability();
      all_cross = all_cross && other.value > 4 * other.standard_error;
      others += fmt::format("{}{}, p̄₁ = {:g}: {}", others.empty() ? "" : "; ", kernel.particle, p1, text_of(other));
    }
  claims.push_back({"p̄₁ = 8 and p̄₁ = 2, and peakons, gave qualitatively similar results.",
                    all_cross ? html::Verdict::kHolds : html::Verdict::kDoesNotHold,
                    "crossing probability of " + others});

  int crossed = 0;
  for (const PaperKernel& kernel : paper_kernels())
    for (const double p1 : {8.0, 4.0, 2.0, 1.0}) {
      const Points q = laboratory.paths({kernel, "none", p1}, 1).front().path.final().q;
      if (q(1) < q(0)) ++crossed;
    }
  claims.push_back({"Without noise the faster pulson can never pass the slower one.",
                    crossed == 0 ? html::Verdict::kHolds : html::Verdict::kDoesNotHold,
                    fmt::format("{} of 8 deterministic runs (both kernels, p̄₁ = 8, 4, 2, 1) crossed", crossed)});
  claims.push_back({"The variational integrator exactly preserves the total momentum.",
                    sums.momentum_error < 1e-12 ? html::Verdict::kHolds : html::Verdict::kDoesNotHold,
                    fmt::format("largest relative change over {} paths: {:.1e}", sums.samples, sums.momentum_error)});
  section.blocks.emplace_back(std::move(claims));
}

void add_screening_claims(html::ReportSection& section, const Laboratory& laboratory, const PaperPair& pair) {
  const TimeGrid& grid = laboratory.options().grid;
  const int early = static_cast<int>(std::lround(1 / grid.dt()));  // t = 1: a gap of 7
  const ensemble::EnsembleSums sums = laboratory.sample(pair, "figure4", {early, grid.steps});
  const ensemble::EnsembleSums unscreened =
      laboratory.sample({pair.kernel, "ch-sd:beta=4,on=2", pair.p1}, "figure4, unscreened", {early, grid.steps});
  ensemble::EnsembleOptions options;
  options.grid = grid;
  options.seed = laboratory.options().seed;
  options.samples = std::min<std::int64_t>(laboratory.options().samples,
                                           laboratory.options().quick ? kQuickCompensated : kCompensated);
  const ensemble::EnsembleSums stratonovich =
      laboratory.finish(paper_system(pair), "variational", paper_start(pair.p1), options, "figure4, compensated");
  const auto share = [](const ensemble::EnsembleSums& s) {
    return fmt::format("{} clean, {} without a root, {} with momenta beyond 1e8, of {}", s.paths.clean, s.paths.no_root,
                       s.paths.momentum_bound, s.samples);
  };
  const Estimate crossing = sums.crossing_probability();
  html::ReportClaims claims;
  claims.push_back({"The screened potential is translation-invariant, so that the total momentum is preserved exactly.",
                    sums.momentum_error < 1e-10 ? html::Verdict::kHolds : html::Verdict::kDoesNotHold,
                    fmt::format("largest change, relative to Σ|p(0)|: {:.1e}, over paths with momenta up to 1e8",
                                sums.momentum_error)});
  const auto deviation_of_q2 = [](const ensemble::EnsembleSums& s) {
    return std::sqrt(s.moments.front().variance()[1]);
  };
  const bool restricted =
      deviation_of_q2(sums) < 1e-3 * deviation_of_q2(unscreened) && crossing.value > 4 * crossing.standard_error;
  claims.push_back(
      {"Screening restricts the stochastic effects to the situation when two pulsons get close.",
       restricted ? html::Verdict::kHolds : html::Verdict::kDoesNotHold,
       fmt::format("at t = 1, with a gap of 7, q₂ has the standard deviation {:.1e}, without screening {:.3g}; "
                   "when they meet, pulsons cross: {} at the end ({})",
                   deviation_of_q2(sums), deviation_of_q2(unscreened), text_of(crossing), share(sums))});
  const Estimate other = stratonovich.crossing_probability();
  claims.push_back(
      {"(20) converges to the Stratonovich equation (11) (§4).",
       std::abs(standard_errors_apart(crossing, other)) > 3                   ? html::Verdict::kDoesNotHold
       : std::hypot(crossing.standard_error, other.standard_error) < kTelling ? html::Verdict::kHolds
                                                                              : html::Verdict::kNotTested,
       fmt::format("for this noise, which acts on positions and momenta together, (20) as printed belongs to the "
                   "Hamiltonian H − ¼ Σ h_q·h_p: it has {}; with that term added to H, which makes it Stratonovich's "
                   "equation (pulson's integrator variational), {} ({}). They are {:.1f} standard errors apart",
                   text_of(crossing), text_of(other), share(stratonovich),
                   std::abs(standard_errors_apart(other, crossing)))});
  section.blocks.emplace_back(std::move(claims));
}

}  // namespace

html::ReportSection figure1(const Laboratory& laboratory) {
  const PaperPair pair = chosen_pair(laboratory.own(), "ch-sd:on=2");
  html::ReportSection section{"Figure 1: sample paths", {}};
  add_paths(section, laboratory, pair, "figure1", fmt::format("Sample paths of {}, p̄₁ = 4", pair.kernel.particle));
  if (laboratory.own().is_of_paper({kSampleBeta}))
    add_crossing_claims(section, laboratory, pair);
  else
    add_own_sample(section, laboratory, pair, "figure1");
  return section;
}

html::ReportSection figure4(const Laboratory& laboratory) {
  const PaperPair pair = chosen_pair(laboratory.own(), "ch-sd-screened:gamma=4,on=2");
  html::ReportSection section{"Figure 4: noise screening", {}};
  section.blocks.emplace_back(html::ReportParagraph{
      "The paper prints the potential as β p₂ exp(−(q₂ − q₁)²)/γ and calls γ the range over which the "
      "noise acts. It is "
      "read here as β p₂ exp(−(q₂ − q₁)²/γ), which has that range."});
  add_paths(section, laboratory, pair, "figure4", "Sample paths with screened noise, p̄₁ = 4");
  if (laboratory.own().is_of_paper({kSampleBeta}))
    add_screening_claims(section, laboratory, pair);
  else
    add_own_sample(section, laboratory, pair, "figure4");
  return section;
}

}  // namespace pulson
