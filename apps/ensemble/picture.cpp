#include "picture.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "charts/chart.hpp"
#include "pulson/ensemble/ensemble.hpp"

namespace pulson {
namespace {

constexpr Eigen::Index kMostLandmarks = 4;
constexpr double kMostBars = 60;  // of a density
constexpr int kMostPaths = 200;   // drawn again, for the correlation of the axes
constexpr std::size_t kMostFan = 30;
constexpr std::size_t kFanLines = 1500;

std::string title(const records::EnsembleRun& run, const std::string& rest) {
  return fmt::format("{} sample paths of {} landmark{}{}{}", run.sums.samples, run.shape.count(),
                     run.shape.count() == 1 ? "" : "s", rest, run.partial() ? " (partial)" : "");
}

std::string subtitle(const records::EnsembleRun& run) {
  return fmt::format("{}  ·  {}  ·  {}, dt = {:.3g}  ·  seed {}", shortened_spec(run.system.noise->spec()),
                     run.system.kernel.spec(3), run.integrator, run.options.grid.dt(), run.options.seed);
}

/// `landmark 2`
std::string name_of(const records::EnsembleRun& run, Eigen::Index landmark) {
  return "landmark " + run.shape.describe(static_cast<int>(landmark));
}

Eigen::Index landmarks_shown(const records::EnsembleRun& run) { return std::min(run.start.q.cols(), kMostLandmarks); }

/// The mean over time within the band of the middle nine tenths, or of one standard deviation where there are no
/// histograms.
charts::Series over_time(const records::EnsembleRun& run, Eigen::Index landmark, Eigen::Index coordinate) {
  charts::Series series{.name = name_of(run, landmark), .x = {}, .y = {}};
  for (std::size_t record = 0; record < run.options.records.size(); ++record) {
    const ensemble::Moments& moments = run.sums.moments[record];
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
charts::Series density_of(const ensemble::Histogram& histogram, const std::string& name) {
  const double most = std::min(kMostBars, 2 * std::cbrt(static_cast<double>(histogram.total())));
  ensemble::DensityBars bars = histogram.bars(0.001, most);
  return {.name = name, .x = std::move(bars.edges), .y = std::move(bars.values), .style = charts::SeriesStyle::kSteps};
}

/// A density without any width cannot be drawn.
bool has_width(const ensemble::Histogram& histogram) {
  return histogram.total() > 0 && histogram.largest > histogram.smallest;
}

/// Means and bands over time, and the density at the end.
charts::Chart chart_on_line(const records::EnsembleRun& run) {
  const Eigen::Index shown = landmarks_shown(run);
  charts::ChartPanel positions{.heading = "Positions q over time t"};
  charts::ChartPanel momenta{.heading = "Momenta p over time t"};
  charts::ChartPanel density{.heading = fmt::format("Density of q at t = {:.4g}", run.options.grid.time)};
  for (Eigen::Index landmark = 0; landmark < shown; ++landmark) {
    positions.series.push_back(over_time(run, landmark, landmark));
    momenta.series.push_back(over_time(run, landmark, run.start.q.size() + landmark));
    const auto& histograms = run.sums.histograms.back();
    if (histograms.empty() || !has_width(histograms[static_cast<std::size_t>(landmark)])) continue;
    density.series.push_back(density_of(histograms[static_cast<std::size_t>(landmark)], name_of(run, landmark)));
  }
  charts::Chart chart{.title = title(run, shown < run.start.q.cols() ? fmt::format(", {} of them shown", shown) : ""),
                      .subtitle = subtitle(run) + "  ·  lines: means, bands: middle 90 %",
                      .rows = {{std::move(positions), std::move(momenta)}}};
  if (!density.series.empty()) chart.rows.front().push_back(std::move(density));
  return chart;
}

/// The first paths of the ensemble again: those that are clean.
std::vector<ensemble::SamplePath> first_paths(const records::EnsembleRun& run) {
  const auto count = static_cast<int>(std::min<std::int64_t>(run.sums.samples, kMostPaths));
  std::vector<ensemble::SamplePath> paths =
      ensemble::sample_paths(run.system, *make_integrator(run.integrator), run.start,
                             {.grid = run.options.grid,
                              .seed = run.options.seed,
                              .samples = count,
                              .momentum_bound = run.options.momentum_bound});
  std::erase_if(paths, [](const ensemble::SamplePath& path) { return path.status != ensemble::PathStatus::kClean; });
  return paths;
}

/// Standard deviations are those of all paths, correlations those of the given ones.
std::vector<Eigen::MatrixXd> covariances(const records::EnsembleRun& run,
                                         const std::vector<ensemble::SamplePath>& paths) {
  const Eigen::Index d = run.start.q.rows();
  const Eigen::ArrayXd deviation = run.sums.moments.back().variance().sqrt();
  std::vector<Eigen::MatrixXd> result;
  for (Eigen::Index a = 0; a < run.start.q.cols(); ++a) {
    Points ends(d, static_cast<Eigen::Index>(paths.size()));
    for (std::size_t m = 0; m < paths.size(); ++m)
      ends.col(static_cast<Eigen::Index>(m)) = paths[m].path.final().q.col(a);
    if (ends.cols() > 0) ends.colwise() -= ends.rowwise().mean().eval();
    const Eigen::VectorXd norms = ends.rowwise().norm();
    Eigen::MatrixXd covariance = Eigen::MatrixXd(deviation.segment(a * d, d).square().matrix().asDiagonal());
    for (Eigen::Index i = 0; i < d; ++i)
      for (Eigen::Index j = 0; j < d; ++j)
        if (i != j && norms[i] > 0 && norms[j] > 0)
          covariance(i, j) =
              ends.row(i).dot(ends.row(j)) / (norms[i] * norms[j]) * deviation[a * d + i] * deviation[a * d + j];
    result.push_back(std::move(covariance));
  }
  return result;
}

}  // namespace

draw::EnsemblePicture make_ensemble_picture(const records::EnsembleRun& run) {
  draw::EnsemblePicture picture;
  picture.start = run.shape;
  for (std::size_t record = 0; record < run.options.records.size(); ++record) {
    const ensemble::Moments& moments = run.sums.moments[record];
    if (moments.count < 2) continue;
    picture.times.push_back(run.options.grid.at(run.options.records[record]));
    picture.mean.emplace_back(Points::Map(moments.mean.data(), run.start.q.rows(), run.start.q.cols()));
  }
  const std::vector<ensemble::SamplePath> paths = first_paths(run);
  picture.covariances = covariances(run, paths);
  const std::size_t drawn =
      std::clamp<std::size_t>(kFanLines / static_cast<std::size_t>(run.shape.count()), 1, kMostFan);
  for (std::size_t m = 0; m < std::min(drawn, paths.size()); ++m) {
    std::vector<Points>& positions = picture.paths.emplace_back();
    for (const PhaseState& state : paths[m].path.states) positions.push_back(state.q);
  }
  picture.title = title(run, "");
  picture.subtitle = subtitle(run);
  return picture;
}

void write_ensemble_picture(const records::EnsembleRun& run, const draw::EnsemblePicture& shape,
                            const draw::PictureFiles& files) {
  if (run.start.q.rows() == 1) return write_chart(chart_on_line(run), files);
  write_ensemble_picture(shape, files);
}

}  // namespace pulson
