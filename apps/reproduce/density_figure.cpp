// Section 3: the densities (15) and (18) beside histograms, and the pair equation on a grid.

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "core/csv_table.hpp"
#include "laboratory.hpp"

namespace pulson {
namespace {

constexpr double kBeta = 1.5;
constexpr double kFreeMomentum = 4;

struct Marginal {
  std::string heading;
  ensemble::Histogram histogram;
  fokker_planck::NormalLaw law;
};

/// sup |F_sampled − F| at the edges of the bins.
double distance(const Marginal& marginal) {
  const auto total = static_cast<double>(marginal.histogram.total());
  double below = 0, largest = 0;
  for (std::size_t bin = 0; bin < marginal.histogram.counts.size(); ++bin) {
    below += static_cast<double>(marginal.histogram.counts[bin]) / total;
    const double edge = marginal.histogram.low + marginal.histogram.width() * static_cast<double>(bin + 1);
    if (bin + 1 < marginal.histogram.counts.size())
      largest = std::max(largest, std::abs(below - marginal.law.cdf(edge)));
  }
  return largest;
}

charts::Series sampled(const ensemble::Histogram& histogram) {
  constexpr double kBars = 50;
  ensemble::DensityBars bars = histogram.bars(0.0001, kBars);
  return {
      .name = "sampled", .x = std::move(bars.edges), .y = std::move(bars.values), .style = charts::SeriesStyle::kSteps};
}

charts::Series density(const fokker_planck::NormalLaw& law, const std::string& name) {
  charts::Series series;
  series.name = name;
  series.colour = charts::Series::kInk;
  const double deviation = std::sqrt(law.variance);
  for (int i = -200; i <= 200; ++i) {
    series.x.push_back(law.mean + deviation * i / 50);
    series.y.push_back(law.density(series.x.back()));
  }
  return series;
}

charts::ChartPanel panel_of(const Marginal& marginal) {
  charts::ChartPanel panel;
  panel.heading = marginal.heading;
  panel.series = {sampled(marginal.histogram), density(marginal.law, "density (15), the marginals of (18)")};
  return panel;
}

/// Histograms of all coordinates at these times.
ensemble::EnsembleSums sample(const Laboratory& laboratory, const PhaseState& start, const std::string& noise,
                              const std::vector<double>& times, std::vector<int>& steps) {
  ensemble::EnsembleOptions options;
  const double dt = laboratory.options().grid.dt();
  options.grid = {times.back(), static_cast<int>(std::lround(times.back() / dt))};
  for (const double time : times) options.records.push_back(static_cast<int>(std::lround(time / dt)));
  steps = options.histograms = options.records;
  options.samples = laboratory.options().samples;
  options.seed = laboratory.options().seed;
  const StochasticSystem system{make_kernel(paper_kernels().front().spec, {}),
                                paper_system({paper_kernels().front(), noise, kFreeMomentum}).noise};
  return laboratory.finish(system, "variational-paper", start, options, "fokker-planck");
}

std::string grids_text(const GridCrossing& crossing) {
  std::string text;
  for (const double p : crossing.grids) text += fmt::format("{}{:.5g}", text.empty() ? "" : ", ", p);
  return text;
}

}  // namespace

html::ReportSection fokker_planck_equation(const Laboratory& laboratory) {
  const std::string noise = fmt::format("ch-sd:beta={}", kBeta);
  const double dt = laboratory.options().grid.dt();
  std::vector<int> steps;
  charts::Chart chart{
      "Densities of one pulson and of two",
      fmt::format("{}, Gaussian pulsons  ·  {} paths  ·  dt = {:.3g}", noise, laboratory.options().samples, dt),
      {{}, {}, {}},
      false};
  text::CsvTable densities{"pulsons", "landmark", "time", "mean", "variance", "law_mean", "law_variance", "distance"};
  std::array<std::vector<double>, 3> distances;
  const auto add = [&](std::size_t row, const ensemble::EnsembleSums& sums, Eigen::Index landmark, Eigen::Index count,
                       const fokker_planck::FreePulson& pulson) {
    for (std::size_t record = 0; record < steps.size(); ++record) {
      const double time = dt * steps[record];
      const Marginal marginal{fmt::format("density of {} at t = {:.3g}",
                                          count == 1      ? "q"
                                          : landmark == 0 ? "q₁"
                                                          : "q₂",
                                          time),
                              sums.histograms[record][static_cast<std::size_t>(landmark)],
                              position_law_of_scheme(pulson, {time, steps[record]})};
      chart.rows[row].push_back(panel_of(marginal));
      distances[row].push_back(distance(marginal));
      densities.numbers(count, landmark + 1, time, sums.moments[record].mean[landmark],
                        sums.moments[record].variance()[landmark], marginal.law.mean, marginal.law.variance,
                        distances[row].back());
      densities.end_row();
    }
  };
  const PhaseState one{(Points(1, 1) << 0).finished(), (Points(1, 1) << kFreeMomentum).finished()};
  add(0, sample(laboratory, one, noise, {1, 5, 10}, steps), 0, 1, {0, kFreeMomentum, kBeta});
  const ensemble::EnsembleSums pair = sample(laboratory, paper_start(kFreeMomentum), noise, {0.5, 1, 10}, steps);
  add(1, pair, 0, 2, {0, kFreeMomentum, kBeta});
  add(2, pair, 1, 2, {10, 1, kBeta});

  html::ReportSection section{"Section 3: the Fokker–Planck equation", {}};
  laboratory.write_csv("densities.csv", std::move(densities).take());
  laboratory.add_chart(section, "densities", chart,
                       "Sampled densities beside (15): one pulson alone (top), and both of a pair (below)");
  const double chance = 1.95 / std::sqrt(static_cast<double>(laboratory.options().samples));  // level 0.001
  html::ReportClaims claims;
  const double alone = *std::max_element(distances[0].begin(), distances[0].end());
  claims.push_back({"(15): a free pulson's position is normal with mean q̄ + pt and variance β²t, its momentum is kept.",
                    alone < chance ? html::Verdict::kHolds : html::Verdict::kDoesNotHold,
                    fmt::format("largest distance of distribution functions {:.4f}; by chance it exceeds {:.4f} once "
                                "in 1000. (The scheme's own variance, β²(t − ¾dt), is used: half of the last increment "
                                "acts in the step after)",
                                alone, chance)});
  const double apart = std::max(distances[1][0], distances[2][0]), met = std::max(distances[1][2], distances[2][2]);
  claims.push_back(
      {"(18) satisfies (16) asymptotically: pulsons far from each other behave like individual particles.",
       apart < chance && met > chance ? html::Verdict::kHolds : html::Verdict::kDoesNotHold,
       fmt::format("distance {:.4f} at t = 0.5, before they meet; {:.3f} at t = 10, after. As a joint density, (18) is "
                   "a sum where a product is meant; each term is the marginal of one pulson",
                   apart, met)});
  section.blocks.emplace_back(std::move(claims));
  section.blocks.emplace_back(html::ReportParagraph{
      "With h = βp₂ total momentum is kept and the collision depends on r = q₂ − q₁ and y = ln(p₂/p₁) alone. The "
      "backward equation in these two is solved on a grid, which gives crossing probabilities without sampling; figure "
      "3 has the comparison with Monte Carlo over all β."});
  html::ReportTable table{{"kernel", "β", "grids, each of half the spacing", "probability", "stated error", "seconds"},
                          {},
                          "Crossing at t = 100 on the grid, p̄₁ = 4"};
  constexpr std::array<double, 7> kGridBetas = {0.5, 1, 1.5, 2, 3, 4, 6.5};
  for (const PaperKernel& kernel : paper_kernels()) {
    std::vector<fokker_planck::PairEquation> pairs;
    for (const double beta : kGridBetas)
      pairs.push_back({make_kernel(kernel.spec, {}), beta, laboratory.options().grid.time, 0, 10, kFreeMomentum, 1});
    const std::vector<GridCrossing> crossings =
        laboratory.solve(pairs, laboratory.options().quick ? 2 : 4, "fokker-planck, " + kernel.name);
    for (std::size_t i = 0; i < crossings.size(); ++i)
      table.rows.push_back({{kernel.name},
                            {fmt::format("{:g}", kGridBetas.at(i))},
                            {grids_text(crossings[i])},
                            {fmt::format("{:.5g}", crossings[i].probability)},
                            {fmt::format("{:.1e}", crossings[i].error)},
                            {fmt::format("{:.2f}", crossings[i].seconds)}});
  }
  section.blocks.emplace_back(std::move(table));
  return section;
}

}  // namespace pulson
