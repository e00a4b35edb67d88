#include "frame_text.hpp"

#include <cmath>

#include <fmt/format.h>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::formats {
namespace {

constexpr std::string_view kFrameExample = "as in '# frame: y=up unit=0.02 origin=0,0 size=640x480'";

/// Two numbers, or one for both.
std::optional<std::array<double, 2>> pair_of(std::string_view text, char between) {
  const std::size_t at = text.find(between);
  try {
    const double first = parse_number(text.substr(0, at), "");
    return std::array{first, at == std::string_view::npos ? first : parse_number(text.substr(at + 1), "")};
  } catch (const InputError&) {
    return std::nullopt;
  }
}

bool is_size(double pixels) { return pixels >= 1 && pixels <= 1e9 && pixels == std::floor(pixels); }

/// Sets what one word `key=value` says. @return whether it says something
bool set_part(Frame& frame, std::string_view word) {
  const std::size_t equals = word.find('=');
  if (equals == std::string_view::npos) return false;
  const std::string_view key = word.substr(0, equals), value = word.substr(equals + 1);
  if (key == "y") {
    frame.y_down = value == "down";
    return value == "down" || value == "up";
  }
  if (key == "orientation") {
    frame.orientation = value == "displayed" ? Orientation::kDisplayed : Orientation::kStored;
    return value == "displayed" || value == "stored";
  }
  const char between = key == "size" ? 'x' : ',';
  const auto numbers = pair_of(value, between);
  if (!numbers || (key != "unit" && value.find(between) == std::string_view::npos)) return false;
  const auto [x, y] = *numbers;
  if (key == "size") {
    if (!is_size(x) || !is_size(y)) return false;
    frame.width = static_cast<int>(x);
    frame.height = static_cast<int>(y);
    return true;
  }
  frame.says_units = true;
  if (key == "origin") {
    frame.origin = *numbers;
    return true;
  }
  frame.unit_per_pixel = *numbers;
  return key == "unit" && x > 0 && y > 0;
}

Frame frame_of_words(const std::string& path, std::size_t line, std::string_view text) {
  Frame frame;
  for (const std::string_view word : text::split_words(text)) {
    if (!set_part(frame, word))
      text::fail(path, line, fmt::format("{} is no part of a frame, {}", text::in_quotes(word), kFrameExample));
    frame.says_y = frame.says_y || word.starts_with("y=");
  }
  return frame;
}

}  // namespace

std::string frame_text(const Frame& frame) {
  std::string text;
  const auto add = [&](const std::string& part) { text += (text.empty() ? "" : " ") + part; };
  if (!frame.y_down && frame.says_y) add("y=up");
  const auto [unit_x, unit_y] = frame.unit_per_pixel;
  if (unit_x != unit_y)
    add(fmt::format("unit={},{}", unit_x, unit_y));
  else if (unit_x != 1)
    add(fmt::format("unit={}", unit_x));
  if (frame.origin != std::array{0.0, 0.0}) add(fmt::format("origin={},{}", frame.origin[0], frame.origin[1]));
  if (frame.width > 0 && frame.height > 0) add(fmt::format("size={}x{}", frame.width, frame.height));
  if (frame.orientation == Orientation::kDisplayed) add("orientation=displayed");
  if (!text.empty() && frame.y_down && frame.says_y) text = "y=down " + text;
  return text;
}

namespace {

// A line that is a comment `# frame: …` among the comments that a table begins with.
struct FrameLine {
  std::size_t number = 0;       // from 1
  std::string_view line, text;  // all of it, and what follows `frame:`
};

std::optional<FrameLine> find_frame_line(std::string_view text) {
  const char end = text::line_end_of(text);
  text = text::without_byte_order_mark(text);
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view whole = text::take_line(text, end);
    std::string_view line = text::trim(whole);
    if (line.empty()) continue;
    if (!line.starts_with('#')) return std::nullopt;
    line = text::trim(line.substr(1));
    if (line.starts_with(kFrameComment)) return FrameLine{number, whole, line.substr(kFrameComment.size())};
  }
  return std::nullopt;
}

}  // namespace

std::optional<Frame> frame_in_comments(const std::string& path, std::string_view text) {
  const std::optional<FrameLine> found = find_frame_line(text);
  if (!found) return std::nullopt;
  return frame_of_words(path, found->number, found->text);
}

std::string with_frame_comment(std::string text, const Frame& frame) {
  const std::optional<FrameLine> found = find_frame_line(text);
  if (!found) return text;
  const auto begin = static_cast<std::size_t>(found->line.data() - text.data());
  const std::string said = frame_text(frame);
  return text.replace(begin, found->line.size(),
                      fmt::format("# {}{}{}", kFrameComment, said.empty() ? " y=down" : " ", said));
}

Json frame_json(const Frame& frame) {
  Json json;
  if (frame.unit_per_pixel[0] == frame.unit_per_pixel[1])
    json["unit_per_pixel"] = frame.unit_per_pixel[0];
  else
    json["unit_per_pixel"] = frame.unit_per_pixel;
  json["origin"] = frame.origin;
  json["y_down"] = frame.y_down;
  json["orientation"] = frame.orientation == Orientation::kDisplayed ? "displayed" : "stored";
  json["width"] = frame.width > 0 ? Json(frame.width) : Json(nullptr);
  json["height"] = frame.height > 0 ? Json(frame.height) : Json(nullptr);
  json["stated"] = {{"y", frame.says_y}, {"units", frame.says_units}};
  return json;
}

namespace {

std::array<double, 2> pair_in(const JsonValue& json) {
  if (json.value().is_number()) return {json.number(), json.number()};
  const Eigen::VectorXd numbers = json.numbers();
  if (numbers.size() != 2) json.fail("is not two numbers");
  return {numbers[0], numbers[1]};
}

}  // namespace

Frame read_frame(const JsonValue& json) {
  Frame frame;
  frame.says_y = json.has("y_down");
  frame.says_units = json.has("unit_per_pixel");
  if (frame.says_y) frame.y_down = json.at("y_down").boolean();
  if (frame.says_units) {
    const JsonValue unit = json.at("unit_per_pixel");
    frame.unit_per_pixel = pair_in(unit);
    for (const double length : frame.unit_per_pixel)
      if (!(std::isfinite(length) && length > 0)) unit.fail("is not greater than 0");
  }
  if (json.has("origin")) frame.origin = pair_in(json.at("origin"));
  if (json.has("width")) frame.width = json.at("width").count();
  if (json.has("height")) frame.height = json.at("height").count();
  if (json.has("orientation")) {
    const std::string orientation = json.at("orientation").text();
    if (orientation != "stored" && orientation != "displayed")
      json.at("orientation").fail("is neither 'stored' nor 'displayed'");
    frame.orientation = orientation == "displayed" ? Orientation::kDisplayed : Orientation::kStored;
  }
  if (json.has("stated")) {
    frame.says_y = json.at("stated").at("y").boolean();
    frame.says_units = json.at("stated").at("units").boolean();
  }
  return frame;
}

Frame frame_of_json(const Json& json) {
  const nlohmann::json plain = json;
  const std::string file;
  return read_frame(JsonValue(plain, file));
}

bool are_same_frames(const Frame& a, const Frame& b) { return frame_text(a) == frame_text(b); }

}  // namespace pulson::formats
