#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>

#include "csv_rows.hpp"
#include "formats/json/json_reader.hpp"
#include "pulson/core/version.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/records/records.hpp"

namespace pulson::records {

namespace {

constexpr std::array<double, 5> kQuantiles = {0.05, 0.25, 0.5, 0.75, 0.95};

/// A number, or null where it is none.
formats::Json number_json(double x) { return std::isfinite(x) ? formats::Json(x) : formats::Json(nullptr); }

/// Part of a vector of coordinates as [landmark][axis].
formats::Json coordinates_json(const Eigen::ArrayXd& values, Eigen::Index first, const Points& like) {
  formats::Json rows = formats::Json::array();
  for (Eigen::Index a = 0; a < like.cols(); ++a) {
    formats::Json row = formats::Json::array();
    for (Eigen::Index c = 0; c < like.rows(); ++c) row.push_back(number_json(values[first + a * like.rows() + c]));
    rows.push_back(std::move(row));
  }
  return rows;
}

formats::Json crossing_json(const EnsembleRun& run) {
  const bool defined = run.start.q.rows() == 1 && run.start.q.cols() > 1 && run.sums.paths.clean > 0;
  if (!defined) return nullptr;
  const ensemble::PathCounts& paths = run.sums.paths;
  const Estimate estimate = run.sums.crossing_probability();
  const auto all = static_cast<double>(run.sums.samples);
  const auto crossed = static_cast<double>(run.sums.crossing.at_end);
  formats::Json json;
  json["probability"] = estimate.value;
  json["standard_error"] = number_json(estimate.standard_error);
  json["ever"] = static_cast<double>(run.sums.crossing.ever) / static_cast<double>(paths.clean);
  json["over"] = "clean paths";
  json["if_all_others_did_not"] = crossed / all;
  json["if_all_others_did"] = (crossed + all - static_cast<double>(paths.clean)) / all;
  return json;
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
    json["error_q"].push_back(coordinates_json(error, 0, run.start.q));
    json["error_p"].push_back(coordinates_json(error, half, run.start.q));
    json["deviation_q"].push_back(coordinates_json(deviation, 0, run.start.q));
    json["deviation_p"].push_back(coordinates_json(deviation, half, run.start.q));
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
      visit(record, i,
            fmt::format("{},{},{},{}", run.options.grid.at(run.options.records[record]), within / q.rows() + 1,
                        i < q.size() ? 'q' : 'p', "xyz"[within % q.rows()]));
    }
  }
}

}  // namespace

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
  const ensemble::PathCounts& paths = run.sums.paths;
  json["paths"] = {
      {"clean", paths.clean}, {"no_root", paths.no_root}, {"momentum_bound", paths.momentum_bound}, {"tie", paths.tie}};
  json["momentum_bound"] = run.options.momentum_bound;
  json["largest_momentum"] = run.sums.largest_momentum;
  json["momentum_error_max"] = run.sums.momentum_error;
  add_means(json, run);
  return formats::one_key_a_line(json);
}

std::string ensemble_means_csv(const EnsembleRun& run) {
  std::string text = "time,landmark,quantity,axis,mean,standard_error,standard_deviation,q05,q25,q50,q75,q95\n";
  for_each_coordinate(run, [&](std::size_t record, Eigen::Index i, const std::string& place) {
    const ensemble::Moments& moments = run.sums.moments[record];
    text += place;
    append_values(text, std::array{moments.mean[i], run.sums.mean_error(record)[i], std::sqrt(moments.variance()[i])});
    const auto& histograms = run.sums.histograms[record];
    for (const double probability : kQuantiles)
      text +=
          histograms.empty() ? "," : fmt::format(",{}", histograms[static_cast<std::size_t>(i)].quantile(probability));
    text += '\n';
  });
  return text;
}

std::string ensemble_densities_csv(const EnsembleRun& run) {
  std::string text = "time,landmark,quantity,axis,low,high,density\n";
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
      text += place;
      append_values(text, std::array{low, high, static_cast<double>(histogram.counts[bin]) / (total * (high - low))});
      text += '\n';
    }
  });
  return text;
}

namespace {

constexpr const char* kFormat = "pulson ensemble sums 1";

/// For a message: the beginning of long lists.
std::string excerpt(const formats::Json& json) {
  constexpr std::size_t kLongest = 60;
  const std::string text = json.dump();
  return text.size() <= kLongest ? text : text.substr(0, kLongest) + "…";
}

/// All on which the bits of the sums depend.
formats::Json identity_json(const EnsembleRun& run) {
  const ensemble::EnsembleOptions& o = run.options;
  return {{"version", version()},
          {"vector_target", vector_target()},
          {"kernel", run.system.kernel.spec()},
          {"noise", run.system.noise->spec()},
          {"integrator", run.integrator},
          {"q", formats::points_json(run.start.q)},
          {"p", formats::points_json(run.start.p)},
          {"groups", run.shape.groups},
          {"time", o.grid.time},
          {"steps", o.grid.steps},
          {"seed", o.seed},
          {"samples", o.samples},
          {"momentum_bound", o.momentum_bound},
          {"antithetic", o.antithetic},
          {"records", o.records},
          {"histograms", o.histograms},
          {"keep", static_cast<int>(o.keep)}};
}

/// A value that a checkpoint cannot have.
struct Damaged {};

/// What is counted: as another number it has no value, and sums of larger ones would overflow.
std::int64_t count_of(const formats::Json& json) {
  constexpr auto kMost = std::uint64_t{1} << 52U;
  if (!json.is_number_unsigned() || json.get<std::uint64_t>() > kMost) throw Damaged();
  return json.get<std::int64_t>();
}

formats::Json array_json(const Eigen::ArrayXd& x) { return std::vector<double>(x.begin(), x.end()); }

Eigen::ArrayXd array_of(const formats::Json& json) {
  const auto numbers = json.get<std::vector<double>>();
  return Eigen::Map<const Eigen::ArrayXd>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

formats::Json moments_json(const std::vector<ensemble::Moments>& moments) {
  formats::Json rows = formats::Json::array();
  for (const ensemble::Moments& m : moments) rows.push_back({m.count, array_json(m.mean), array_json(m.squares)});
  return rows;
}

std::vector<ensemble::Moments> moments_of(const formats::Json& json, std::int64_t samples) {
  std::vector<ensemble::Moments> moments;
  for (const formats::Json& row : json) {
    moments.push_back({count_of(row.at(0)), array_of(row.at(1)), array_of(row.at(2))});
    if (moments.back().count > samples) throw Damaged();
  }
  return moments;
}

formats::Json histograms_json(const std::vector<std::vector<ensemble::Histogram>>& histograms) {
  formats::Json records = formats::Json::array();
  for (const auto& record : histograms) {
    formats::Json rows = formats::Json::array();
    for (const ensemble::Histogram& h : record) rows.push_back({h.low, h.high, h.counts, h.smallest, h.largest});
    records.push_back(std::move(rows));
  }
  return records;
}

std::vector<std::uint64_t> bins_of(const formats::Json& json) {
  std::vector<std::uint64_t> bins;
  for (const formats::Json& count : json) bins.push_back(static_cast<std::uint64_t>(count_of(count)));
  return bins;
}

std::vector<std::vector<ensemble::Histogram>> histograms_of(const formats::Json& json) {
  std::vector<std::vector<ensemble::Histogram>> histograms;
  for (const formats::Json& rows : json) {
    histograms.emplace_back();
    for (const formats::Json& row : rows)
      histograms.back().push_back({row.at(0).get<double>(), row.at(1).get<double>(), bins_of(row.at(2)),
                                   row.at(3).get<double>(), row.at(4).get<double>()});
  }
  return histograms;
}

/// Goes through a binary text and stops where lists are nested deeper than those of a checkpoint: to make values of
/// them takes a stack as deep.
class DepthCheck : public nlohmann::json_sax<formats::Json> {
 public:
  bool null() override { return true; }
  bool boolean(bool /*value*/) override { return true; }
  bool number_integer(number_integer_t /*value*/) override { return true; }
  bool number_unsigned(number_unsigned_t /*value*/) override { return true; }
  bool number_float(number_float_t /*value*/, const string_t& /*text*/) override { return true; }
  bool string(string_t& /*value*/) override { return true; }
  bool binary(binary_t& /*value*/) override { return true; }
  bool key(string_t& /*value*/) override { return true; }
  bool start_object(std::size_t /*elements*/) override { return ++depth_ <= kDeepest; }
  bool start_array(std::size_t /*elements*/) override { return ++depth_ <= kDeepest; }
  bool end_object() override { return depth_-- > 0; }
  bool end_array() override { return depth_-- > 0; }
  bool parse_error(std::size_t /*place*/, const std::string& /*token*/, const nlohmann::json::exception&) override {
    return false;
  }

 private:
  static constexpr int kDeepest = 8;
  int depth_ = 0;
};

[[noreturn]] void fail_damaged(std::string_view name) {
  throw InputError(fmt::format("'{}' is damaged: it cannot be resumed; remove it and start again", name));
}

ensemble::EnsembleSums sums_of(const formats::Json& json) {
  ensemble::EnsembleSums sums;
  sums.samples = count_of(json.at("samples"));
  const formats::Json& paths = json.at("paths");
  sums.paths = {count_of(paths.at(0)), count_of(paths.at(1)), count_of(paths.at(2)), count_of(paths.at(3))};
  sums.crossing.at_end = count_of(json.at("crossed_at_end"));
  sums.crossing.ever = count_of(json.at("crossed_ever"));
  const formats::Json& pairs = json.at("crossed_pairs");
  sums.crossing.pairs = {count_of(pairs.at(0)), count_of(pairs.at(1)), count_of(pairs.at(2))};
  json.at("momentum_error").get_to(sums.momentum_error);
  json.at("largest_momentum").get_to(sums.largest_momentum);
  sums.moments = moments_of(json.at("moments"), sums.samples);
  sums.pair_moments = moments_of(json.at("pair_moments"), sums.samples);
  sums.histograms = histograms_of(json.at("histograms"));
  json.at("states").get_to(sums.states);
  return sums;
}

}  // namespace

std::string ensemble_checkpoint(const EnsembleRun& run) {
  const ensemble::EnsembleSums& sums = run.sums;
  formats::Json json;
  json["format"] = kFormat;
  json["identity"] = identity_json(run);
  json["samples"] = sums.samples;
  json["paths"] = {sums.paths.clean, sums.paths.no_root, sums.paths.momentum_bound, sums.paths.tie};
  json["crossed_at_end"] = sums.crossing.at_end;
  json["crossed_ever"] = sums.crossing.ever;
  json["crossed_pairs"] = sums.crossing.pairs;
  json["momentum_error"] = sums.momentum_error;
  json["largest_momentum"] = sums.largest_momentum;
  json["moments"] = moments_json(sums.moments);
  json["pair_moments"] = moments_json(sums.pair_moments);
  json["histograms"] = histograms_json(sums.histograms);
  json["states"] = sums.states;
  const std::vector<std::uint8_t> bytes = formats::Json::to_cbor(json);
  return {bytes.begin(), bytes.end()};
}

ensemble::EnsembleSums read_ensemble_checkpoint(const EnsembleRun& run, std::string_view bytes, std::string_view name) {
  DepthCheck check;
  if (!formats::Json::sax_parse(bytes.begin(), bytes.end(), &check, formats::Json::input_format_t::cbor))
    fail_damaged(name);
  try {
    const formats::Json json = formats::Json::from_cbor(bytes.begin(), bytes.end());
    if (json.at("format") != kFormat)
      throw InputError(fmt::format("'{}' was written by another version of pulson and cannot be resumed", name));
    const formats::Json expected = identity_json(run);
    const formats::Json& found = json.at("identity");
    for (const auto& [key, value] : expected.items())
      if (found.at(key) != value)
        throw InputError(fmt::format("'{}' holds another ensemble: its {} is {}, here it is {}", name, key,
                                     excerpt(found.at(key)), excerpt(value)));
    return sums_of(json);
  } catch (const formats::Json::exception&) {
    fail_damaged(name);
  } catch (const Damaged&) {
    fail_damaged(name);
  }
}

}  // namespace pulson::records
