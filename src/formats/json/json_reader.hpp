#pragma once

// What the readers of landmarks in JSON share. Every error names the file and the place in it: `shapes[2].points[0]`.

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "pulson/core/landmarks.hpp"

namespace pulson::io {

/// The value of a whole file, where NaN is null. @throws InputError "path:line: column n: ..." if it is no JSON
nlohmann::json parse_json(const std::string& path, std::string_view text);

/// A value of a file and its place; both must outlive it.
class JsonValue {
 public:
  JsonValue(const nlohmann::json& value, const std::string& file, std::string place = {})
      : value_(&value), file_(&file), place_(std::move(place)) {}

  const nlohmann::json& value() const { return *value_; }
  bool has(const std::string& key) const;  ///< and it is not null
  JsonValue at(const std::string& key) const;

  std::string text() const;
  double number() const;
  bool boolean() const;
  std::vector<std::string> texts() const;
  std::vector<JsonValue> items() const;

  /// A list of points, each a list of 1, 2 or 3 numbers, all of one length; null is NaN, in place of a point too.
  /// Without points they are in the plane.
  Points points() const;

  /// @throws InputError "path: 'place' problem"
  [[noreturn]] void fail(std::string_view problem) const;

 private:
  void read_point(std::size_t index, Points& points) const;

  const nlohmann::json* value_;
  const std::string* file_;
  std::string place_;
};

}  // namespace pulson::io
