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

bool are_alike(const EnsembleRun& run) {
  return run.sums.crossing.at_end == 0 || run.sums.crossing.at_end == run.sums.paths.clean;
}

double fraction(std::int64_t part, std::int64_t all) { return static_cast<double>(part) / static_cast<double>(all); }

}  // namespace

const Facts<EnsembleRun>& ensemble_facts() {
  using R = EnsembleRun;
  static const Facts<R> facts = {
      {"partial", "partial", "whether paths are left to be sampled", "", &R::partial},
      {"kernel", "kernel", "of the flow", "{}", [](const R& r) { return r.system.kernel.spec(); }},
      {"noise", "noise", "the noise model", "{}", [](const R& r) { return r.system.noise->spec(); }},
      {"integrator", "integrator", "of the paths", "", &R::integrator},
      {"method", "method", "how paths were computed", "", &R::method},
      {"samples", "paths", "sample paths", "", [](const R& r) { return r.sums.samples; }},
      {"samples_wanted", "paths asked for", "those of all shards", "", [](const R& r) { return r.options.samples; }},
      {"antithetic", "antithetic", "whether each second path has the negative noise", "",
       [](const R& r) { return r.options.antithetic; }},
      {"seed", "seed", "of the random numbers", "", [](const R& r) { return r.options.seed; }},
      {"dt", "time step", "of the integrator", "{:.4g}", [](const R& r) { return r.options.grid.dt(); }},
      {"steps", "steps", "of the integrator", "", [](const R& r) { return r.options.grid.steps; }},
      {"time", "time", "T", "{:.4g}", [](const R& r) { return r.options.grid.time; }},
      {"threads", "threads", "of this process", "", &R::threads},
      {"seconds", "seconds", "of sampling", "{:.2f}", &R::seconds},
      {"source", "source", "where the start is from", "", [](const R& r) { return r.shape.source; }},
      {"crossing.probability", "probability of crossing", "that the order at the end differs, of clean paths", "{:.3g}",
       [](const R& r) { return defined(r.sums.crossing_probability().value); }},
      {"crossing.standard_error", "its standard error", "undefined where all paths are alike", "{:.2g}",
       [](const R& r) { return defined(are_alike(r) ? kUndefined : r.sums.crossing_probability().standard_error); }},
      {"crossing.ever", "fraction out of order at some step", "of clean paths", "{:.4g}",
       [](const R& r) { return defined(fraction(r.sums.crossing.ever, r.sums.paths.clean)); }},
      {"crossing.over", "over", "what these are fractions of", "", [](const R&) { return std::string("clean paths"); }},
      {"crossing.if_all_others_did_not", "if no other path crossed", "the probability over all paths", "{:.3g}",
       [](const R& r) { return defined(fraction(r.sums.crossing.at_end, r.sums.samples)); }},
      {"crossing.if_all_others_did", "if all others crossed", "the probability over all paths", "{:.3g}",
       [](const R& r) {
         return defined(fraction(r.sums.crossing.at_end + r.sums.samples - r.sums.paths.clean, r.sums.samples));
       }},
      {"paths.clean", "clean paths", "followed to the end", "", [](const R& r) { return r.sums.paths.clean; }},
      {"paths.no_root", "paths without a root", "whose step had no solution", "",
       [](const R& r) { return r.sums.paths.no_root; }},
      {"paths.momentum_bound", "paths beyond the bound", "of the momenta", "",
       [](const R& r) { return r.sums.paths.momentum_bound; }},
      {"paths.tie", "ties", "paths with two landmarks at one place at the end", "",
       [](const R& r) { return r.sums.paths.tie; }},
      {"momentum_bound", "bound of the momenta", "beyond which a path is not clean", "{:.4g}",
       [](const R& r) { return defined(r.options.momentum_bound); }},
      {"largest_momentum", "largest momentum", "of a landmark in a clean path", "{:.4g}",
       [](const R& r) { return defined(r.sums.largest_momentum); }},
      {"momentum_error_max", "error of the total momentum", "largest change, relative to the sum of |p0|", "{:.1e}",
       [](const R& r) { return r.sums.momentum_error; }}};
  return facts;
}

void add_ensemble_facts(formats::Json& json, const Facts<EnsembleRun>& facts, const EnsembleRun& run) {
  add_facts(json, facts, run);
  const ensemble::PathCounts& paths = run.sums.paths;
  if (!run.has_crossing())
    json["crossing"] = nullptr;
  else if (const double unseen = unseen_below(static_cast<double>(paths.clean)); are_alike(run))
    json["crossing"].update(run.sums.crossing.at_end == 0 ? formats::Json{{"below_95", unseen}}
                                                          : formats::Json{{"above_95", 1 - unseen}});
}

std::string ensemble_json(const EnsembleRun& run) {
  formats::Json json;
  json["format"] = "pulson ensemble 1";
  json["version"] = version();
  add_ensemble_facts(json, ensemble_facts(), run);
  json["q"] = formats::points_json(run.start.q);
  json["p"] = formats::points_json(run.start.p);
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
