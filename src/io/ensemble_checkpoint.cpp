#include <array>
#include <cstdint>

#include <fmt/format.h>

#include "json_text.hpp"
#include "pulson/core/version.hpp"
#include "pulson/io/ensemble_record.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {
namespace {

constexpr const char* kFormat = "pulson ensemble sums 1";

/// For a message: the beginning of long lists.
std::string excerpt(const Json& json) {
  constexpr std::size_t kLongest = 60;
  const std::string text = json.dump();
  return text.size() <= kLongest ? text : text.substr(0, kLongest) + "…";
}

/// All on which the bits of the sums depend.
Json identity_json(const EnsembleRun& run) {
  const EnsembleOptions& o = run.options;
  return {{"version", version()},
          {"vector_target", vector_target()},
          {"kernel", run.system.kernel.spec()},
          {"noise", run.system.noise->spec()},
          {"integrator", run.integrator},
          {"q", points_json(run.start.q)},
          {"p", points_json(run.start.p)},
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

Json array_json(const Eigen::ArrayXd& x) { return std::vector<double>(x.begin(), x.end()); }

Eigen::ArrayXd array_of(const Json& json) {
  const auto numbers = json.get<std::vector<double>>();
  return Eigen::Map<const Eigen::ArrayXd>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

Json moments_json(const std::vector<Moments>& moments) {
  Json rows = Json::array();
  for (const Moments& m : moments) rows.push_back({m.count, array_json(m.mean), array_json(m.squares)});
  return rows;
}

std::vector<Moments> moments_of(const Json& json) {
  std::vector<Moments> moments;
  for (const Json& row : json)
    moments.push_back({row.at(0).get<std::int64_t>(), array_of(row.at(1)), array_of(row.at(2))});
  return moments;
}

Json histograms_json(const std::vector<std::vector<Histogram>>& histograms) {
  Json records = Json::array();
  for (const auto& record : histograms) {
    Json rows = Json::array();
    for (const Histogram& h : record) rows.push_back({h.low, h.high, h.counts, h.smallest, h.largest});
    records.push_back(std::move(rows));
  }
  return records;
}

std::vector<std::vector<Histogram>> histograms_of(const Json& json) {
  std::vector<std::vector<Histogram>> histograms;
  for (const Json& rows : json) {
    histograms.emplace_back();
    for (const Json& row : rows)
      histograms.back().push_back({row.at(0).get<double>(), row.at(1).get<double>(),
                                   row.at(2).get<std::vector<std::uint64_t>>(), row.at(3).get<double>(),
                                   row.at(4).get<double>()});
  }
  return histograms;
}

EnsembleSums sums_of(const Json& json) {
  EnsembleSums sums;
  json.at("samples").get_to(sums.samples);
  const auto paths = json.at("paths").get<std::array<std::int64_t, 4>>();
  sums.paths = {paths[0], paths[1], paths[2], paths[3]};
  json.at("crossed_at_end").get_to(sums.crossing.at_end);
  json.at("crossed_ever").get_to(sums.crossing.ever);
  json.at("crossed_pairs").get_to(sums.crossing.pairs);
  json.at("momentum_error").get_to(sums.momentum_error);
  json.at("largest_momentum").get_to(sums.largest_momentum);
  sums.moments = moments_of(json.at("moments"));
  sums.pair_moments = moments_of(json.at("pair_moments"));
  sums.histograms = histograms_of(json.at("histograms"));
  json.at("states").get_to(sums.states);
  return sums;
}

}  // namespace

std::string ensemble_checkpoint(const EnsembleRun& run) {
  const EnsembleSums& sums = run.sums;
  Json json;
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
  const std::vector<std::uint8_t> bytes = Json::to_cbor(json);
  return {bytes.begin(), bytes.end()};
}

EnsembleSums read_ensemble_checkpoint(const EnsembleRun& run, std::string_view bytes, std::string_view name) {
  try {
    const Json json = Json::from_cbor(bytes.begin(), bytes.end());
    if (json.at("format") != kFormat)
      throw InputError(fmt::format("'{}' was written by another version of pulson and cannot be resumed", name));
    const Json expected = identity_json(run);
    const Json& found = json.at("identity");
    for (const auto& [key, value] : expected.items())
      if (found.at(key) != value)
        throw InputError(fmt::format("'{}' holds another ensemble: its {} is {}, here it is {}", name, key,
                                     excerpt(found.at(key)), excerpt(value)));
    return sums_of(json);
  } catch (const Json::exception&) {
    throw InputError(fmt::format("'{}' is damaged: it cannot be resumed; remove it and start again", name));
  }
}

}  // namespace pulson
