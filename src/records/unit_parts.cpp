#include "unit_parts.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "checked_cbor.hpp"
#include "formats/frame_text.hpp"
#include "formats/json/json_reader.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/version.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "shards.hpp"

namespace pulson::records {

namespace {

using formats::Json;

constexpr const char* kUnitFormat = "pulson units 3";
constexpr int kMostUnits = 100'000'000;

Json matrices_json(const std::vector<Points>& matrices) {
  Json list = Json::array();
  for (const Points& points : matrices) list.push_back(formats::points_json(points));
  return list;
}

Points points_from(const Json& json, Eigen::Index dimension) {
  Points points(dimension, static_cast<Eigen::Index>(json.size()));
  for (Eigen::Index a = 0; a < points.cols(); ++a) {
    const Json& point = json.at(static_cast<std::size_t>(a));
    if (static_cast<Eigen::Index>(point.size()) != dimension) throw Damaged();
    for (Eigen::Index i = 0; i < dimension; ++i) points(i, a) = point.at(static_cast<std::size_t>(i)).get<double>();
  }
  return points;
}

std::vector<Points> matrices_from(const Json& json, Eigen::Index dimension) {
  std::vector<Points> matrices;
  for (const Json& points : json) matrices.push_back(points_from(points, dimension));
  return matrices;
}

Json shape_identity(const Landmarks& shape) {
  Json json{{"dimension", shape.dimension()},
            {"points", formats::points_json(shape.points)},
            {"labels", shape.labels},
            {"groups", shape.groups},
            {"name", shape.name},
            {"image", shape.image},
            {"properties", shape.properties},
            {"curves", matrices_json(shape.curves)},
            {"outlines", matrices_json(shape.outlines)},
            {"numbers", shape.numbers},
            {"absent", shape.absent},
            {"links", shape.links},
            {"units", shape.units},
            {"axes", shape.axes},
            {"frame", formats::frame_json(shape.frame)},
            {"source", shape.source}};
  if (shape.scale) json["scale"] = *shape.scale;
  return json;
}

Frame frame_from(const Json& json) try { return formats::frame_of_json(json); } catch (const InputError&) {
  throw Damaged();
}

Landmarks shape_from(const Json& json) {
  const int dimension = json.at("dimension").get<int>();
  if (dimension < 1 || dimension > 3) throw Damaged();
  Landmarks shape;
  shape.points = points_from(json.at("points"), dimension);
  json.at("labels").get_to(shape.labels);
  json.at("groups").get_to(shape.groups);
  json.at("name").get_to(shape.name);
  json.at("image").get_to(shape.image);
  json.at("properties").get_to(shape.properties);
  shape.curves = matrices_from(json.at("curves"), dimension);
  shape.outlines = matrices_from(json.at("outlines"), dimension);
  json.at("numbers").get_to(shape.numbers);
  json.at("absent").get_to(shape.absent);
  for (const int a : shape.absent)
    if (a < 0 || a >= shape.count() || !shape.points.col(a).hasNaN()) throw Damaged();
  json.at("links").get_to(shape.links);
  for (const auto& [a, b] : shape.links)
    if (std::min(a, b) < 0 || std::max(a, b) >= shape.count()) throw Damaged();
  json.at("units").get_to(shape.units);
  json.at("axes").get_to(shape.axes);
  shape.frame = frame_from(json.at("frame"));
  json.at("source").get_to(shape.source);
  if (json.contains("scale")) shape.scale = json.at("scale").get<double>();
  const auto fits = [&](std::size_t size) { return size == 0 || size == static_cast<std::size_t>(shape.count()); };
  if (!fits(shape.labels.size()) || !fits(shape.groups.size()) || !fits(shape.numbers.size())) throw Damaged();
  return shape;
}

int whole_number(const Json& json, int least, int most) {
  if (!json.is_number_unsigned() || json.get<std::uint64_t>() > static_cast<std::uint64_t>(most)) throw Damaged();
  const int number = json.get<int>();
  if (number < least) throw Damaged();
  return number;
}

/// All on which the bits of the results depend, in the order in which differences are named.
Json unit_identity(const UnitRun& run) {
  Json shapes = Json::array();
  for (const Landmarks& shape : run.shapes) shapes.push_back(shape_identity(shape));
  return {{"version", version()}, {"vector_target", vector_target()},
          {"verb", run.verb},     {"settings", run.settings},
          {"shapes", shapes},     {"facts", run.facts},
          {"units", run.units},   {"shards", run.shard.count}};
}

/// Of the lines that differ, the first of each: `seed = 2`.
std::pair<std::string, std::string> first_difference(const std::string& a, const std::string& b) {
  std::istringstream lines_a(a), lines_b(b);
  for (std::string line_a, line_b;;) {
    const bool has_a = static_cast<bool>(std::getline(lines_a, line_a));
    const bool has_b = static_cast<bool>(std::getline(lines_b, line_b));
    if (!has_a) line_a.clear();
    if (!has_b) line_b.clear();
    if (line_a != line_b || (!has_a && !has_b)) return {line_a, line_b};
  }
}

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

/// What differs, for a message; empty where nothing does.
/// Where one of the other is not equal. @param where that other is: `there`
std::string difference(const Json& one, const Json& other, std::string_view where) {
  for (const auto& [key, value] : other.items()) {
    if (Json::to_cbor(one.at(key)) == Json::to_cbor(value)) continue;  // NaN are equal, too
    if (key == "shapes" || key == "facts") return fmt::format("its {} are others", key);
    auto [own, expected] = key == "settings"
                               ? first_difference(one.at(key).get<std::string>(), value.get<std::string>())
                               : std::pair(fmt::format("{} {}", key, text_of(one.at(key))), text_of(value));
    const auto or_nothing = [](const std::string& text) { return text.empty() ? std::string("nothing") : text; };
    return fmt::format("it has {}, {} it is {}", or_nothing(own), where, or_nothing(expected));
  }
  return {};
}

UnitRun unit_run_of(const Json& json) {
  UnitRun run;
  const Json& identity = json.at("identity");
  identity.at("verb").get_to(run.verb);
  identity.at("settings").get_to(run.settings);
  for (const Json& shape : identity.at("shapes")) run.shapes.push_back(shape_from(shape));
  run.facts = identity.at("facts");
  json.at("notes").get_to(run.notes);
  run.units = whole_number(identity.at("units"), 1, kMostUnits);
  run.shard.count = whole_number(identity.at("shards"), 1, run.units);
  run.shard.index = whole_number(json.at("shard"), 1, run.shard.count);
  run.threads = whole_number(json.at("threads"), 1, std::numeric_limits<int>::max());
  run.seconds = json.at("seconds").get<double>();
  for (const Json& row : json.at("results")) {
    const int unit = whole_number(row.at(0), 0, run.units - 1);
    if (unit % run.shard.count != run.shard.index - 1) throw Damaged();
    run.results.emplace(unit, row.at(1));
  }
  return run;
}

}  // namespace

std::vector<int> UnitRun::own_units() const {
  std::vector<int> own;
  for (int unit = shard.index - 1; unit < units; unit += shard.count) own.push_back(unit);
  return own;
}

std::string unit_part(const UnitRun& run) {
  Json results = Json::array();
  for (const auto& [unit, result] : run.results) results.push_back({unit, result});
  const Json json{{"format", kUnitFormat},        {"identity", unit_identity(run)}, {"shard", run.shard.index},
                  {"notes", run.notes},           {"threads", run.threads},         {"seconds", run.seconds},
                  {"results", std::move(results)}};
  return sealed_cbor(json);
}

std::string unit_fingerprint(const UnitRun& run) {
  Json identity = unit_identity(run);
  identity.erase("shards");
  const std::vector<std::uint8_t> bytes = Json::to_cbor(identity);
  return crc32_text({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

bool is_unit_part(std::string_view bytes) {
  return bytes.substr(0, 64).find(std::string_view(kUnitFormat).substr(0, 12)) != std::string_view::npos;
}

UnitRun read_unit_part(std::string_view bytes, std::string_view name) {
  constexpr int kDeepest = 24;
  try {
    const Json json = checked_cbor(bytes, kDeepest);
    const Json& identity = json.at("identity");
    if (json.at("format") != kUnitFormat || identity.at("version") != version() ||
        identity.at("vector_target") != vector_target())
      throw InputError(fmt::format(
          "'{}' was written by another version of pulson or with other vector instructions, whose bits differ", name));
    return unit_run_of(json);
  } catch (const Json::exception&) {
  } catch (const Damaged&) {
  }
  throw InputError(fmt::format(
      "'{}' is damaged, or of another version of pulson: it cannot be used; remove it and start again", name));
}

void resume_units(UnitRun& run, UnitRun part, std::string_view name) {
  if (const std::string text = difference(unit_identity(part), unit_identity(run), "here"); !text.empty())
    throw InputError(fmt::format("'{}' is of another run than this: {}", name, text));
  if (part.shard.index != run.shard.index)
    throw InputError(fmt::format("'{}' is part {} of {}, and this is part {}", name, part.shard.index, part.shard.count,
                                 run.shard.index));
  run.results = std::move(part.results);
  run.seconds = part.seconds;
}

UnitRun merge_units(std::vector<UnitRun> parts, const std::vector<std::string>& names) {
  std::vector<ShardState> states;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (const std::string text = difference(unit_identity(parts[i]), unit_identity(parts.front()), "there");
        !text.empty())
      throw InputError(fmt::format("'{}' is part of another run than '{}': {}", names[i], names.front(), text));
    states.push_back(
        {names[i], parts[i].shard, std::ssize(parts[i].results), std::ssize(parts[i].own_units()), "units"});
  }
  const std::vector<std::size_t> order = shards_in_order(states);
  UnitRun run = std::move(parts[order.front()]);
  for (std::size_t k = 1; k < order.size(); ++k) {
    UnitRun& part = parts[order[k]];
    run.results.merge(part.results);
    run.threads = std::max(run.threads, part.threads);
    run.seconds += part.seconds;
  }
  run.shard = {};
  return run;
}

}  // namespace pulson::records
