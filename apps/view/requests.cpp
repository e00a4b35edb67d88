#include "requests.hpp"

#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/paths.hpp"
#include "exporting.hpp"
#include "page_pictures.hpp"
#include "pulson/core/errors.hpp"
#include "shell/options.hpp"
#include "specimens.hpp"
#include "view/judgement.hpp"
#include "view/live_map.hpp"
#include "view/page_files.hpp"

namespace pulson {
namespace {

using PostedJson = nlohmann::json;
using view::Reply;

constexpr std::size_t kMostPosted = 32U << 20U, kMostPicture = 512U << 20U, kMostWords = 64U << 10U;
// Reports carry their scripts in themselves, and may be a stranger's: sandboxed, they reach nothing of this page.
constexpr const char* kPolicyOfReport =
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
constexpr Eigen::Index kMostPoints = 5'000;

Reply json_reply(const PostedJson& json, int status = 200) {
  return {status, "application/json", json.dump(-1, ' ', false, PostedJson::error_handler_t::replace)};
}

PostedJson object_of(const std::string& body) {
  PostedJson json = PostedJson::parse(body, nullptr, false);
  if (!json.is_object()) throw InputError("the request is no JSON object");
  return json;
}

// null, "missing" and "absent" are NaN.
Points posted_points(const PostedJson& json, const char* key) {
  if (!json.contains(key) || !json[key].is_array()) throw InputError(fmt::format("'{}' is no list", key));
  const PostedJson& list = json[key];
  if (std::ssize(list) > kMostPoints) throw InputError(fmt::format("'{}' is too long", key));
  Points points = Points::Constant(2, std::ssize(list), std::numeric_limits<double>::quiet_NaN());
  for (Eigen::Index a = 0; a < points.cols(); ++a) {
    const PostedJson& item = list[static_cast<std::size_t>(a)];
    if (item.is_null() || item.is_string()) continue;
    if (!item.is_array() || item.size() != 2 || !item[0].is_number() || !item[1].is_number())
      throw InputError(fmt::format("'{}' holds what is no [x, y]", key));
    points.col(a) << item[0].get<double>(), item[1].get<double>();
  }
  return points;
}

int whole_of(const PostedJson& json, const char* key, int least, int most) {
  if (!json.contains(key) || !json[key].is_number_integer()) throw InputError(fmt::format("'{}' is no number", key));
  const auto value = json[key].get<std::int64_t>();
  if (value < least || value > most) throw InputError(fmt::format("'{}' is {}", key, value));
  return static_cast<int>(value);
}

void require_one_count(const Points& left, const Points& right) {
  if (left.cols() != right.cols()) throw InputError("the two pictures have different numbers of landmarks");
}

PostedJson json_of(const view::Ellipse& ellipse) {
  const Eigen::Matrix2d& m = ellipse.shape;
  return {{"x", ellipse.centre.x()}, {"y", ellipse.centre.y()}, {"xx", m(0, 0)}, {"xy", m(0, 1)}, {"yy", m(1, 1)}};
}

// The page gets no shapes of files: it neither shows nor changes them.
PostedJson page_document(const view::SavedDocument& saved) {
  view::ViewDocument document = saved.document();
  document.shapes.clear();
  return PostedJson::parse(json_of_document(document));
}

}  // namespace

std::size_t PageRequests::most_bytes(std::string_view path) {
  if (path == "picture") return kMostPicture;
  if (path == "state" || path == "judge" || path == "match") return kMostPosted;
  return kMostWords;
}

Reply PageRequests::answer(const view::Request& request) {
  try {
    return request.method == "GET" ? get(request) : post(request);
  } catch (const InputError& error) {
    throw InputError(in_option_words(error.what()));
  }
}

Reply PageRequests::get(const view::Request& request) {
  if (request.path == "state") return state();
  if (request.path == "picture") return picture(request.query);
  if (request.path == "report.html" && !report_.empty())
    return {200, "text/html; charset=utf-8", read_file(report_), kPolicyOfReport};
  if (const view::PageFile* file = view::page_file(request.path))
    return {200, std::string(file->type), std::string(file->text)};
  return {403, "text/plain", "forbidden\n"};
}

Reply PageRequests::post(const view::Request& request) {
  if (request.path == "state") return save(request.body);
  if (request.path == "picture") return take_picture(request);
  if (request.path == "judge") return judge(request.body);
  if (request.path == "match") return match(request.body);
  if (request.path == "export") return write_export(request.body);
  if (request.path == "end") {
    is_over_ = true;
    return json_reply(PostedJson::object());
  }
  return {403, "text/plain", "forbidden\n"};
}

Reply PageRequests::state() const {
  return json_reply({{"file", document_.path().filename().string()},
                     {"export", export_name(document_, arguments_.in_place)},
                     {"report", !report_.empty()},
                     {"document", page_document(document_)}});
}

Reply PageRequests::picture(const std::string& number) const {
  const view::ViewDocument document = document_.document();
  std::size_t i = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), i);
  if (error != std::errc() || end != number.data() + number.size() || i >= document.specimens.size() ||
      document.specimens[i].picture.empty())
    return view::error_reply(404, "there is no such picture");
  ShownPicture shown =
      shown_picture((document_.folder() / document.specimens[i].picture).string(), arguments_.max_pixels);
  return {200, shown.type, std::move(shown.bytes)};
}

// Of pictures only those that the program named itself are shown: the page may not name files.
Reply PageRequests::save(const std::string& body) {
  PostedJson json = object_of(body);
  const std::int64_t base = json.value("base", std::int64_t{-1});
  if (!json.contains("document")) throw InputError("'document' is missing");
  const view::ViewDocument before = document_.document();
  view::ViewDocument next = view::document_of_page(json["document"].dump(), before.shapes);
  next.opened = before.opened;
  next.exported = before.exported;
  for (const view::ViewSpecimen& specimen : next.specimens) {
    const auto is_known = [&](const view::ViewSpecimen& known) { return known.picture == specimen.picture; };
    if (std::none_of(before.specimens.begin(), before.specimens.end(), is_known))
      throw InputError("the page names a picture that was not opened");
  }
  try {
    if (document_.replace(std::move(next), base) == view::SavedDocument::Outcome::kConflict)
      return json_reply({{"error", "another window changed this session"}, {"document", page_document(document_)}},
                        409);
  } catch (const InputError& error) {
    return view::error_reply(507, error.what());
  }
  return json_reply({{"revision", document_.document().revision}});
}

Reply PageRequests::take_picture(const view::Request& request) {
  const std::string name =
      keep_picture(document_.folder().string(), request.query, request.body, arguments_.max_pixels);
  const std::string path = (document_.folder() / name).string();
  const PagePicture picture = page_picture(path, read_picture(path, arguments_.max_pixels));
  document_.change([&](view::ViewDocument& document) {
    view::ViewSpecimen specimen{std::filesystem::path(name).stem().string(), name, picture.width, picture.height};
    specimen.landmarks.resize(document.landmarks.size());
    for (const view::ViewSpecimen& known : document.specimens)
      if (known.picture == name) return;
    document.specimens.push_back(std::move(specimen));
  });
  return state();
}

Reply PageRequests::judge(const std::string& body) {
  const PostedJson json = object_of(body);
  const Points left = posted_points(json, "left"), right = posted_points(json, "right");
  require_one_count(left, right);
  std::optional<int> wanted;
  if (json.contains("wanted") && !json["wanted"].is_null() && left.cols() > 0)
    wanted = whole_of(json, "wanted", 0, static_cast<int>(left.cols()) - 1);
  const std::lock_guard lock(judging_);
  const view::Judgement judgement = view::judge_placement(left, right, wanted);
  PostedJson reply{{"proposal", nullptr}, {"doubtful", PostedJson::array()}, {"exchanged", PostedJson::array()}};
  if (judgement.proposal) reply["proposal"] = json_of(*judgement.proposal);
  for (const view::DoubtfulLandmark& doubtful : judgement.doubtful)
    reply["doubtful"].push_back({{"landmark", doubtful.landmark}, {"expected", json_of(doubtful.expected)}});
  for (const view::Exchange& pair : judgement.exchanged) reply["exchanged"].push_back({pair.a, pair.b});
  reply["findings"] = judgement.findings;
  return json_reply(reply);
}

Reply PageRequests::match(const std::string& body) {
  const PostedJson json = object_of(body);
  const Points left = posted_points(json, "left"), right = posted_points(json, "right");
  require_one_count(left, right);
  view::LiveMapOptions options;
  options.columns = whole_of(json, "columns", 2, 400);
  options.rows = whole_of(json, "rows", 2, 400);
  if (json.contains("noise")) {
    if (!json["noise"].is_string()) throw InputError("'noise' is no text");
    options.noise = json["noise"].get<std::string>();
  }
  const int width = whole_of(json, "width", 1, 1 << 20), height = whole_of(json, "height", 1, 1 << 20);
  const bool follows = json.contains("follow") && json["follow"] == true;
  if (follows || json.contains("linear")) ++quick_requests_;
  if (json.contains("linear")) {
    if (!json["linear"].is_string() || !json.contains("ridge") || !json["ridge"].is_number())
      throw InputError("'linear' and 'ridge' are no kernel and its ridge");
    return {200, "application/octet-stream",
            bytes_of(view::linear_map(left, right, width, height, options, json["linear"].get<std::string>(),
                                      json["ridge"].get<double>()),
                     options)};
  }
  const std::lock_guard lock(matching_);
  const int before = quick_requests_;
  try {
    const view::LiveMap map =
        follows && can_follow(near_, left, right, options)
            ? followed_map(left, right, width, height, options, near_)
            : live_map(left, right, width, height, options, [&] { return !follows && quick_requests_ != before; });
    near_ = map.near;
    return {200, "application/octet-stream", bytes_of(map, options)};
  } catch (const view::Superseded&) {
    return {204, "application/octet-stream"};  // a move of a landmark came first: no error
  }
}

Reply PageRequests::write_export(const std::string& body) {
  const PostedJson json = object_of(body);
  if (!json.contains("name") || !json["name"].is_string()) throw InputError("'name' is no text");
  const ExportResult result = export_landmarks(document_, json["name"].get<std::string>(), arguments_.in_place);
  return json_reply({{"file", result.file},
                     {"kept", result.kept},
                     {"losses", in_option_words(result.losses)},
                     {"shapes", result.shapes},
                     {"document", page_document(document_)}});
}

}  // namespace pulson
