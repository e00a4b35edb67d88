#include "document.hpp"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pulson/core/errors.hpp"

namespace pulson::view {
namespace {

using Json = nlohmann::json;

constexpr int kVersion = 2;
constexpr std::size_t kMostSpecimens = 20'000, kMostLandmarks = 5'000, kMostLinks = 20'000, kMostCharacters = 4'000;
constexpr double kMostPixels = 1 << 20;  // of a side, as images::read_pages has it

/// Reads the parts of a document; what is wrong with one names its place.
class DocumentReader {
 public:
  explicit DocumentReader(std::string name) : name_(std::move(name)) {}

  ViewDocument read(std::string_view text) const {
    const Json json = Json::parse(text, nullptr, false);
    if (json.is_discarded()) throw InputError(name_ + ": it is no JSON, or cut off");
    if (!json.is_object() || !json.contains("pulson_view"))
      throw InputError(name_ + ": it is no file of pulson view: the key 'pulson_view' is missing");
    if (const Json& version = json["pulson_view"]; !version.is_number_integer() || version != kVersion)
      throw InputError(
          fmt::format("{}: 'pulson_view' is {}; this program reads version {}", name_, version.dump(), kVersion));
    ViewDocument document;
    document.revision = whole(json, "revision", 0, std::int64_t{1} << 53);
    for (const Json& item : list(json, "landmarks", kMostLandmarks))
      document.landmarks.push_back({text_of(item, "name"), text_of(item, "group")});
    for (const Json& item : list(json, "specimens", kMostSpecimens))
      document.specimens.push_back(specimen(item, document.landmarks.size()));
    read_links(json, document);
    read_shown(json, document);
    document.opened = text_of(json, "opened");
    for (const Json& item : list(json, "exported", kMostSpecimens)) {
      if (!item.is_string()) fail("exported", "holds what is no text");
      document.exported.push_back(item.get<std::string>());
    }
    for (const Json& item : list(json, "shapes", kMostSpecimens)) read_shape(item, document);
    return document;
  }

  void require_shapes(const ViewDocument& document) const {
    for (const ViewSpecimen& specimen : document.specimens)
      if (!specimen.shape.empty() && !document.shapes.contains(specimen.shape))
        fail("shapes", fmt::format("lacks {}", specimen.shape));
  }

 private:
  [[noreturn]] void fail(std::string_view place, std::string_view problem) const {
    throw InputError(fmt::format("{}: '{}' {}", name_, place, problem));
  }

  Json list(const Json& json, const char* key, std::size_t most) const {
    if (!json.is_object() || !json.contains(key)) return Json::array();
    const Json& value = json[key];
    if (!value.is_array()) fail(key, "is no list");
    if (value.size() > most) fail(key, fmt::format("has {} entries, more than {}", value.size(), most));
    return value;
  }

  std::string text_of(const Json& json, const char* key) const {
    if (!json.is_object()) fail(key, "is looked for in what is no object");
    if (!json.contains(key) || json[key].is_null()) return {};
    if (!json[key].is_string()) fail(key, "is no text");
    auto text = json[key].get<std::string>();
    if (text.size() > kMostCharacters) fail(key, "is too long");
    return text;
  }

  std::int64_t whole(const Json& json, const char* key, std::int64_t least, std::int64_t most) const {
    if (!json.is_object() || !json.contains(key) || !json[key].is_number_integer()) fail(key, "is no whole number");
    const auto value = json[key].get<std::int64_t>();
    if (value < least || value > most) fail(key, fmt::format("is {}; it must be {} to {}", value, least, most));
    return value;
  }

  PlacedLandmark landmark(const Json& item) const {
    if (item.is_null()) return {};
    if (item.is_string() && item == "missing") return {Placement::kMissing};
    if (item.is_string() && item == "absent") return {Placement::kAbsent};
    if (!item.is_array() || item.size() != 2 || !item[0].is_number() || !item[1].is_number())
      fail("points", R"(holds what is no [x, y], null, "missing" or "absent")");
    const Eigen::Vector2d position(item[0].get<double>(), item[1].get<double>());
    if (!(position.cwiseAbs().maxCoeff() <= kMostPixels)) fail("points", "holds a position far beyond any picture");
    return {Placement::kPlaced, position};
  }

  std::vector<PlacedLandmark> landmarks(const Json& json, const char* key, std::size_t count) const {
    std::vector<PlacedLandmark> all;
    for (const Json& item : list(json, key, kMostLandmarks)) all.push_back(landmark(item));
    if (all.size() != count) fail(key, fmt::format("has {} entries for {} landmarks", all.size(), count));
    return all;
  }

  ViewSpecimen specimen(const Json& json, std::size_t count) const {
    ViewSpecimen specimen{text_of(json, "name"), text_of(json, "picture")};
    specimen.width = static_cast<int>(whole(json, "width", 1, static_cast<std::int64_t>(kMostPixels)));
    specimen.height = static_cast<int>(whole(json, "height", 1, static_cast<std::int64_t>(kMostPixels)));
    specimen.landmarks = landmarks(json, "points", count);
    if (json.contains("second") && !json["second"].is_null()) specimen.second_pass = landmarks(json, "second", count);
    specimen.shape = text_of(json, "shape");
    return specimen;
  }

  void read_links(const Json& json, ViewDocument& document) const {
    for (const Json& item : list(json, "links", kMostLinks)) {
      if (!item.is_array() || item.size() != 2 || !item[0].is_number_integer() || !item[1].is_number_integer())
        fail("links", "holds what is no pair of landmarks");
      const auto a = item[0].get<std::int64_t>(), b = item[1].get<std::int64_t>();
      const auto count = static_cast<std::int64_t>(document.landmarks.size());
      if (a < 0 || b < 0 || a >= count || b >= count || a == b)
        fail("links", "holds a pair that is none of two landmarks");
      document.links.emplace_back(static_cast<int>(a), static_cast<int>(b));
    }
  }

  void read_shown(const Json& json, ViewDocument& document) const {
    const Json shown = list(json, "shown", 2);
    for (std::size_t side = 0; side < shown.size(); ++side) {
      if (!shown[side].is_number_integer()) fail("shown", "holds what is no number of a specimen");
      const auto place = shown[side].get<std::int64_t>();
      if (place < 0 || place >= std::max<std::int64_t>(std::ssize(document.specimens), 2))
        fail("shown", "names a specimen that is not there");
      document.shown[side] = static_cast<int>(place);
    }
  }

  void read_shape(const Json& item, ViewDocument& document) const {
    OpenedShape opened = opened_of_json(item, name_);
    opened.shape.source = text_of(item, "address");
    document.shapes[opened.shape.source] = std::move(opened);
  }

  std::string name_;
};

Json json_of(const PlacedLandmark& landmark) {
  switch (landmark.placement) {
    case Placement::kNone:
      return nullptr;
    case Placement::kMissing:
      return "missing";
    case Placement::kAbsent:
      return "absent";
    case Placement::kPlaced:
      break;
  }
  return Json::array({landmark.position.x(), landmark.position.y()});
}

Json json_of(const std::vector<PlacedLandmark>& landmarks) {
  Json list = Json::array();
  for (const PlacedLandmark& landmark : landmarks) list.push_back(json_of(landmark));
  return list;
}

}  // namespace

ViewDocument document_of_json(const std::string& name, std::string_view text) {
  const DocumentReader reader(name);
  ViewDocument document = reader.read(text);
  reader.require_shapes(document);
  return document;
}

ViewDocument document_of_page(std::string_view text, const std::map<std::string, OpenedShape>& shapes) {
  const DocumentReader reader("the page");
  ViewDocument document = reader.read(text);
  document.shapes = shapes;
  reader.require_shapes(document);
  return document;
}

std::string json_of_document(const ViewDocument& document) {
  nlohmann::ordered_json json{{"pulson_view", kVersion}, {"revision", document.revision}};
  json["opened"] = document.opened;
  json["exported"] = document.exported;
  json["shown"] = document.shown;
  json["landmarks"] = Json::array();
  for (const ViewLandmark& landmark : document.landmarks)
    json["landmarks"].push_back({{"name", landmark.name}, {"group", landmark.group}});
  json["links"] = document.links;
  json["specimens"] = Json::array();
  for (const ViewSpecimen& specimen : document.specimens) {
    nlohmann::ordered_json item{{"name", specimen.name},     {"picture", specimen.picture},
                                {"shape", specimen.shape},   {"width", specimen.width},
                                {"height", specimen.height}, {"points", json_of(specimen.landmarks)}};
    if (!specimen.second_pass.empty()) item["second"] = json_of(specimen.second_pass);
    json["specimens"].push_back(std::move(item));
  }
  for (const auto& [address, opened] : document.shapes) {
    nlohmann::ordered_json item{{"address", address}};
    item.update(json_of_opened(opened));
    json["shapes"].push_back(std::move(item));
  }
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace pulson::view
