#pragma once

// What the readers and writers of JSON share. Every error names the file and the place in it: `shapes[2].points[0]`.

#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "pulson/core/landmarks.hpp"

namespace pulson::formats {

using Json = nlohmann::ordered_json;

/// The columns of a matrix as a list of lists: [landmark][axis].
Json points_json(const Points& points);

/// Pairs of landmarks, counted from 1: what JsonValue::links(count, 1) reads.
Json links_json(const std::vector<std::pair<int, int>>& links);

/// JSON without line ends. Bytes of texts that are not UTF-8 are replaced, and then `is_changed` is set.
std::string json_line(const Json& json, bool& is_changed);

/// Valid JSON in which each key of the top level has a line of its own: to be read by people and compared by diff.
std::string one_key_a_line(const Json& json);

/// The value of a whole file, where NaN is null. @throws InputError "path:line: column n: ..." if it is no JSON
nlohmann::json parse_json(const std::string& path, std::string_view text);

/// The same with its keys in their order.
Json parse_ordered_json(const std::string& path, std::string_view text);

/// The keys of JSON at the outer levels, found without parsing it, by which formats are distinguished.
class JsonKeys {
 public:
  explicit JsonKeys(std::string_view text);

  bool is_object() const { return first_ == '{'; }
  bool is_list() const { return first_ == '['; }
  /// @param level 1: of the outermost object or of none in the outermost list; 2: of objects in that; up to 4
  bool has(int level, std::string_view key) const { return keys_.contains({level, key}); }

 private:
  char first_ = '\0';
  std::set<std::pair<int, std::string_view>> keys_;
};

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
  int count() const;           ///< a whole number, not negative
  std::uint64_t seed() const;  ///< the same, of 64 bits
  std::vector<std::string> texts() const;
  Eigen::VectorXd numbers() const;
  std::vector<JsonValue> items() const;
  /// Pairs of two of `count` landmarks, which the file counts from `first`; here they are from 0.
  std::vector<std::pair<int, int>> links(int count, int first) const;

  /// A list of lists of `size` numbers, as the columns of a matrix. @param may_lack null is NaN, else it is refused
  Eigen::MatrixXd columns(Eigen::Index size, bool may_lack = false) const;

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

/// Text, or a number as it is written; nothing where there is none.
std::string text_of(const JsonValue& object, const std::string& key);

}  // namespace pulson::formats
