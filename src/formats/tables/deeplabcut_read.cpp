#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/csv/csv_columns.hpp"
#include "formats/csv/csv_layouts.hpp"
#include "formats/formats.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::io {
namespace {

/// The lines above the table: scorer, individuals (where there are several), bodyparts, coords.
struct HeaderLines {
  const CsvRecord* individuals = nullptr;
  const CsvRecord* bodyparts = nullptr;
  const CsvRecord* coordinates = nullptr;
};

HeaderLines find_header(const std::string& path, const std::vector<CsvRecord>& records) {
  HeaderLines header;
  for (const CsvRecord& record : records) {
    const std::string kind = to_lower(record.fields.front());
    if (kind == "individuals") header.individuals = &record;
    if (kind == "bodyparts") header.bodyparts = &record;
    if (kind != "coords") continue;
    header.coordinates = &record;
    break;
  }
  if (header.bodyparts == nullptr || header.coordinates == nullptr)
    fail(
        path, records.front().line,
        "a table of DeepLabCut begins with the lines scorer, bodyparts and coords, with individuals after scorer where "
        "there are several");
  return header;
}

struct BodyPart {
  std::string individual;
  std::string name;
  std::array<std::optional<std::size_t>, 3> columns{};
};

class DeepLabCutReader {
 public:
  DeepLabCutReader(const std::string& path, const std::vector<CsvRecord>& records)
      : path_(path), records_(records), header_(find_header(path, records)) {}

  LandmarkFile read() {
    require_equal_lengths(path_, records_);
    find_parts();
    require_all_axes();
    const CsvRecord* const end = records_.data() + records_.size();
    for (const CsvRecord* record = header_.coordinates + 1; record != end; ++record) read_shape(*record);
    if (file_.shapes.empty()) throw InputError(path_ + " holds a header and no landmarks");
    if (likelihoods_ > 0)
      file_.warnings.push_back(fmt::format("{}: likelihood is not used ({}); all landmarks are read", path_,
                                           counted(likelihoods_, "column")));
    return std::move(file_);
  }

 private:
  /// Columns before those of the body parts name the image.
  std::size_t count_image_columns() const {
    const auto& fields = header_.coordinates->fields;
    const auto first = std::find_if(fields.begin() + 1, fields.end(), [](const auto& field) { return !field.empty(); });
    return static_cast<std::size_t>(first - fields.begin());
  }

  void find_parts() {
    image_columns_ = count_image_columns();
    std::map<std::pair<std::string, std::string>, std::size_t> place;
    for (std::size_t i = image_columns_; i < header_.coordinates->fields.size(); ++i) {
      const std::string& coordinate = header_.coordinates->fields[i];
      if (to_lower(coordinate) == "likelihood") {
        ++likelihoods_;
        continue;
      }
      const std::optional<std::size_t> axis = axis_of_word(coordinate);
      if (!axis)
        fail(path_, header_.coordinates->line,
             fmt::format("column {} is {}; valid: x, y, z, likelihood", i + 1, in_quotes(coordinate)));
      const std::string individual = header_.individuals != nullptr ? header_.individuals->fields[i] : "";
      const std::string& name = header_.bodyparts->fields[i];
      require_short(*header_.bodyparts, name);
      if (header_.individuals != nullptr) require_short(*header_.individuals, individual);
      const auto [entry, is_new] = place.try_emplace({individual, name}, parts_.size());
      if (is_new) parts_.push_back({individual, name});
      std::optional<std::size_t>& column = parts_[entry->second].columns[*axis];
      if (column)
        fail(path_, header_.coordinates->line,
             fmt::format("the columns {} and {} are both {} of {}", *column + 1, i + 1, "xyz"[*axis], in_quotes(name)));
      column = i;
      dimension_ = std::max(dimension_, *axis + 1);
    }
  }

  /// Each shape repeats the names, so that long ones would take far more memory than the file has.
  void require_short(const CsvRecord& record, const std::string& name) const {
    constexpr std::size_t kLongest = 200;
    if (name.size() > kLongest)
      fail(path_, record.line, fmt::format("the name {} is longer than {} bytes", in_quotes(name), kLongest));
  }

  void require_all_axes() const {
    if (parts_.empty()) fail(path_, header_.coordinates->line, "no column holds x");
    for (const BodyPart& part : parts_)
      for (std::size_t axis = 0; axis < dimension_; ++axis)
        if (!part.columns[axis])
          fail(path_, header_.coordinates->line,
               fmt::format("no column holds {} of {}", "xyz"[axis], in_quotes(part.name)));
  }

  void read_shape(const CsvRecord& record) {
    Landmarks& shape = file_.shapes.emplace_back();
    name_shape(record, shape);
    std::vector<double> coordinates;
    for (const BodyPart& part : parts_) {
      CoordinatePlace place{path_, record.line, in_quotes(part.name), in_quotes(shape.name), 0};
      for (; place.axis < dimension_; ++place.axis)
        coordinates.push_back(parse_coordinate(record.fields[*part.columns[place.axis]], place));
      shape.labels.push_back(part.name);
      if (header_.individuals != nullptr) shape.groups.push_back(part.individual);
    }
    shape.points = Points::Map(coordinates.data(), static_cast<Eigen::Index>(dimension_),
                               static_cast<Eigen::Index>(parts_.size()));
  }

  /// Predictions have the number of the frame where labelled data have the path of the image.
  void name_shape(const CsvRecord& record, Landmarks& shape) const {
    std::string image;
    for (std::size_t i = 0; i < image_columns_; ++i)
      if (!record.fields[i].empty()) image += (image.empty() ? "" : "/") + record.fields[i];
    if (is_number(image)) {
      shape.name = image;
      return;
    }
    shape.image = image;
    std::replace(image.begin(), image.end(), '\\', '/');
    shape.name = std::filesystem::path(image).stem().string();
  }

  const std::string& path_;
  const std::vector<CsvRecord>& records_;
  HeaderLines header_;
  std::size_t image_columns_ = 0;
  std::vector<BodyPart> parts_;
  std::size_t dimension_ = 0;
  std::size_t likelihoods_ = 0;
  LandmarkFile file_;
};

}  // namespace

bool sniff_deeplabcut(std::string_view text) {
  try {
    const std::vector<CsvRecord> first = csv_records("", text, 2);
    if (first.size() < 2 || to_lower(first[0].fields.front()) != "scorer") return false;
    const std::string second = to_lower(first[1].fields.front());
    return second == "bodyparts" || second == "individuals";
  } catch (const InputError&) {
    return false;
  }
}

LandmarkFile read_deeplabcut(const std::string& path, std::string_view text) {
  const std::vector<CsvRecord> records = csv_records(path, text);
  if (records.empty()) throw InputError(path + " holds only blank lines and comments");
  return DeepLabCutReader(path, records).read();
}

}  // namespace pulson::io
