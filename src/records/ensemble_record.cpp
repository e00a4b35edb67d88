#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/csv_table.hpp"
#include "core/text.hpp"
#include "core/undefined.hpp"
#include "ensemble_facts.hpp"
#include "formats/json/json_reader.hpp"
#include "pulson/core/version.hpp"
#include "pulson/records/records.hpp"
#include "record_text.hpp"

namespace pulson::records {

namespace {

constexpr std::array<double, 5> kQuantiles = {0.05, 0.25, 0.5, 0.75, 0.95};

/// Part of a vector of coordinates as [landmark][axis].
formats::Json coordinates_json(const Eigen::ArrayXd& values, Eigen::Index first, const Points& like) {
  formats::Json rows = formats::Json::array();
  for (Eigen::Index a = 0; a < like.cols(); ++a) {
    formats::Json row = formats::Json::array();
    for (Eigen::Index c = 0; c < like.rows(); ++c) row.push_back(values[first + a * like.rows() + c]);
    rows.push_back(std::move(row));
  }
  return rows;
}

void add_means(formats::Json& json, const EnsembleRun& run) {
  const std::vector<int>& records = run.options.records;
  const Eigen::Index half = run.start.q.size();
  for (const char* key : {"times", "counts", "mean_q", "mean_p", "error_q", "error_p", "deviation_q", "deviation_p"})
    json[key] = formats::Json::array();
  for (std::size_t record = 0; record < records.size(); ++record) {
    const ensemble::Moments& moments = run.sums.moments[record];
    if (moments.count == 0) continue;
    const Eigen::ArrayXd error = run.sums.mean_error(record);
    const Eigen::ArrayXd deviation = moments.variance().sqrt();
    json["times"].push_back(run.options.grid.at(records[record]));
    json["counts"].push_back(moments.count);
    json["mean_q"].push_back(coordinates_json(moments.mean, 0, run.start.q));
    json["mean_p"].push_back(coordinates_json(moments.mean, half, run.start.q));
    json["error_q"].push_back(defined_or_null(coordinates_json(error, 0, run.start.q)));
    json["error_p"].push_back(defined_or_null(coordinates_json(error, half, run.start.q)));
    json["deviation_q"].push_back(defined_or_null(coordinates_json(deviation, 0, run.start.q)));
    json["deviation_p"].push_back(defined_or_null(coordinates_json(deviation, half, run.start.q)));
  }
}

/// visit(record, coordinate, "time,landmark,quantity,axis") for all coordinates of the records that have samples.
template <class Visit>
void for_each_coordinate(const EnsembleRun& run, const Visit& visit) {
  const Points& q = run.start.q;
  for (std::size_t record = 0; record < run.options.records.size(); ++record) {
    if (run.sums.moments[record].count == 0) continue;
    for (Eigen::Index i = 0; i < 2 * q.size(); ++i) {
      const Eigen::Index within = i % q.size();
      text::CsvTable place;
      place.numbers(run.options.grid.at(run.options.records[record]), within / q.rows() + 1);
      place.words(
          {i < q.size() ? "q" : "p", text::kAxisLetters.substr(static_cast<std::size_t>(within % q.rows()), 1)});
      visit(record, i, std::move(place).take());
    }
  }
}

}  // namespace

formats::Json crossing_json(const EnsembleRun& run) {
  const bool defined = run.start.q.rows() == 1 && run.start.q.cols() > 1 && run.sums.paths.clean > 0;
  if (!defined) return nullptr;
  const ensemble::PathCounts& paths = run.sums.paths;
  const Estimate estimate = run.sums.crossing_probability();
  const auto all = static_cast<double>(run.sums.samples);
  const auto crossed = static_cast<double>(run.sums.crossing.at_end);
  formats::Json json;
  json["probability"] = estimate.value;
  const bool all_alike = run.sums.crossing.at_end == 0 || run.sums.crossing.at_end == paths.clean;
  json["standard_error"] = all_alike ? formats::Json(nullptr) : defined_or_null(estimate.standard_error);
  if (all_alike) {
    const double unseen = unseen_below(static_cast<double>(paths.clean));
    json[crossed == 0 ? "below_95" : "above_95"] = crossed == 0 ? unseen : 1 - unseen;
  }
  json["ever"] = static_cast<double>(run.sums.crossing.ever) / static_cast<double>(paths.clean);
  json["over"] = "clean paths";
  json["if_all_others_did_not"] = crossed / all;
  json["if_all_others_did"] = (crossed + all - static_cast<double>(paths.clean)) / all;
  return json;
}

formats::Json paths_json(const ensemble::PathCounts& paths) {
  return {
      {"clean", paths.clean}, {"no_root", paths.no_root}, {"momentum_bound", paths.momentum_bound}, {"tie", paths.tie}};
}

std::string ensemble_json(const EnsembleRun& run) {
  formats::Json json;
  json["format"] = "pulson ensemble 1";
  json["version"] = version();
  json["partial"] = run.partial();
  json["kernel"] = run.system.kernel.spec();
  json["noise"] = run.system.noise->spec();
  json["integrator"] = run.integrator;
  json["method"] = run.method;
  json["samples"] = run.sums.samples;
  json["samples_wanted"] = run.options.samples;
  json["antithetic"] = run.options.antithetic;
  json["seed"] = run.options.seed;
  json["dt"] = run.options.grid.dt();
  json["steps"] = run.options.grid.steps;
  json["time"] = run.options.grid.time;
  json["threads"] = run.threads;
  json["seconds"] = run.seconds;
  json["source"] = run.shape.source;
  json["q"] = formats::points_json(run.start.q);
  json["p"] = formats::points_json(run.start.p);
  json["crossing"] = crossing_json(run);
  json["paths"] = paths_json(run.sums.paths);
  json["momentum_bound"] = defined_or_null(run.options.momentum_bound);
  json["largest_momentum"] = defined_or_null(run.sums.largest_momentum);
  json["momentum_error_max"] = run.sums.momentum_error;
  add_means(json, run);
  return formats::one_key_a_line(require_finite(json));
}

std::string ensemble_means_csv(const EnsembleRun& run) {
  text::CsvTable table{"time", "landmark", "quantity", "axis", "mean", "standard_error", "standard_deviation",
                       "q05",  "q25",      "q50",      "q75",  "q95"};
  for_each_coordinate(run, [&](std::size_t record, Eigen::Index i, const std::string& place) {
    const ensemble::Moments& moments = run.sums.moments[record];
    table.cells(place);
    table.numbers(moments.mean[i], run.sums.mean_error(record)[i], std::sqrt(moments.variance()[i]));
    const auto& histograms = run.sums.histograms[record];
    for (const double probability : kQuantiles)
      if (histograms.empty())
        table.empty();
      else
        table.number(histograms[static_cast<std::size_t>(i)].quantile(probability));
    table.end_row();
  });
  return std::move(table).take();
}

std::string ensemble_densities_csv(const EnsembleRun& run) {
  text::CsvTable table{"time", "landmark", "quantity", "axis", "low", "high", "density"};
  for_each_coordinate(run, [&](std::size_t record, Eigen::Index i, const std::string& place) {
    const std::vector<int>& wanted = run.densities;
    if (std::find(wanted.begin(), wanted.end(), run.options.records[record]) == wanted.end()) return;
    const ensemble::Histogram& histogram = run.sums.histograms[record][static_cast<std::size_t>(i)];
    const double width = histogram.width();
    const auto total = static_cast<double>(histogram.total());
    for (std::size_t bin = 0; bin < histogram.counts.size(); ++bin) {
      if (histogram.counts[bin] == 0) continue;
      double low = histogram.low + width * static_cast<double>(bin);
      double high = low + width;
      // The outer bins hold what lies outside, too.
      if (bin == 0) low = std::min(low, histogram.smallest);
      if (bin + 1 == histogram.counts.size()) high = std::max(high, histogram.largest);
      table.cells(place);
      table.numbers(low, high, static_cast<double>(histogram.counts[bin]) / (total * (high - low))).end_row();
    }
  });
  return std::move(table).take();
}

}  // namespace pulson::records
