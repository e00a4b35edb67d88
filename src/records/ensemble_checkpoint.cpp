// The sums of an ensemble in a file: to go on from, and to be merged with those of other shards.

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "checked_cbor.hpp"
#include "formats/formats.hpp"
#include "formats/frame_text.hpp"
#include "formats/json/json_reader.hpp"
#include "pulson/core/version.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/records/records.hpp"
#include "shards.hpp"

namespace pulson::records {

namespace {

constexpr const char* kFormat = "pulson ensemble sums 4";

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
          {"keep", static_cast<int>(o.keep)},
          {"shards", o.shard.count}};
}

std::string shape_text(const Landmarks& shape) {
  formats::LandmarkFile file;
  file.shapes = {shape};
  return formats::json_format().write("", file).text;
}

/// What is counted: as another number it has no value, and sums of larger ones would overflow.
std::int64_t count_of(const formats::Json& json) {
  constexpr auto kMost = std::uint64_t{1} << 52U;
  if (!json.is_number_unsigned() || json.get<std::uint64_t>() > kMost) throw Damaged();
  return json.get<std::int64_t>();
}

[[noreturn]] void fail_damaged(std::string_view name) {
  throw InputError(fmt::format(
      "'{}' is damaged, or of another version of pulson: it cannot be resumed; remove it and start again", name));
}

ensemble::EnsembleSums sums_of(const formats::Json& json) {
  const auto& binary = json.at("sums").get_binary();
  ensemble::EnsembleSums sums;
  try {
    sums = ensemble::sums_of_bytes({reinterpret_cast<const char*>(binary.data()), binary.size()});
  } catch (const InputError&) {
    throw Damaged();
  }
  const ensemble::MomentNode total = sums.tree.total();
  sums.moments = total.moments;
  sums.pair_moments = total.pair_moments;
  if (sums.tree.nodes().empty()) {
    const formats::Json& identity = json.at("identity");
    sums.moments.resize(identity.at("records").size());
    if (identity.at("antithetic").get<bool>()) sums.pair_moments = sums.moments;
  }
  return sums;
}

}  // namespace

std::string ensemble_checkpoint(const EnsembleRun& run) {
  formats::Json json;
  json["format"] = kFormat;
  json["identity"] = identity_json(run);
  json["shard"] = run.options.shard.index;
  json["shape"] = shape_text(run.shape);
  json["frame"] = formats::frame_json(run.shape.frame);
  json["source"] = run.shape.source;
  json["numbers"] = run.shape.numbers;
  json["densities"] = run.densities;
  json["method"] = run.method;
  json["threads"] = run.threads;
  json["seconds"] = run.seconds;
  json["notes"] = run.notes;
  const std::string sums = ensemble::bytes_of(run.sums);
  json["sums"] = formats::Json::binary({sums.begin(), sums.end()});
  return sealed_cbor(json);
}

std::string ensemble_fingerprint(const EnsembleRun& run) { return crc32_text(identity_json(run).dump()); }

namespace {

/// Of a checkpoint: what `read` makes of it, or a word on what is wrong.
template <class Read>
auto read_checkpoint(std::string_view bytes, std::string_view name, const Read& read) {
  constexpr int kDeepest = 8;
  try {
    const formats::Json json = checked_cbor(bytes, kDeepest);
    if (json.at("format") != kFormat)
      throw InputError(fmt::format("'{}' was written by another version of pulson and cannot be resumed", name));
    return read(json);
  } catch (const formats::Json::exception&) {
    fail_damaged(name);
  } catch (const Damaged&) {
    fail_damaged(name);
  }
}

Points points_of(const formats::Json& json) {
  if (json.empty()) throw Damaged();
  Points points(static_cast<Eigen::Index>(json.at(0).size()), static_cast<Eigen::Index>(json.size()));
  for (Eigen::Index a = 0; a < points.cols(); ++a) {
    const auto point = json.at(static_cast<std::size_t>(a)).get<std::vector<double>>();
    if (std::ssize(point) != points.rows()) throw Damaged();
    points.col(a) = Eigen::Map<const Eigen::VectorXd>(point.data(), points.rows());
  }
  return points;
}

int int_of(const formats::Json& json) {
  const std::int64_t count = count_of(json);
  if (count > std::numeric_limits<int>::max()) throw Damaged();
  return static_cast<int>(count);
}

EnsembleRun run_of(const formats::Json& json, std::string_view name) {
  const formats::Json& identity = json.at("identity");
  Landmarks shape = formats::json_format().read(std::string(name), json.at("shape").get<std::string>()).shapes.at(0);
  shape.frame = formats::frame_of_json(json.at("frame"));
  json.at("source").get_to(shape.source);
  json.at("numbers").get_to(shape.numbers);
  const PhaseState start{points_of(identity.at("q")), points_of(identity.at("p"))};
  const auto kernel = identity.at("kernel").get<std::string>();
  ensemble::EnsembleOptions options;
  options.grid = {identity.at("time").get<double>(), int_of(identity.at("steps"))};
  options.seed = identity.at("seed").get<std::uint64_t>();
  options.samples = count_of(identity.at("samples"));
  options.momentum_bound = identity.at("momentum_bound").get<double>();
  options.antithetic = identity.at("antithetic").get<bool>();
  identity.at("records").get_to(options.records);
  identity.at("histograms").get_to(options.histograms);
  const int keep = int_of(identity.at("keep"));
  if (keep > static_cast<int>(ensemble::KeepStates::kAll)) throw Damaged();
  options.keep = static_cast<ensemble::KeepStates>(keep);
  options.shard = {int_of(json.at("shard")), int_of(identity.at("shards"))};
  StochasticSystem system{make_kernel(kernel), make_noise(identity.at("noise").get<std::string>(), shape)};
  EnsembleRun run{std::move(system),
                  identity.at("integrator").get<std::string>(),
                  std::move(shape),
                  start,
                  options,
                  json.at("densities").get<std::vector<int>>(),
                  sums_of(json),
                  json.at("method").get<std::string>(),
                  int_of(json.at("threads")),
                  json.at("seconds").get<double>(),
                  json.at("notes").get<std::vector<std::string>>()};
  // Whether all of it fits together is for the ensemble to say.
  ensemble::Ensemble(run.system, run.integrator, run.start, run.options).resume(run.sums);
  return run;
}

void check_same(const EnsembleRun& expected, const std::string& expected_name, const EnsembleRun& part,
                const std::string& name) {
  const formats::Json a = identity_json(expected);
  const formats::Json b = identity_json(part);
  for (const auto& [key, value] : a.items())
    if (b.at(key) != value)
      throw InputError(fmt::format("'{}' is part of another ensemble than '{}': its {} is {}, there it is {}", name,
                                   expected_name, key, excerpt(b.at(key)), excerpt(value)));
}

}  // namespace

ensemble::EnsembleSums read_ensemble_checkpoint(const EnsembleRun& run, std::string_view bytes, std::string_view name) {
  return read_checkpoint(bytes, name, [&](const formats::Json& json) {
    formats::Json expected = identity_json(run);
    formats::Json found = json.at("identity");
    expected["shard"] = run.options.shard.index;
    found["shard"] = json.at("shard");
    for (const auto& [key, value] : expected.items())
      if (found.at(key) != value)
        throw InputError(fmt::format("'{}' holds another ensemble: its {} is {}, here it is {}", name, key,
                                     excerpt(found.at(key)), excerpt(value)));
    return sums_of(json);
  });
}

EnsembleRun read_ensemble_part(std::string_view bytes, std::string_view name) {
  return read_checkpoint(bytes, name, [&](const formats::Json& json) { return run_of(json, name); });
}

EnsembleRun merge_ensembles(std::vector<EnsembleRun> parts, const std::vector<std::string>& names) {
  std::vector<ShardState> states;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    check_same(parts.front(), names.front(), parts[i], names[i]);
    const ensemble::EnsembleOptions& options = parts[i].options;
    states.push_back({names[i], options.shard, parts[i].sums.samples, options.shard_samples(), "paths"});
  }
  const std::vector<std::size_t> order = shards_in_order(states);
  EnsembleRun run = std::move(parts[order.front()]);
  for (std::size_t k = 1; k < order.size(); ++k) {
    const EnsembleRun& part = parts[order[k]];
    run.sums.append(part.sums);
    run.threads = std::max(run.threads, part.threads);
    run.seconds += part.seconds;
  }
  run.options.shard = {};
  return run;
}

}  // namespace pulson::records
