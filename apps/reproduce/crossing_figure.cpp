// Figure 3: the probability of crossing over β.

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "core/csv_table.hpp"
#include "fokker_planck/pair_noise.hpp"
#include "laboratory.hpp"
#include "shell/probability_text.hpp"

namespace pulson {
namespace {

constexpr std::array<double, 4> kMomenta = {8, 4, 2, 1};
constexpr double kLargestBeta = 6.5;
constexpr const char* kCrossingNoise = "ch-sd:on=2";

/// A sweep over β for one kernel and p̄₁.
struct Curve {
  PaperPair pair;
  std::vector<records::SweepPoint> points;
  std::vector<GridCrossing> grid{};  ///< one for each point, or none where the grid does not know the noise

  const records::SweepPoint& last() const { return points.back(); }
};

Estimate sampled(const records::SweepPoint& point) { return point.run.sums.crossing_probability(); }

int most_grids(const Laboratory& laboratory) { return laboratory.options().quick ? 2 : 3; }

std::vector<double> paper_betas(const Laboratory& laboratory) {
  return parse_values(fmt::format("0:{}:{}", kLargestBeta, laboratory.options().quick ? 0.5 : 0.25), "--beta");
}

fokker_planck::PairEquation pair_equation(const Laboratory& laboratory, const PaperPair& pair, double beta) {
  return {make_kernel(pair.kernel.spec, {}), beta, laboratory.options().grid.time, 0, 10, pair.p1, 1};
}

std::vector<Curve> sample_curves(const Laboratory& laboratory) {
  const std::vector<double> betas = laboratory.own().betas_or(paper_betas(laboratory));
  std::vector<Curve> curves;
  for (const PaperKernel& kernel : laboratory.own().kernels_or(paper_kernels()))
    for (const double p1 : kMomenta) {
      const PaperPair pair{kernel, laboratory.own().noise_or(kCrossingNoise), p1};
      curves.push_back({pair, laboratory.sweep(pair, betas, fmt::format("figure3, {}, p1 = {:g}, ", kernel.name, p1))});
    }
  return curves;
}

/// The pair equation of each point that has one; the curves have all the same noise.
void solve_grids(const Laboratory& laboratory, std::vector<Curve>& curves) {
  std::vector<fokker_planck::PairEquation> pairs;
  for (const Curve& curve : curves)
    for (const records::SweepPoint& point : curve.points) {
      const auto betas = independent_amplitudes(*point.run.system.noise, point.run.start);
      if (!betas) return;
      pairs.push_back(pair_equation(laboratory, curve.pair, std::hypot((*betas)[0], (*betas)[1])));
    }
  const std::vector<GridCrossing> solved = laboratory.solve(pairs, most_grids(laboratory), "figure3");
  auto next = solved.begin();
  for (Curve& curve : curves) {
    curve.grid.assign(next, next + std::ssize(curve.points));
    next += std::ssize(curve.points);
  }
}

std::string csv_of(const std::vector<Curve>& curves) {
  text::CsvTable table{"kernel",         "p1",   "beta",           "samples",          "clean",     "probability",
                       "standard_error", "ever", "momentum_error", "grid_probability", "grid_error"};
  for (const Curve& curve : curves)
    for (std::size_t i = 0; i < curve.points.size(); ++i) {
      const ensemble::EnsembleSums& sums = curve.points[i].run.sums;
      const Estimate crossing = sums.crossing_probability();
      table.word(curve.pair.kernel.spec);
      table.numbers(
          curve.pair.p1, curve.points[i].value, sums.samples, sums.paths.clean, crossing.value, crossing.standard_error,
          static_cast<double>(sums.crossing.ever) / static_cast<double>(sums.paths.clean), sums.momentum_error);
      if (curve.grid.empty())
        table.missing().missing();
      else
        table.numbers(curve.grid[i].probability, curve.grid[i].error);
      table.end_row();
    }
  return std::move(table).take();
}

charts::ChartPanel panel_of(const std::vector<Curve>& curves, const PaperKernel& kernel) {
  charts::ChartPanel panel;
  panel.heading = fmt::format("{}: probability that q₂ < q₁ at the end, over β",
                              kernel.particle == "peakons" ? "Peakons" : kernel.particle);
  panel.y_range = {0, 1};
  panel.reference_lines = {{1, ""}, {0.5, "½"}};
  for (const Curve& curve : curves) {
    if (curve.pair.kernel.spec != kernel.spec) continue;
    const std::string name = fmt::format("p̄₁ = {:g}", curve.pair.p1);
    charts::Series grid{.name = name, .x = {}, .y = {}, .dashed = true};
    for (std::size_t i = 0; i < curve.grid.size(); ++i) {
      grid.x.push_back(curve.points[i].value);
      grid.y.push_back(curve.grid[i].probability);
    }
    panel.series.push_back(std::move(grid));
    panel.series.push_back(probability_series(curve.points, name));
  }
  return panel;
}

charts::Chart chart_of(const Laboratory& laboratory, const std::vector<Curve>& curves) {
  charts::Chart chart{
      "The probability of crossing",
      fmt::format("{} paths a point, bars: two standard errors  ·  dt = {:.3g}  ·  t = {:.3g}{}",
                  laboratory.options().samples, laboratory.options().grid.dt(), laboratory.options().grid.time,
                  curves.front().grid.empty() ? "" : "  ·  dashed: the pair equation on a grid"),
      {},
      false};
  for (const PaperKernel& kernel : laboratory.own().kernels_or(paper_kernels()))
    chart.rows.push_back({panel_of(curves, kernel)});
  return chart;
}

const Curve& curve_of(const std::vector<Curve>& curves, const std::string& kernel, double p1) {
  return *std::find_if(curves.begin(), curves.end(),
                       [&](const Curve& curve) { return curve.pair.kernel.name == kernel && curve.pair.p1 == p1; });
}

/// Crossing beyond the paper's range, on the grid.
struct BeyondTheRange {
  html::ReportTable table{{"kernel", "p̄₁"}, {}, "Beyond the paper's range of β, on the grid"};
  double most_of_unequal = 0;   ///< over all β and p̄₁ > 1
  double last_of_unequal = 0;   ///< the largest for p̄₁ > 1 at the largest β
  double equals_from_half = 0;  ///< the largest distance from ½ for p̄₁ = 1 at the largest β
};

BeyondTheRange beyond_the_range(const Laboratory& laboratory) {
  constexpr std::array<double, 4> kBetas = {10, 20, 50, 100};
  BeyondTheRange beyond;
  for (const double beta : kBetas) beyond.table.header.push_back(fmt::format("β = {:g}", beta));
  for (const PaperKernel& kernel : paper_kernels())
    for (const double p1 : kMomenta) {
      std::vector<fokker_planck::PairEquation> pairs;
      for (const double beta : kBetas) pairs.push_back(pair_equation(laboratory, {kernel, "", p1}, beta));
      beyond.table.rows.push_back({{kernel.name}, {fmt::format("{:g}", p1)}});
      double last = 0;
      for (const GridCrossing& crossing :
           laboratory.solve(pairs, most_grids(laboratory), "figure3, beyond beta = 6.5")) {
        beyond.table.rows.back().push_back({value_with_error(crossing.probability, crossing.error)});
        last = crossing.probability;
        if (p1 > 1) beyond.most_of_unequal = std::max(beyond.most_of_unequal, last);
      }
      if (p1 > 1)
        beyond.last_of_unequal = std::max(beyond.last_of_unequal, last);
      else
        beyond.equals_from_half = std::max(beyond.equals_from_half, std::abs(last - 0.5));
    }
  return beyond;
}

void add_claims(html::ReportSection& section, const Laboratory& laboratory, const std::vector<Curve>& curves) {
  html::ReportClaims claims;
  std::string at_end, of_equals;
  bool all_near_one = true, equals_cross = true;
  for (const PaperKernel& kernel : paper_kernels()) {
    for (const double p1 : {8.0, 4.0, 2.0}) {
      const Estimate end = sampled(curve_of(curves, kernel.name, p1).last());
      all_near_one = all_near_one && end.value > 0.95;
      at_end += fmt::format("{}{}, p̄₁ = {:g}: {}", at_end.empty() ? "" : "; ", kernel.name, p1, text_of(end));
    }
    const Estimate end = sampled(curve_of(curves, kernel.name, 1).last());
    equals_cross = equals_cross && end.value > 4 * end.standard_error;
    of_equals += fmt::format("{}{}: {}", of_equals.empty() ? "" : "; ", kernel.name, text_of(end));
  }
  BeyondTheRange beyond = beyond_the_range(laboratory);
  const bool approach_one = all_near_one && beyond.last_of_unequal > 0.95;
  claims.push_back(
      {"The probability of crossing seems to approach unity for p̄₁ > 1.",
       approach_one ? html::Verdict::kHolds : html::Verdict::kDoesNotHold,
       fmt::format("at β = 6.5 it is {}. Beyond the paper's range the largest is {:.3f}; at β = 100 none is "
                   "above {:.3f} (table below)",
                   at_end, beyond.most_of_unequal, beyond.last_of_unequal)});
  claims.push_back(
      {"It seems to approach 0.5 for p̄₁ = 1.",
       beyond.equals_from_half < 0.01 ? html::Verdict::kHolds : html::Verdict::kDoesNotHold,
       fmt::format("at β = 6.5: {}; on the grid at β = 100 within {:.3f} of ½", of_equals, beyond.equals_from_half)});
  claims.push_back({"Pulsons may cross even when they have the same initial momentum (5.1).",
                    equals_cross ? html::Verdict::kHolds : html::Verdict::kDoesNotHold,
                    fmt::format("at β = 6.5: {}", of_equals)});
  section.blocks.emplace_back(std::move(claims));
  section.blocks.emplace_back(std::move(beyond.table));
}

/// How far the scheme at the step of paths is from the equation.
void add_grid_comparison(html::ReportSection& section, const std::vector<Curve>& curves) {
  html::ReportTable table{{"kernel", "p̄₁", "β", "sampled", "grid", "difference"}, {}, "Sampling against the grid"};
  double largest = 0;
  for (const Curve& curve : curves)
    for (std::size_t i = 0; i < curve.grid.size(); ++i) {
      const double beta = curve.points[i].value;
      if (beta == 0) continue;
      const Estimate crossing = sampled(curve.points[i]);
      const double difference = crossing.value - curve.grid[i].probability;
      if (beta >= 1) largest = std::max(largest, std::abs(difference));
      if (std::abs(beta - std::round(beta)) > 1e-9 && beta < kLargestBeta) continue;
      table.rows.push_back({{curve.pair.kernel.name},
                            {fmt::format("{:g}", curve.pair.p1)},
                            {fmt::format("{:g}", beta)},
                            {text_of(crossing)},
                            {value_with_error(curve.grid[i].probability, curve.grid[i].error)},
                            {fmt::format("{:.2g}", difference)}});
    }
  if (table.rows.empty()) return;
  section.blocks.emplace_back(html::ReportParagraph{
      fmt::format("The grid solves the equation itself, without a time step of paths. The largest "
                  "difference for β ≥ 1 is {:.3f}: at "
                  "large β the paper's step is visibly too coarse, more so for peakons, and a smaller "
                  "--dt brings the two together.",
                  largest)});
  section.blocks.emplace_back(std::move(table));
}

/// The ensembles of all curves, for a table.
std::vector<std::pair<PaperPair, ensemble::EnsembleSums>> ensembles_of(const std::vector<Curve>& curves) {
  std::vector<std::pair<PaperPair, ensemble::EnsembleSums>> ensembles;
  for (const Curve& curve : curves)
    for (const records::SweepPoint& point : curve.points)
      ensembles.emplace_back(PaperPair{curve.pair.kernel, point.run.system.noise->spec(), curve.pair.p1},
                             point.run.sums);
  return ensembles;
}

}  // namespace

html::ReportSection figure3(const Laboratory& laboratory) {
  std::vector<Curve> curves = sample_curves(laboratory);
  solve_grids(laboratory, curves);
  html::ReportSection section{"Figure 3: the probability of crossing", {}};
  laboratory.write_csv("figure3.csv", csv_of(curves));
  laboratory.add_chart(section, "figure3", chart_of(laboratory, curves), "The probability of crossing over β");
  if (laboratory.own().is_of_paper(paper_betas(laboratory)))
    add_claims(section, laboratory, curves);
  else
    add_own_results(section, laboratory.own(), ensembles_of(curves));
  add_grid_comparison(section, curves);
  return section;
}

}  // namespace pulson
