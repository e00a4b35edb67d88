#include "json_reader.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {

Json points_json(const Points& points) {
  Json rows = Json::array();
  for (const auto& column : points.colwise()) rows.push_back(std::vector<double>(column.begin(), column.end()));
  return rows;
}

Json links_json(const std::vector<std::pair<int, int>>& links) {
  Json json = Json::array();
  for (const auto& [a, b] : links) json.push_back(Json::array({a + 1, b + 1}));
  return json;
}

std::string json_line(const Json& json, bool& is_changed) {
  try {
    return json.dump();
  } catch (const Json::type_error&) {
    is_changed = true;
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
  }
}

std::string one_key_a_line(const Json& json) {
  std::string text = "{";
  for (const auto& [key, value] : json.items())
    text += (text.size() > 1 ? ",\n  " : "\n  ") + Json(key).dump() + ": " +
            value.dump(-1, ' ', false, Json::error_handler_t::replace);
  return text + "\n}\n";
}

namespace {

/// The digits after `word`, moved out of `text` with all before them.
std::string take_number_after(std::string_view word, std::string& text) {
  const std::size_t at = text.find(word);
  if (at == std::string::npos) return {};
  const std::size_t begin = at + word.size();
  const std::size_t end = std::min(text.find_first_not_of("0123456789", begin), text.size());
  std::string number = text.substr(begin, end - begin);
  text.erase(0, end);
  return number;
}

/// `text` with null for each NaN outside of strings, which Python writes and JSON has not.
std::string with_null_for_nan(std::string_view text) {
  constexpr std::string_view kNan = "NaN";
  std::string valid;
  valid.reserve(text.size());
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (!in_string && text.substr(i).starts_with(kNan)) {
      valid += "null";
      i += kNan.size() - 1;
      continue;
    }
    if (text[i] == '"') in_string = !in_string;
    valid += text[i];
    if (in_string && text[i] == '\\' && i + 1 < text.size()) valid += text[++i];
  }
  return valid;
}

/// `[json.exception.parse_error.101] parse error at line 2, column 5: what is wrong` in our words.
[[noreturn]] void rethrow(const std::string& path, std::string text, bool is_infinite) {
  constexpr std::size_t kLongest = 240;
  text.erase(0, std::min(text.find(']') + 1, text.size()));
  const std::string line = take_number_after("parse error at line ", text);
  const std::string column = line.empty() ? "" : take_number_after("column ", text);
  text.erase(0, std::min(text.find_first_not_of(": "), text.size()));
  if (is_infinite) text = "Infinity; a coordinate must be finite, or null where it is missing";
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20) c = '?';
  if (text.size() > kLongest) text = text.substr(0, kLongest) + "...";
  if (line.empty()) throw InputError(fmt::format("{}: not valid JSON: {}", path, text));
  throw InputError(fmt::format("{}:{}: column {}: not valid JSON: {}", path, line, column, text));
}

bool is_coordinates(const nlohmann::json& value) {
  return value.is_array() && !value.empty() && value.size() <= 3 &&
         std::all_of(value.begin(), value.end(),
                     [](const nlohmann::json& item) { return item.is_number() || item.is_null(); });
}

template <class Value>
Value parse_as(const std::string& path, std::string_view text) {
  if (Value json = Value::parse(text, nullptr, false); !json.is_discarded()) return json;
  const std::string valid = with_null_for_nan(text);
  try {
    return Value::parse(valid);
  } catch (const nlohmann::json::parse_error& error) {
    const bool is_infinite = error.byte > 0 && valid.find("Infinity", error.byte - 1) == error.byte - 1;
    rethrow(path, error.what(), is_infinite);
  } catch (const nlohmann::json::exception& error) {
    rethrow(path, error.what(), false);
  }
}

}  // namespace

nlohmann::json parse_json(const std::string& path, std::string_view text) {
  return parse_as<nlohmann::json>(path, text);
}

Json parse_ordered_json(const std::string& path, std::string_view text) { return parse_as<Json>(path, text); }

JsonKeys::JsonKeys(std::string_view text) {
  constexpr int kDeepest = 4;
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t begin_of_text = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  if (begin_of_text == std::string_view::npos) return;
  first_ = text[begin_of_text];
  if (!is_object() && !is_list()) return;
  int level = 0;
  for (std::size_t i = begin_of_text; i < text.size(); ++i) {
    if (text[i] == '{' || text[i] == '[') ++level;
    if (text[i] == '}' || text[i] == ']') --level;
    if (text[i] != '"') continue;
    const std::size_t begin = i + 1;
    for (i = begin; i < text.size() && text[i] != '"'; ++i)
      if (text[i] == '\\') ++i;
    if (i >= text.size()) return;
    const std::size_t colon = text.find_first_not_of(kBlanks, i + 1);
    const bool is_key = colon != std::string_view::npos && text[colon] == ':';
    if (is_key && level <= kDeepest) keys_.emplace(level, text.substr(begin, i - begin));
  }
}

bool JsonValue::has(const std::string& key) const {
  if (!value_->is_object()) return false;
  const auto found = value_->find(key);
  return found != value_->end() && !found->is_null();
}

JsonValue JsonValue::at(const std::string& key) const {
  JsonValue inner(*value_, *file_, place_.empty() ? key : place_ + "." + key);
  if (!has(key)) inner.fail("is missing");
  inner.value_ = &value_->at(key);
  return inner;
}

std::string JsonValue::text() const {
  if (!value_->is_string()) fail("is not a string");
  return value_->get<std::string>();
}

bool JsonValue::boolean() const {
  if (!value_->is_boolean()) fail("is neither true nor false");
  return value_->get<bool>();
}

double JsonValue::number() const {
  if (!value_->is_number()) fail("is not a number");
  return value_->get<double>();
}

std::vector<std::string> JsonValue::texts() const {
  std::vector<std::string> all;
  if (!value_->is_array()) fail("is not a list of strings");
  for (const nlohmann::json& item : *value_) {
    if (!item.is_string()) fail(fmt::format("has no string as item {}", all.size() + 1));
    all.push_back(item.get<std::string>());
  }
  return all;
}

std::vector<std::pair<int, int>> JsonValue::links(int count, int first) const {
  std::vector<std::pair<int, int>> all;
  for (const JsonValue& link : items()) {
    const std::vector<JsonValue> ends = link.items();
    if (ends.size() != 2) link.fail("is not a pair of landmarks");
    const int a = ends[0].count() - first, b = ends[1].count() - first;
    if (std::min(a, b) < 0 || std::max(a, b) >= count)
      link.fail(fmt::format("joins landmarks that are not there; they are {} to {}", first, count - 1 + first));
    if (a != b) all.emplace_back(a, b);
  }
  return all;
}

int JsonValue::count() const {
  if (!value_->is_number_integer()) fail("is not a whole number");
  const auto number = value_->get<std::int64_t>();
  if (number < 0 || number > std::numeric_limits<int>::max()) fail("is out of range");
  return static_cast<int>(number);
}

std::uint64_t JsonValue::seed() const {
  if (!value_->is_number_unsigned()) fail("is not a seed, a whole number from 0");
  return value_->get<std::uint64_t>();
}

Eigen::VectorXd JsonValue::numbers() const {
  const std::vector<JsonValue> all = items();
  Eigen::VectorXd numbers(std::ssize(all));
  for (std::size_t i = 0; i < all.size(); ++i) numbers[static_cast<Eigen::Index>(i)] = all[i].number();
  return numbers;
}

Eigen::MatrixXd JsonValue::columns(Eigen::Index size, bool may_lack) const {
  const auto is_known = [&](const nlohmann::json& item) { return item.is_number() || (may_lack && item.is_null()); };
  if (!value_->is_array()) fail("is not a list of lists of numbers");
  Eigen::MatrixXd matrix(size, std::ssize(*value_));
  for (Eigen::Index i = 0; i < matrix.cols(); ++i) {
    const nlohmann::json& row = (*value_)[static_cast<std::size_t>(i)];
    if (!row.is_array() || !std::all_of(row.begin(), row.end(), is_known)) fail("is not a list of lists of numbers");
    if (std::ssize(row) != size)
      fail(fmt::format("has {} in row {}; {} are needed", text::counted(row.size(), "number"), i + 1, size));
    for (Eigen::Index c = 0; c < size; ++c) {
      const nlohmann::json& item = row[static_cast<std::size_t>(c)];
      matrix(c, i) = item.is_null() ? text::kMissing : item.get<double>();
    }
  }
  return matrix;
}

std::vector<JsonValue> JsonValue::items() const {
  if (!value_->is_array()) fail("is not a list");
  std::vector<JsonValue> all;
  for (const nlohmann::json& item : *value_) all.emplace_back(item, *file_, fmt::format("{}[{}]", place_, all.size()));
  return all;
}

Points JsonValue::points() const {
  if (!value_->is_array()) fail("is not a list of points [x, y]");
  const auto first = std::find_if(value_->begin(), value_->end(), is_coordinates);
  Points points(first == value_->end() ? 2 : static_cast<Eigen::Index>(first->size()),
                static_cast<Eigen::Index>(value_->size()));
  for (std::size_t i = 0; i < value_->size(); ++i) read_point(i, points);
  return points;
}

void JsonValue::read_point(std::size_t index, Points& points) const {
  const nlohmann::json& point = (*value_)[index];
  auto column = points.col(static_cast<Eigen::Index>(index));
  if (point.is_null()) {
    column.setConstant(text::kMissing);
    return;
  }
  const auto fail_here = [&](const std::string& problem) {
    JsonValue(point, *file_, fmt::format("{}[{}]", place_, index)).fail(problem);
  };
  if (!is_coordinates(point)) fail_here("is not a list of 1, 2 or 3 numbers");
  if (static_cast<Eigen::Index>(point.size()) != points.rows())
    fail_here(fmt::format("has {}; the first point has {}", text::counted(point.size(), "number"), points.rows()));
  for (std::size_t axis = 0; axis < point.size(); ++axis)
    column[static_cast<Eigen::Index>(axis)] = point[axis].is_null() ? text::kMissing : point[axis].get<double>();
}

void JsonValue::fail(std::string_view problem) const {
  if (place_.empty()) throw InputError(fmt::format("{}: the file {}", *file_, problem));
  throw InputError(fmt::format("{}: {} {}", *file_, text::in_quotes(place_), problem));
}

std::string text_of(const JsonValue& object, const std::string& key) {
  if (!object.has(key)) return "";
  const JsonValue json = object.at(key);
  return json.value().is_number() ? json.value().dump() : json.text();
}

}  // namespace pulson::formats
