#include "picture.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "charts/chart.hpp"
#include "pulson/ensemble/ensemble.hpp"

namespace pulson {
namespace {

constexpr Eigen::Index kMostLandmarks = 4;
constexpr double kMostBars = 60;                   // of a density
constexpr std::int64_t kMostBlocks = 3;            // of paths shown, for the correlation of the axes
constexpr std::int64_t kOfShown = 5;               // all paths over those that are sampled once more, at least
constexpr std::int64_t kMostNumbers = 10'000'000;  // of the states of paths shown: 80 MB
constexpr std::size_t kMostFan = 30;
constexpr std::size_t kFanLines = 1500;

// The paths of so small an ensemble are kept.
bool is_small(const ensemble::EnsembleOptions& options) { return options.samples < kOfShown * ensemble::kBlockPaths; }

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

/// How many of the first paths are shown, and correlate the axes: in large ensembles so many blocks as are at most a
/// fifth of all.
std::int64_t paths_shown(const ensemble::EnsembleOptions& options, std::int64_t samples) {
  const std::int64_t blocks = is_small(options) ? kMostBlocks : samples / kOfShown / ensemble::kBlockPaths;
  const std::int64_t count = std::clamp<std::int64_t>(blocks, 1, kMostBlocks) * ensemble::kBlockPaths;
  return std::min(samples, count);
}

/// The first paths of the ensemble at its records, of those that are clean: kept, or sampled again by the same lanes.
class ShownPaths {
 public:
  explicit ShownPaths(const records::EnsembleRun& run) : run_(run), options_(run.options) {
    const std::int64_t numbers = 2 * run.start.q.size() * std::ssize(run.options.records);
    count_ = std::min(paths_shown(run.options, run.sums.samples), std::max<std::int64_t>(2, kMostNumbers / numbers));
    if (run.options.keep != ensemble::KeepStates::kAll) sample();
    const std::vector<double>& states = all();
    for (std::int64_t m = 0; m < count_; ++m)
      if (std::isfinite(states[static_cast<std::size_t>((m + 1) * numbers - 1)])) clean_.push_back(m);
  }

  std::size_t clean() const { return clean_.size(); }

  /// q of clean path m.
  Eigen::Map<const Points> positions(std::size_t m, std::size_t record) const {
    const auto records = static_cast<std::int64_t>(run_.options.records.size());
    const std::int64_t state = clean_[m] * records + static_cast<std::int64_t>(record);
    return {all().data() + state * 2 * run_.start.q.size(), run_.start.q.rows(), run_.start.q.cols()};
  }

 private:
  const std::vector<double>& all() const { return again_.empty() ? run_.sums.states : again_; }

  void sample() {
    options_.samples = options_.antithetic ? count_ + count_ % 2 : count_;
    options_.shard = {};
    options_.histograms.clear();
    options_.keep = ensemble::KeepStates::kAll;
    ensemble::Ensemble again(run_.system, run_.integrator, run_.start, options_);
    again.advance(static_cast<int>(again.blocks()));
    again_ = again.sums().states;
  }

  const records::EnsembleRun& run_;
  ensemble::EnsembleOptions options_;
  std::int64_t count_ = 0;
  std::vector<double> again_;
  std::vector<std::int64_t> clean_;
};

/// Standard deviations are those of all paths, correlations those of the given ones.
std::vector<Eigen::MatrixXd> covariances(const records::EnsembleRun& run, const ShownPaths& paths) {
  const Eigen::Index d = run.start.q.rows();
  const Eigen::ArrayXd deviation = run.sums.moments.back().variance().sqrt();
  std::vector<Eigen::MatrixXd> result;
  for (Eigen::Index a = 0; a < run.start.q.cols(); ++a) {
    Points ends(d, static_cast<Eigen::Index>(paths.clean()));
    for (std::size_t m = 0; m < paths.clean(); ++m)
      ends.col(static_cast<Eigen::Index>(m)) = paths.positions(m, run.options.records.size() - 1).col(a);
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

bool keeps_for_picture(const ensemble::EnsembleOptions& options, const PhaseState& start) {
  const std::int64_t records = std::ssize(options.records);
  return options.shard.count == 1 && is_small(options) &&
         2 * start.q.size() * records * options.samples <= kMostNumbers;
}

draw::EnsemblePicture make_ensemble_picture(const records::EnsembleRun& run) {
  draw::EnsemblePicture picture;
  picture.start = run.shape;
  for (std::size_t record = 0; record < run.options.records.size(); ++record) {
    const ensemble::Moments& moments = run.sums.moments[record];
    if (moments.count < 2) continue;
    picture.times.push_back(run.options.grid.at(run.options.records[record]));
    picture.mean.emplace_back(Points::Map(moments.mean.data(), run.start.q.rows(), run.start.q.cols()));
  }
  const ShownPaths paths(run);
  picture.covariances = covariances(run, paths);
  const std::size_t drawn =
      std::clamp<std::size_t>(kFanLines / static_cast<std::size_t>(run.shape.count()), 1, kMostFan);
  for (std::size_t m = 0; m < std::min(drawn, paths.clean()); ++m) {
    std::vector<Points>& positions = picture.paths.emplace_back();
    for (std::size_t record = 0; record < run.options.records.size(); ++record)
      positions.emplace_back(paths.positions(m, record));
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
