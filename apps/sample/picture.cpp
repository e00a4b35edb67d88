#include "picture.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <fmt/format.h>

#include "pulson/core/name_table.hpp"
#include "register/picture.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kTracePoints = 400;
constexpr int kRankBins = 20;
constexpr int kMostShown = 6;
constexpr std::size_t kFanPaths = 30;

std::string subtitle(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws) {
  const matching::MatchingProblem& first = problem.specimens.front();
  const std::string noise = first.system.noise->spec();
  return fmt::format("{}  ·  {}  ·  {}{} draws", noise == "none" ? "no noise" : shortened_spec(noise),
                     first.system.kernel.spec(3), draws.chains > 1 ? fmt::format("{} chains of ", draws.chains) : "",
                     draws.draws);
}

std::string chain_name(int chain) { return fmt::format("chain {}", chain + 1); }

charts::ChartPanel trace(const inference::PosteriorDraws& draws, const MatrixXd& values, const std::string& name) {
  charts::ChartPanel panel{.heading = name + ": trace", .x_label = "draw"};
  const int every = std::max(1, draws.draws / kTracePoints);
  for (int c = 0; c < std::min(draws.chains, kMostShown); ++c) {
    charts::Series series{.name = chain_name(c), .x = {}, .y = {}};
    for (int i = 0; i < draws.draws; i += every) {
      series.x.push_back(i + 1);
      series.y.push_back(values(i, c));
    }
    panel.series.push_back(std::move(series));
  }
  return panel;
}

// How many draws of each chain have ranks, among all, in each of some bins; the same number where chains mix.
charts::ChartPanel rank_panel(const inference::PosteriorDraws& draws, const MatrixXd& values) {
  std::vector<Index> order(static_cast<std::size_t>(values.size()));
  std::iota(order.begin(), order.end(), Index(0));
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return values.reshaped()[a] < values.reshaped()[b]; });
  MatrixXd counts = MatrixXd::Zero(kRankBins, values.cols());
  for (std::size_t r = 0; r < order.size(); ++r)
    counts(static_cast<Index>(r) * kRankBins / values.size(), order[r] / values.rows()) += 1;
  charts::ChartPanel panel{.heading = "ranks of each chain's draws", .x_label = "rank among all draws"};
  const double even = static_cast<double>(draws.draws) / kRankBins;
  panel.reference_lines = {{even, ""}};
  for (int c = 0; c < std::min(draws.chains, kMostShown); ++c) {
    charts::Series series{
        .name = chain_name(c), .x = {}, .y = {}};  // stairs without areas, which would hide one another
    for (int b = 0; b < kRankBins; ++b)
      for (const int side : {b, b + 1}) {
        series.x.push_back(side * static_cast<double>(values.size()) / kRankBins);
        series.y.push_back(counts(b, c));
      }
    panel.series.push_back(std::move(series));
  }
  return panel;
}

// Of θ over its prior median, on a logarithmic axis that all parameters share; densities are those of log θ.
charts::ChartPanel density(const MatrixXd& values, const inference::ParameterPrior& prior) {
  std::vector<double> x(values.data(), values.data() + values.size());
  for (double& value : x) value = std::log(value / prior.median);
  std::sort(x.begin(), x.end());
  const double low = x[x.size() / 500], high = x[x.size() - 1 - x.size() / 500];
  const int bins = std::clamp(static_cast<int>(2 * std::cbrt(static_cast<double>(x.size()))), 8, 40);
  charts::ChartPanel panel{.heading = prior.name + ": posterior, and prior (dashed)",
                           .x_label = "value over the prior median",
                           .log_x = true};
  charts::Series bars{.name = "",
                      .x = {},
                      .y = std::vector<double>(static_cast<std::size_t>(bins), 0),
                      .style = charts::SeriesStyle::kSteps};
  if (!(high > low)) return panel;
  for (int b = 0; b <= bins; ++b) bars.x.push_back(std::exp(low + b * (high - low) / bins));
  const double each = bins / (high - low) / static_cast<double>(x.size());
  for (const double value : x)
    if (value >= low && value < high) bars.y[static_cast<std::size_t>((value - low) / (high - low) * bins)] += each;
  panel.series.push_back(std::move(bars));
  charts::Series line{.name = "", .x = {}, .y = {}, .colour = charts::Series::kInk, .dashed = true};
  constexpr double kPriorReach = 2.5;  // of the prior, to either side
  for (int i = 0; i <= 100; ++i) {
    const double phi = kPriorReach * (i / 50.0 - 1);
    line.x.push_back(std::exp(prior.log_deviation * phi));
    line.y.push_back(std::exp(-0.5 * phi * phi) / (prior.log_deviation * std::sqrt(2 * std::numbers::pi)));
  }
  panel.series.push_back(std::move(line));
  return panel;
}

std::string agreement_words(const PosteriorSummary& summary) {
  if (summary.converged) return fmt::format("Chains agree: every R-hat is at most {}", inference::kHighRhat);
  if (!summary.undefined.empty())
    return fmt::format("Whether chains agree is undetermined: diagnostics of {} are undefined", summary.undefined);
  return fmt::format("Chains do not agree: R-hat is {:.3g} ({})", summary.worst_rhat, summary.worst);
}

}  // namespace

charts::Chart chains_chart(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws,
                           const PosteriorSummary& summary) {
  charts::Chart chart{.title = agreement_words(summary), .subtitle = subtitle(problem, draws), .rows = {}};
  const auto add = [&](const std::string& name, const MatrixXd& values, const inference::ParameterPrior* prior) {
    chart.rows.push_back({trace(draws, values, name), rank_panel(draws, values)});
    if (prior != nullptr) chart.rows.back().push_back(density(values, *prior));
  };
  for (std::size_t j = 0; j < draws.names.size(); ++j)
    add(draws.names[j], draws.by_chain(draws.parameters.row(static_cast<Index>(j))), &problem.parameters[j]);
  add("log likelihood", draws.by_chain(draws.log_likelihood.transpose()), nullptr);
  return chart;
}

std::size_t shown_path(const inference::PosteriorProblem& problem) {
  for (std::size_t b = 0; b < problem.tree.size(); ++b)
    if (!problem.tree[b].data) return b;
  return 0;
}

const TimeGrid& grid_of(const inference::PosteriorProblem& problem, std::size_t path) {
  return problem.tree.empty() ? problem.specimens[path].grid : problem.tree[path].grid;
}

std::string end_name(const inference::PosteriorProblem& problem, std::size_t path) {
  return problem.tree.empty() ? short_name(problem.targets[path]) : node_name(problem, path);
}

std::vector<Points> mean_path(const inference::PosteriorDraws& draws, std::size_t specimen) {
  const auto& paths = draws.paths[specimen];
  std::vector<Points> mean = paths.front();
  for (std::size_t m = 1; m < paths.size(); ++m)
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += paths[m][k];
  for (Points& q : mean) q /= static_cast<double>(paths.size());
  return mean;
}

namespace {

const Landmarks& start_of(const inference::PosteriorProblem& problem, std::size_t path) {
  return problem.tree.empty() ? problem.sources[path] : problem.sources.front();
}

std::vector<double> times_of(const inference::PosteriorProblem& problem, std::size_t path) {
  const TimeGrid& grid = grid_of(problem, path);
  std::vector<double> times;
  for (int k = 0; k <= grid.steps; ++k) times.push_back(grid.at(k));
  return times;
}

charts::Chart paths_on_line(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws,
                            std::size_t specimen) {
  charts::ChartPanel panel{.heading = "Positions over time"};
  const std::vector<double> times = times_of(problem, specimen);
  const auto& paths = draws.paths[specimen];
  const Landmarks& source = start_of(problem, specimen);
  const int shown = std::min(source.count(), kMostShown);
  for (int a = 0; a < shown; ++a) {
    charts::Series series{.name = "landmark " + source.describe(a), .x = times, .y = {}};
    for (std::size_t k = 0; k < times.size(); ++k) {
      Eigen::VectorXd at(std::ssize(paths));
      for (std::size_t m = 0; m < paths.size(); ++m) at[static_cast<Index>(m)] = paths[m][k](0, a);
      series.y.push_back(at.mean());
      series.low.push_back(std::min(at.mean(), inference::quantile(at, 0.05)));
      series.high.push_back(std::max(at.mean(), inference::quantile(at, 0.95)));
    }
    panel.series.push_back(std::move(series));
  }
  const Points target = problem.tree.empty() ? problem.targets[specimen].points : Points(1, 0);
  charts::Series ends{
      .name = "target", .x = {}, .y = {}, .style = charts::SeriesStyle::kPoints, .colour = charts::Series::kInk};
  for (int a = 0; a < std::min<Index>(shown, target.cols()); ++a)
    if (std::isfinite(target(0, a))) {
      ends.x.push_back(times.back());
      ends.y.push_back(target(0, a));
    }
  if (!ends.x.empty()) panel.series.push_back(std::move(ends));
  return {.title = "Posterior paths",
          .subtitle = subtitle(problem, draws) + "  ·  lines: means, bands: middle 90 %",
          .rows = {{panel}}};
}

}  // namespace

void write_paths_picture(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws,
                         std::size_t specimen, const draw::PictureFiles& files) {
  const Landmarks& source = start_of(problem, specimen);
  if (source.dimension() == 1) return write_chart(paths_on_line(problem, draws, specimen), files);
  const std::vector<double> times = times_of(problem, specimen);
  const bool whole = !problem.tree.empty();  // as what is at the end is not observed
  const std::size_t middle = whole ? times.size() - 1 : std::max<std::size_t>(1, (times.size() - 1) / 2);
  draw::EnsemblePicture picture;
  picture.start = source;
  const std::vector<Points> mean = mean_path(draws, specimen);
  picture.times.assign(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(middle) + 1);
  picture.mean.assign(mean.begin(), mean.begin() + static_cast<std::ptrdiff_t>(middle) + 1);
  const auto& paths = draws.paths[specimen];
  for (int a = 0; a < source.count(); ++a) {
    MatrixXd at(source.dimension(), std::ssize(paths));
    for (std::size_t m = 0; m < paths.size(); ++m) at.col(static_cast<Index>(m)) = paths[m][middle].col(a);
    at.colwise() -= at.rowwise().mean().eval();
    picture.covariances.emplace_back(at * at.transpose() / static_cast<double>(std::max<Index>(1, at.cols() - 1)));
  }
  for (std::size_t m = 0; m < paths.size(); m += std::max<std::size_t>(1, paths.size() / kFanPaths))
    picture.paths.push_back(paths[m]);
  picture.title = fmt::format("Posterior paths to {}{}", end_name(problem, specimen), whole ? "" : ", halfway");
  picture.subtitle = subtitle(problem, draws);
  if (!whole) picture.subtitle += fmt::format("  ·  sample paths go on to t = {:.4g}", times.back());
  write_ensemble_picture(picture, files);
}

charts::Chart calibration_chart(const inference::Calibration& calibration, const std::string& subtitle) {
  const bool all = std::all_of(calibration.quantities.begin(), calibration.quantities.end(),
                               [](const inference::CalibratedQuantity& quantity) { return quantity.inside_band; });
  charts::Chart chart{
      .title = all ? "Calibrated: all ranks are within their band" : "Not calibrated: ranks leave their band",
      .subtitle = subtitle,
      .rows = {}};
  const auto n = static_cast<double>(calibration.simulations);
  const auto bins = static_cast<double>(calibration.ranks + 1);
  constexpr int kBars = 16;
  for (const inference::CalibratedQuantity& quantity : calibration.quantities) {
    charts::ChartPanel histogram{
        .heading = quantity.name + ": ranks", .x_label = "rank", .reference_lines = {{n / kBars, ""}}};
    charts::Series bars{.name = "", .x = {}, .y = std::vector<double>(kBars, 0), .style = charts::SeriesStyle::kSteps};
    for (int b = 0; b <= kBars; ++b) bars.x.push_back(b * bins / kBars);
    for (const int rank : quantity.ranks) ++bars.y[static_cast<std::size_t>(rank * kBars / (calibration.ranks + 1))];
    histogram.series.push_back(std::move(bars));
    charts::ChartPanel distribution{
        .heading = fmt::format("distribution function less uniform (p = {:.2g})", quantity.deviation),
        .x_label = "rank",
        .reference_lines = {{0, ""}}};
    charts::Series band{.name = "band of 95 %", .x = {}, .y = {}, .colour = charts::Series::kInk};
    charts::Series line{.name = "ranks", .x = {}, .y = {}};
    std::vector<int> counts(static_cast<std::size_t>(calibration.ranks + 1), 0);
    for (const int rank : quantity.ranks) ++counts[static_cast<std::size_t>(rank)];
    std::partial_sum(counts.begin(), counts.end(), counts.begin());
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const double even = (static_cast<double>(i) + 1) / bins;
      band.x.push_back(static_cast<double>(i));
      band.y.push_back(0);
      band.low.push_back(calibration.lower[i] / n - even);
      band.high.push_back(calibration.upper[i] / n - even);
      line.x.push_back(static_cast<double>(i));
      line.y.push_back(counts[i] / n - even);
    }
    distribution.series = {std::move(band), std::move(line)};
    chart.rows.push_back({std::move(histogram), std::move(distribution)});
  }
  return chart;
}

}  // namespace pulson
