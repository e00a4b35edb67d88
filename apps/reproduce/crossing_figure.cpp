// Figure 3: the probability of crossing over β.

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "core/csv_table.hpp"
#include "laboratory.hpp"
#include "pulson/fokker_planck/pair_equation.hpp"
#include "shell/probability_text.hpp"

namespace pulson {
namespace {

constexpr std::array<double, 4> kMomenta = {8, 4, 2, 1};
constexpr double kLargestBeta = 6.5;

struct Point {
  PaperKernel kernel;
  double p1;
  double beta;
  ensemble::EnsembleSums sums;
  fokker_planck::PairCrossing grid;

  Estimate sampled() const { return sums.crossing_probability(); }
};

fokker_planck::PairEquation pair_equation(const Laboratory& laboratory, const Point& point) {
  return {make_kernel(point.kernel.spec, {}), point.beta, laboratory.options().grid.time, 0, 10, point.p1, 1};
}

fokker_planck::PairEquationOptions grid_options(const Laboratory& laboratory) {
  return laboratory.options().quick ? fokker_planck::PairEquationOptions{.most_grids = 2}
                                    : fokker_planck::PairEquationOptions{.most_grids = 3};
}

std::vector<Point> sample_points(const Laboratory& laboratory) {
  const double step = laboratory.options().beta_step;
  const int steps = static_cast<int>(std::lround(kLargestBeta / step));
  std::vector<Point> points;
  for (const PaperKernel& kernel : paper_kernels())
    for (const double p1 : kMomenta)
      for (int i = 0; i <= steps; ++i) {
        const double beta = i == steps ? kLargestBeta : i * step;
        const std::string noise = beta > 0 ? fmt::format("ch-sd:beta={},on=2", beta) : "none";
        const std::string what = fmt::format("figure3, point {} of {}", points.size() + 1,
                                             paper_kernels().size() * kMomenta.size() * (steps + 1));
        points.push_back({kernel, p1, beta, laboratory.sample({kernel, noise, p1}, what), {}});
      }
  return points;
}

void solve_grids(const Laboratory& laboratory, std::vector<Point>& points) {
  constexpr std::size_t kAtOnce = 8;  // between looks at the user
  for (std::size_t begin = 0; begin < points.size(); begin += kAtOnce) {
    laboratory.show(fmt::format("figure3, grids {} of {}", begin, points.size()));
    std::vector<fokker_planck::PairEquation> pairs;
    for (std::size_t i = begin; i < std::min(begin + kAtOnce, points.size()); ++i)
      pairs.push_back(pair_equation(laboratory, points[i]));
    const std::vector<fokker_planck::PairCrossing> solved = crossing_probabilities(pairs, grid_options(laboratory));
    for (std::size_t i = 0; i < solved.size(); ++i) points[begin + i].grid = solved[i];
  }
}

std::string csv_of(const std::vector<Point>& points) {
  io::CsvTable table{"kernel",         "p1",   "beta",           "samples",          "clean",     "probability",
                     "standard_error", "ever", "momentum_error", "grid_probability", "grid_error"};
  for (const Point& point : points) {
    const Estimate sampled = point.sampled();
    table.word(point.kernel.spec);
    table.numbers(point.p1, point.beta, point.sums.samples, point.sums.paths.clean, sampled.value,
                  sampled.standard_error,
                  static_cast<double>(point.sums.crossing.ever) / static_cast<double>(point.sums.paths.clean),
                  point.sums.momentum_error, point.grid.probability, point.grid.error);
    table.end_row();
  }
  return std::move(table).take();
}

charts::ChartPanel panel_of(const std::vector<Point>& points, const PaperKernel& kernel) {
  charts::ChartPanel panel;
  panel.heading = fmt::format("{}: probability that q₂ < q₁ at the end, over β",
                              kernel.particle == "peakons" ? "Peakons" : kernel.particle);
  panel.y_range = {0, 1};
  panel.reference_lines = {{1, ""}, {0.5, "½"}};
  for (const double p1 : kMomenta) {
    charts::Series grid, sampled;
    grid.dashed = true;
    grid.name = sampled.name = fmt::format("p̄₁ = {:g}", p1);
    sampled.style = charts::SeriesStyle::kPoints;
    for (const Point& point : points) {
      if (point.kernel.name != kernel.name || point.p1 != p1) continue;
      grid.x.push_back(point.beta);
      grid.y.push_back(point.grid.probability);
      sampled.x.push_back(point.beta);
      sampled.y.push_back(point.sampled().value);
      sampled.error.push_back(2 * point.sampled().standard_error);
    }
    panel.series.push_back(std::move(grid));
    panel.series.push_back(std::move(sampled));
  }
  return panel;
}

charts::Chart chart_of(const Laboratory& laboratory, const std::vector<Point>& points) {
  charts::Chart chart{
      "The probability of crossing",
      fmt::format("{} paths a point, bars: two standard errors  ·  dt = {:.3g}  ·  t = {:.3g}  ·  dashed: the "
                  "pair equation on a grid",
                  laboratory.options().samples, laboratory.options().grid.dt(), laboratory.options().grid.time),
      {},
      false};
  for (const PaperKernel& kernel : paper_kernels()) chart.rows.push_back({panel_of(points, kernel)});
  return chart;
}

const Point& last_of(const std::vector<Point>& points, const std::string& kernel, double p1) {
  const Point* last = nullptr;
  for (const Point& point : points)
    if (point.kernel.name == kernel && point.p1 == p1) last = &point;
  return *last;
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
      for (const double beta : kBetas) pairs.push_back(pair_equation(laboratory, {kernel, p1, beta, {}, {}}));
      laboratory.show("figure3, beyond beta = 6.5");
      beyond.table.rows.push_back({{kernel.name}, {fmt::format("{:g}", p1)}});
      double last = 0;
      for (const fokker_planck::PairCrossing& crossing : crossing_probabilities(pairs, grid_options(laboratory))) {
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

void add_claims(html::ReportSection& section, const Laboratory& laboratory, const std::vector<Point>& points) {
  html::ReportClaims claims;
  std::string at_end, of_equals;
  bool all_near_one = true, equals_cross = true;
  for (const PaperKernel& kernel : paper_kernels()) {
    for (const double p1 : {8.0, 4.0, 2.0}) {
      const Estimate end = last_of(points, kernel.name, p1).sampled();
      all_near_one = all_near_one && end.value > 0.95;
      at_end += fmt::format("{}{}, p̄₁ = {:g}: {}", at_end.empty() ? "" : "; ", kernel.name, p1, text_of(end));
    }
    const Estimate end = last_of(points, kernel.name, 1).sampled();
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

/// How far the scheme at the paper's step is from the equation.
void add_grid_comparison(html::ReportSection& section, const std::vector<Point>& points) {
  html::ReportTable table{{"kernel", "p̄₁", "β", "sampled", "grid", "difference"}, {}, "Sampling against the grid"};
  double largest = 0;
  for (const Point& point : points) {
    if (point.beta == 0) continue;
    const Estimate sampled = point.sampled();
    const double difference = sampled.value - point.grid.probability;
    if (point.beta >= 1) largest = std::max(largest, std::abs(difference));
    if (std::abs(point.beta - std::round(point.beta)) > 1e-9 && point.beta < kLargestBeta) continue;
    table.rows.push_back({{point.kernel.name},
                          {fmt::format("{:g}", point.p1)},
                          {fmt::format("{:g}", point.beta)},
                          {text_of(sampled)},
                          {value_with_error(point.grid.probability, point.grid.error)},
                          {fmt::format("{:.2g}", difference)}});
  }
  section.blocks.emplace_back(html::ReportParagraph{
      fmt::format("The grid solves the equation itself, without a time step of paths. The largest "
                  "difference for β ≥ 1 is {:.3f}: at "
                  "large β the paper's step is visibly too coarse, more so for peakons, and a smaller "
                  "--dt brings the two together.",
                  largest)});
  section.blocks.emplace_back(std::move(table));
}

}  // namespace

html::ReportSection figure3(const Laboratory& laboratory) {
  std::vector<Point> points = sample_points(laboratory);
  solve_grids(laboratory, points);
  html::ReportSection section{"Figure 3: the probability of crossing", {}};
  laboratory.write_csv("figure3.csv", csv_of(points));
  laboratory.add_chart(section, "figure3", chart_of(laboratory, points),
                       "The probability of crossing for Gaussian pulsons (top) and peakons (bottom)");
  add_claims(section, laboratory, points);
  add_grid_comparison(section, points);
  return section;
}

}  // namespace pulson
