#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/csv/csv_columns.hpp"
#include "formats/formats.hpp"
#include "formats/landmark_writers.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {

namespace {

constexpr std::size_t kFirstCoordinate = 2;  // after the name and whether the landmark is active

bool is_unset(std::string_view field) {
  const std::string lower = text::to_lower(field);
  return lower == "infinity" || lower == "-infinity";
}

bool is_coordinate(const std::string& field) { return is_unset(field) || is_number_or_missing(field); }

bool is_truth(std::string_view field) {
  const std::string lower = text::to_lower(field);
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
        text::fail(path_, record.line, text::in_quotes(record.fields[1]) + " in the second column; valid: true, false");
      // BigWarp makes a landmark active once both pictures have it: one that waits for its second place keeps the
      // first.
      const bool waits = std::any_of(record.fields.begin() + kFirstCoordinate, record.fields.end(), is_unset);
      const bool is_active = waits || text::to_lower(record.fields[1]) == "true";
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
    text::CoordinatePlace place{path_, record.line, text::in_quotes(record.fields.front()), shape, 0};
    for (; place.axis < dimension_; ++place.axis) {
      const std::string& field = record.fields[first + place.axis];
      const double value = is_unset(field) ? text::kMissing : text::parse_coordinate(field, place);
      coordinates.push_back(is_active ? value : text::kMissing);
    }
  }

  /// BigWarp counts names anew after landmarks are deleted, so that they may repeat; then they identify nothing.
  std::vector<std::string> find_labels() {
    std::vector<std::string> labels;
    std::set<std::string> seen;
    for (const CsvRecord& record : records_) {
      labels.push_back(record.name(0));
      if (!seen.insert(labels.back()).second && repeated_.empty()) repeated_ = text::in_quotes(labels.back());
    }
    return repeated_.empty() ? labels : std::vector<std::string>();
  }

  Landmarks shape_of(const char* name, const std::vector<double>& coordinates,
                     const std::vector<std::string>& labels) const {
    Landmarks shape;
    shape.name = name;
    shape.labels = labels;
    shape.points = text::points_from(coordinates, dimension_);
    return shape;
  }

  std::vector<std::string> warnings() const {
    std::vector<std::string> found;
    if (inactive_ > 0)
      found.push_back(fmt::format("{}: {} read as missing", path_, text::counted(inactive_, "inactive landmark")));
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

bool sniff_bigwarp(std::string_view text) {
  const std::vector<CsvRecord> first = first_records(text, 1);
  return !first.empty() && is_bigwarp(first.front());
}

LandmarkFile read_bigwarp(const std::string& path, std::string_view text) {
  const std::vector<CsvRecord> records = csv_records(path, text);
  if (records.empty() || !is_bigwarp(records.front()))
    throw InputError(path + " does not begin with a landmark of BigWarp: name, true or false, moving x,y[,z], target");
  return BigWarpReader(path, records).read();
}

/// The two shapes side by side, each cell in quotes, as BigWarp writes them.
WrittenLandmarks write_bigwarp(const std::string& path, const LandmarkFile& file) {
  const Target target{path, "bigwarp"};
  require_shapes(target, file);
  if (file.shapes.size() != 2)
    throw InputError(fmt::format("{}: bigwarp holds two shapes, moving and target; there {}", path,
                                 file.shapes.size() == 1 ? "is 1" : fmt::format("are {}", file.shapes.size())));
  const Landmarks &moving = file.shapes[0], &fixed = file.shapes[1];
  for (const Landmarks* shape : {&moving, &fixed}) {
    require_landmarks(target, *shape);
    require_plane_or_space(target, *shape);
  }
  if (moving.count() != fixed.count() || moving.dimension() != fixed.dimension())
    throw InputError(fmt::format("{}: bigwarp pairs landmarks; the shapes have {} in {}D and {} in {}D", path,
                                 moving.count(), moving.dimension(), fixed.count(), fixed.dimension()));
  WrittenLandmarks written{{}, losses_of(target, file, {.labels = true, .directions = true})};
  const std::vector<std::string>& labels = moving.labels.empty() ? fixed.labels : moving.labels;
  if (!moving.labels.empty() && !fixed.labels.empty() && moving.labels != fixed.labels)
    add_once(written.losses, cannot_hold(target, "labels of the second shape that differ from those of the first"));
  if (std::set<std::string>(labels.begin(), labels.end()).size() < labels.size())
    add_once(written.losses, cannot_hold(target, "labels that repeat"));
  bool has_broken_lines = false;
  for (int a = 0; a < moving.count(); ++a) {
    const bool is_whole = moving.points.col(a).allFinite() && fixed.points.col(a).allFinite();
    const std::string name = labels.empty() ? fmt::format("Pt-{}", a) : labels[static_cast<std::size_t>(a)];
    written.text += fmt::format(R"({},"{}")", text::csv_quoted(one_line(name, has_broken_lines)), is_whole);
    for (const Landmarks* shape : {&moving, &fixed})
      for (const double value : shape->points.col(a))
        written.text += std::isnan(value) ? R"(,"Infinity")" : fmt::format(R"(,"{}")", value);
    written.text += '\n';
  }
  if (has_broken_lines) add_once(written.losses, cannot_hold_breaks(target));
  return written;
}

/// The lines above the table: scorer, individuals (where there are several), bodyparts, coords.
struct HeaderLines {
  const CsvRecord* individuals = nullptr;
  const CsvRecord* bodyparts = nullptr;
  const CsvRecord* coordinates = nullptr;
};

HeaderLines find_header(const std::string& path, const std::vector<CsvRecord>& records) {
  HeaderLines header;
  for (const CsvRecord& record : records) {
    const std::string kind = text::to_lower(record.fields.front());
    if (kind == "individuals") header.individuals = &record;
    if (kind == "bodyparts") header.bodyparts = &record;
    if (kind != "coords") continue;
    header.coordinates = &record;
    break;
  }
  if (header.bodyparts == nullptr || header.coordinates == nullptr)
    text::fail(
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
                                           text::counted(likelihoods_, "column")));
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
      if (text::to_lower(coordinate) == "likelihood") {
        ++likelihoods_;
        continue;
      }
      const std::optional<std::size_t> axis = axis_of_word(coordinate);
      if (!axis)
        text::fail(path_, header_.coordinates->line,
                   fmt::format("column {} is {}; valid: x, y, z, likelihood", i + 1, text::in_quotes(coordinate)));
      const std::string individual = header_.individuals != nullptr ? header_.individuals->fields[i] : "";
      const std::string& name = header_.bodyparts->fields[i];
      require_short_name(path_, *header_.bodyparts, name);
      if (header_.individuals != nullptr) require_short_name(path_, *header_.individuals, individual);
      const auto [entry, is_new] = place.try_emplace({individual, name}, parts_.size());
      if (is_new) parts_.push_back({individual, name});
      std::optional<std::size_t>& column = parts_[entry->second].columns[*axis];
      if (column)
        text::fail(path_, header_.coordinates->line,
                   fmt::format("the columns {} and {} are both {} of {}", *column + 1, i + 1, "xyz"[*axis],
                               text::in_quotes(name)));
      column = i;
      dimension_ = std::max(dimension_, *axis + 1);
    }
  }

  void require_all_axes() const {
    if (parts_.empty()) text::fail(path_, header_.coordinates->line, "no column holds x");
    for (const BodyPart& part : parts_)
      for (std::size_t axis = 0; axis < dimension_; ++axis)
        if (!part.columns[axis])
          text::fail(path_, header_.coordinates->line,
                     fmt::format("no column holds {} of {}", "xyz"[axis], text::in_quotes(part.name)));
  }

  void read_shape(const CsvRecord& record) {
    Landmarks& shape = file_.shapes.emplace_back();
    name_shape(record, shape);
    std::vector<double> coordinates;
    for (const BodyPart& part : parts_) {
      text::CoordinatePlace place{path_, record.line, text::in_quotes(part.name), text::in_quotes(shape.name), 0};
      for (; place.axis < dimension_; ++place.axis)
        coordinates.push_back(text::parse_coordinate(record.fields[*part.columns[place.axis]], place));
      shape.labels.push_back(part.name);
      if (header_.individuals != nullptr) shape.groups.push_back(part.individual);
    }
    shape.points = text::points_from(coordinates, dimension_);
  }

  /// Predictions have the number of the frame where labelled data have the path of the image.
  void name_shape(const CsvRecord& record, Landmarks& shape) const {
    std::vector<std::size_t> columns(image_columns_);
    std::iota(columns.begin(), columns.end(), std::size_t{0});
    std::string image = joined_fields(record, columns);
    if (text::is_number(image)) {
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

bool sniff_deeplabcut(std::string_view text) {
  const std::vector<CsvRecord> first = first_records(text, 2);
  if (first.size() < 2 || text::to_lower(first[0].fields.front()) != "scorer") return false;
  const std::string second = text::to_lower(first[1].fields.front());
  return second == "bodyparts" || second == "individuals";
}

LandmarkFile read_deeplabcut(const std::string& path, std::string_view text) {
  const std::vector<CsvRecord> records = csv_records(path, text);
  if (records.empty()) throw InputError(path + " holds only blank lines and comments");
  return DeepLabCutReader(path, records).read();
}

}  // namespace

LandmarkFormat deeplabcut_format() {
  return {.name = "deeplabcut",
          .extensions = {},
          .help = "DeepLabCut's tables CollectedData and its predictions: a shape per image, a landmark per body part",
          .sniff = sniff_deeplabcut,
          .read = read_deeplabcut,
          .y_down = true};
}

LandmarkFormat bigwarp_format() {
  return {.name = "bigwarp",
          .extensions = {"bigwarp.csv"},
          .help = "landmarks of Fiji's BigWarp: the shapes moving and target",
          .sniff = sniff_bigwarp,
          .read = read_bigwarp,
          .write = write_bigwarp,
          .y_down = true};
}

}  // namespace pulson::formats
