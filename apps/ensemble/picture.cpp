#include "picture.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace pulson {
namespace {

constexpr Eigen::Index kMostLandmarks = 4;
constexpr double kMostBars = 60;  // of a density

/// `landmark 2`
std::string name_of(const EnsembleRun& run, Eigen::Index landmark) {
  return "landmark " + run.shape.describe(static_cast<int>(landmark));
}

Eigen::Index landmarks_shown(const EnsembleRun& run) { return std::min(run.start.q.cols(), kMostLandmarks); }

/// The mean over time within the band of the middle nine tenths, or of one standard deviation where there are no
/// histograms.
Series over_time(const EnsembleRun& run, Eigen::Index landmark, Eigen::Index coordinate) {
  Series series{.name = name_of(run, landmark), .x = {}, .y = {}};
  for (std::size_t record = 0; record < run.options.records.size(); ++record) {
    const Moments& moments = run.sums.moments[record];
    if (moments.count < 2) continue;
    const double mean = moments.mean[coordinate];
    const double deviation = std::sqrt(moments.variance()[coordinate]);
    series.x.push_back(run.options.grid.at(run.options.records[record]));
    series.y.push_back(mean);
    const auto& histograms = run.sums.histograms[record];
    const auto index = static_cast<std::size_t>(coordinate);
    series.low.push_back(histograms.empty() ? mean - deviation : histograms[index].quantile(0.05));
    series.high.push_back(histograms.empty() ? mean + deviation : histograms[index].quantile(0.95));
  }
  return series;
}

/// As many bars as the samples allow (Rice's rule), without the outermost tails.
Series density_of(const Histogram& histogram, const std::string& name) {
  const double most = std::min(kMostBars, 2 * std::cbrt(static_cast<double>(histogram.total())));
  DensityBars bars = histogram.bars(0.001, most);
  return {.name = name, .x = std::move(bars.edges), .y = std::move(bars.values), .style = SeriesStyle::kSteps};
}

std::string axis_text(const EnsembleRun& run, Eigen::Index axis) {
  return run.start.q.rows() == 1 ? "" : fmt::format(", component {}", "xyz"[axis]);
}

/// A density without any width cannot be drawn.
bool has_width(const Histogram& histogram) { return histogram.total() > 0 && histogram.largest > histogram.smallest; }

/// Means and bands over time, and the density at the end, along one axis.
std::vector<ChartPanel> panels_of(const EnsembleRun& run, Eigen::Index axis) {
  const Eigen::Index shown = landmarks_shown(run);
  const std::string some =
      axis == 0 && shown < run.start.q.cols() ? fmt::format(", {} of {} landmarks", shown, run.start.q.cols()) : "";
  ChartPanel positions{.heading = "Positions q over time t" + axis_text(run, axis)};
  ChartPanel momenta{.heading = "Momenta p over time t" + axis_text(run, axis)};
  ChartPanel density{.heading = fmt::format("Density of q at t = {:.4g}", run.options.grid.time)};
  for (Eigen::Index landmark = 0; landmark < shown; ++landmark) {
    const Eigen::Index coordinate = landmark * run.start.q.rows() + axis;
    positions.series.push_back(over_time(run, landmark, coordinate));
    momenta.series.push_back(over_time(run, landmark, run.start.q.size() + coordinate));
    const auto& histograms = run.sums.histograms.back();
    if (histograms.empty() || !has_width(histograms[static_cast<std::size_t>(coordinate)])) continue;
    density.series.push_back(density_of(histograms[static_cast<std::size_t>(coordinate)], name_of(run, landmark)));
  }
  if (density.series.empty()) return {std::move(positions), std::move(momenta)};
  return {std::move(positions), std::move(momenta), std::move(density)};
}

}  // namespace

Chart ensemble_chart(const EnsembleRun& run) {
  const Eigen::Index shown = landmarks_shown(run);
  const std::string some = shown < run.start.q.cols() ? fmt::format(", {} of them shown", shown) : "";
  Chart chart{.title = fmt::format("{} sample paths of {} landmark{}{}{}", run.sums.samples, run.shape.count(),
                                   run.shape.count() == 1 ? "" : "s", some, run.partial() ? " (partial)" : ""),
              .subtitle = fmt::format("{}  ·  {}  ·  {}, dt = {:.3g}  ·  seed {}  ·  lines: means, bands: middle 90 %",
                                      shortened_spec(run.system.noise->spec()), run.system.kernel.spec(3),
                                      run.integrator, run.options.grid.dt(), run.options.seed),
              .rows = {}};
  for (Eigen::Index axis = 0; axis < run.start.q.rows(); ++axis) chart.rows.push_back(panels_of(run, axis));
  return chart;
}

}  // namespace pulson
