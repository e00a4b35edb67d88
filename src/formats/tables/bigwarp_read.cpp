#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/csv/csv_columns.hpp"
#include "formats/csv/csv_layouts.hpp"
#include "formats/formats.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::io {
namespace {

constexpr std::size_t kFirstCoordinate = 2;  // after the name and whether the landmark is active

bool is_unset(std::string_view field) {
  const std::string lower = to_lower(field);
  return lower == "infinity" || lower == "-infinity";
}

bool is_coordinate(const std::string& field) { return is_unset(field) || is_number_or_missing(field); }

bool is_truth(std::string_view field) {
  const std::string lower = to_lower(field);
  return lower == "true" || lower == "false";
}

bool is_bigwarp(const CsvRecord& record) {
  const auto& fields = record.fields;
  const bool has_right_size = fields.size() == kFirstCoordinate + 4 || fields.size() == kFirstCoordinate + 6;
  return has_right_size && is_truth(fields[1]) &&
         std::all_of(fields.begin() + kFirstCoordinate, fields.end(), is_coordinate);
}

class BigWarpReader {
 public:
  BigWarpReader(const std::string& path, const std::vector<CsvRecord>& records)
      : path_(path), records_(records), dimension_((records.front().fields.size() - kFirstCoordinate) / 2) {}

  LandmarkFile read() {
    require_equal_lengths(path_, records_);
    for (const CsvRecord& record : records_) {
      if (!is_truth(record.fields[1]))
        fail(path_, record.line, in_quotes(record.fields[1]) + " in the second column; valid: true, false");
      const bool is_active = to_lower(record.fields[1]) == "true";
      if (!is_active) ++inactive_;
      read_point(record, "moving", kFirstCoordinate, is_active, moving_);
      read_point(record, "target", kFirstCoordinate + dimension_, is_active, target_);
    }
    LandmarkFile file;
    const std::vector<std::string> labels = find_labels();
    file.shapes = {shape_of("moving", moving_, labels), shape_of("target", target_, labels)};
    file.warnings = warnings();
    return file;
  }

 private:
  void read_point(const CsvRecord& record, const char* shape, std::size_t first, bool is_active,
                  std::vector<double>& coordinates) const {
    CoordinatePlace place{path_, record.line, in_quotes(record.fields.front()), shape, 0};
    for (; place.axis < dimension_; ++place.axis) {
      const std::string& field = record.fields[first + place.axis];
      const double value = is_unset(field) ? kMissing : parse_coordinate(field, place);
      coordinates.push_back(is_active ? value : kMissing);
    }
  }

  /// BigWarp counts names anew after landmarks are deleted, so that they may repeat; then they identify nothing.
  std::vector<std::string> find_labels() {
    std::vector<std::string> labels;
    std::set<std::string> seen;
    for (const CsvRecord& record : records_) {
      labels.push_back(record.fields.front());
      if (!seen.insert(labels.back()).second && repeated_.empty()) repeated_ = in_quotes(labels.back());
    }
    return repeated_.empty() ? labels : std::vector<std::string>();
  }

  Landmarks shape_of(const char* name, const std::vector<double>& coordinates,
                     const std::vector<std::string>& labels) const {
    Landmarks shape;
    shape.name = name;
    shape.labels = labels;
    shape.points = Points::Map(coordinates.data(), static_cast<Eigen::Index>(dimension_),
                               static_cast<Eigen::Index>(records_.size()));
    return shape;
  }

  std::vector<std::string> warnings() const {
    std::vector<std::string> found;
    if (inactive_ > 0)
      found.push_back(fmt::format("{}: {} read as missing", path_, counted(inactive_, "inactive landmark")));
    if (!repeated_.empty())
      found.push_back(fmt::format("{}: the name {} repeats; landmarks are known by their number", path_, repeated_));
    return found;
  }

  const std::string& path_;
  const std::vector<CsvRecord>& records_;
  std::size_t dimension_;
  std::size_t inactive_ = 0;
  std::string repeated_;
  std::vector<double> moving_;
  std::vector<double> target_;
};

}  // namespace

bool sniff_bigwarp(std::string_view text) {
  try {
    const std::vector<CsvRecord> first = csv_records("", text, 1);
    return !first.empty() && is_bigwarp(first.front());
  } catch (const InputError&) {
    return false;
  }
}

LandmarkFile read_bigwarp(const std::string& path, std::string_view text) {
  const std::vector<CsvRecord> records = csv_records(path, text);
  if (records.empty() || !is_bigwarp(records.front()))
    throw InputError(path + " does not begin with a landmark of BigWarp: name, true or false, moving x,y[,z], target");
  return BigWarpReader(path, records).read();
}

}  // namespace pulson::io
