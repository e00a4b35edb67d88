// Regions of ImageJ: a file .roi, or RoiSet.zip with several, as its class RoiDecoder reads them. Points are landmarks;
// polygons and traced regions are outlines; lines are curves.
// See https://github.com/imagej/ImageJ/blob/master/ij/io/RoiDecoder.java.

#include <algorithm>
#include <bit>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/annotated_shapes.hpp"
#include "formats/formats.hpp"
#include "formats/shape_options.hpp"
#include "pulson/core/errors.hpp"
#include "zip_archive.hpp"

namespace pulson::formats {
namespace {

constexpr std::string_view kRoiMark = "Iout";

enum class RoiKind : std::uint8_t {
  kPolygon = 0,
  kRectangle = 1,
  kOval = 2,
  kLine = 3,
  kFreeLine = 4,
  kPolyline = 5,
  kNone = 6,
  kFreehand = 7,
  kTraced = 8,
  kAngle = 9,
  kPoint = 10
};

/// Where the parts of a file are; numbers are big-endian.
constexpr std::size_t kVersionAt = 4, kTypeAt = 6, kTopAt = 8, kLeftAt = 10, kCountAt = 16, kLineAt = 18,
                      kLargeCountAt = 18, kOptionsAt = 50, kPositionAt = 56, kSecondHeaderAt = 60, kPointsAt = 64;
/// And in the second header.
constexpr std::size_t kNameAt = 16, kNameLengthAt = 20, kCountersAt = 48, kSecondHeaderSize = 52;
constexpr int kSubPixel = 128;  // of the options
constexpr int kFirstSubPixelVersion = 222;

struct Roi {
  RoiKind kind{};
  std::string name;
  int position = 0;  ///< of a slice from 1; 0: none
  Points points;
  std::vector<int> positions{};  ///< of each point, where they say so
};

class RoiBytes {
 public:
  RoiBytes(const std::string& path, std::string_view bytes) : path_(path), bytes_(bytes) {}

  Roi read(const std::string& name) const {
    if (!bytes_.starts_with(kRoiMark) || bytes_.size() < kPointsAt)
      throw InputError(path_ + ": it is no region of ImageJ: Iout and 60 bytes more are expected at its beginning");
    Roi roi;
    roi.kind = static_cast<RoiKind>(bytes_[kTypeAt]);
    roi.position = std::max(0, integer(kPositionAt));
    roi.name = name;
    read_second_header(roi);
    if (roi.kind == RoiKind::kLine) {
      roi.points.resize(2, 2);
      for (Eigen::Index i = 0; i < 4; ++i) roi.points.data()[i] = real(kLineAt + 4 * static_cast<std::size_t>(i));
    } else if (roi.kind == RoiKind::kRectangle || roi.kind == RoiKind::kOval || roi.kind == RoiKind::kNone) {
      roi.points.resize(2, 0);
    } else {
      read_points(roi);
    }
    if (!roi.points.allFinite()) throw InputError(path_ + ": a coordinate is not finite");
    return roi;
  }

 private:
  std::uint32_t unsigned_at(std::size_t at, std::size_t length) const {
    if (at > bytes_.size() || bytes_.size() - at < length)
      throw InputError(fmt::format("{}: it has {} bytes; at {} there should be more", path_, bytes_.size(), at));
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < length; ++i) value = value << 8U | static_cast<unsigned char>(bytes_[at + i]);
    return value;
  }
  int integer(std::size_t at) const { return static_cast<int>(unsigned_at(at, 4)); }
  int small(std::size_t at) const { return static_cast<std::int16_t>(unsigned_at(at, 2)); }
  double real(std::size_t at) const { return std::bit_cast<float>(unsigned_at(at, 4)); }

  std::size_t count() const {
    const std::size_t count = unsigned_at(kCountAt, 2);  // 0 where it needs four bytes
    return count > 0 ? count : unsigned_at(kLargeCountAt, 4);
  }

  /// Offsets from the corner of the region as 16 bits, all x before all y; then, where the options say so, coordinates
  /// as floats.
  void read_points(Roi& roi) const {
    const std::size_t points = count();
    const bool has_fractions =
        (unsigned_at(kOptionsAt, 2) & kSubPixel) != 0 && small(kVersionAt) >= kFirstSubPixelVersion;
    const std::size_t needed = points * (has_fractions ? 12 : 4);
    if (points == 0 || needed > bytes_.size() - kPointsAt)
      throw InputError(fmt::format("{}: it says that it has {}; it has {} bytes", path_, text::counted(points, "point"),
                                   bytes_.size()));
    roi.points.resize(2, static_cast<Eigen::Index>(points));
    for (std::size_t i = 0; i < points; ++i)
      for (std::size_t axis = 0; axis < 2; ++axis) {
        double& coordinate = roi.points(static_cast<Eigen::Index>(axis), static_cast<Eigen::Index>(i));
        if (has_fractions)
          coordinate = real(kPointsAt + 4 * points + 4 * (axis * points + i));
        else
          coordinate = small(axis == 0 ? kLeftAt : kTopAt) + std::max(0, small(kPointsAt + 2 * (axis * points + i)));
      }
  }

  void read_second_header(Roi& roi) const {
    const std::size_t at = unsigned_at(kSecondHeaderAt, 4);
    if (at == 0 || at > bytes_.size() || bytes_.size() - at < kSecondHeaderSize) return;
    if (const std::string name = name_of(unsigned_at(at + kNameAt, 4), unsigned_at(at + kNameLengthAt, 4));
        !name.empty())
      roi.name = name;
    const std::size_t counters = unsigned_at(at + kCountersAt, 4);
    if (roi.kind != RoiKind::kPoint || counters == 0) return;
    const std::size_t points = count();
    if (counters > bytes_.size() || points > (bytes_.size() - counters) / 4) return;
    for (std::size_t i = 0; i < points; ++i) roi.positions.push_back(integer(counters + 4 * i) >> 8);
  }

  /// In UTF-16, of which characters beyond ASCII become those of UTF-8.
  std::string name_of(std::size_t at, std::size_t length) const {
    std::string name;
    if (at == 0 || at > bytes_.size() || length > (bytes_.size() - at) / 2) return name;
    for (std::size_t i = 0; i < length; ++i) append_utf8(unsigned_at(at + 2 * i, 2), name);
    return name;
  }

  static void append_utf8(std::uint32_t c, std::string& text) {
    if (c < 0x80U) {
      text += static_cast<char>(c);
    } else if (c < 0x800U) {
      text += static_cast<char>(0xC0U | c >> 6U);
      text += static_cast<char>(0x80U | (c & 0x3FU));
    } else if (c < 0xD800U || c > 0xDFFFU) {
      text += static_cast<char>(0xE0U | c >> 12U);
      text += static_cast<char>(0x80U | (c >> 6U & 0x3FU));
      text += static_cast<char>(0x80U | (c & 0x3FU));
    } else {
      text += '?';
    }
  }

  const std::string& path_;
  std::string_view bytes_;
};

bool is_outline(RoiKind kind) {
  return kind == RoiKind::kPolygon || kind == RoiKind::kFreehand || kind == RoiKind::kTraced;
}

/// Makes shapes of regions: where each has one point, they are the landmarks of a shape for each slice, named by the
/// regions; else each region of several points is a shape, or one for each slice that its points are on.
class RoiShapes {
 public:
  RoiShapes(const std::string& path, std::vector<Roi> rois) : path_(path), rois_(std::move(rois)) {}

  LandmarkFile make() {
    const auto is_set = [](const Roi& roi) { return roi.kind == RoiKind::kPoint && roi.points.cols() > 1; };
    has_sets_ = std::any_of(rois_.begin(), rois_.end(), is_set);
    for (const Roi& roi : rois_)
      if (roi.kind == RoiKind::kPoint) add_points(roi);
    for (const Roi& roi : rois_)
      if (roi.kind != RoiKind::kPoint) add_line(roi);
    for (Part& part : parts_) {
      part.points.move_to(part.shape);
      if (parts_.size() == 1) part.shape.name.clear();  // that of the file
      file_.shapes.push_back(std::move(part.shape));
    }
    if (file_.shapes.empty()) throw InputError(path_ + ": there are no points, lines or polygons among its regions");
    take_lines_where_alone(path_, file_);
    drop_repeated_labels(path_, file_);
    if (unused_ > 0)
      file_.warnings.push_back(fmt::format("{}: {} not used: rectangles, ovals, or lines that belong to no one shape",
                                           path_, text::counted(unused_, "region")));
    return std::move(file_);
  }

 private:
  struct Part {
    std::string key;
    int position = 0;
    Landmarks shape{};
    GatheredPoints points{};
  };

  Part& part_of(const std::string& key, int position) {
    const auto found = std::find_if(parts_.begin(), parts_.end(), [&](const Part& part) { return part.key == key; });
    if (found != parts_.end()) return *found;
    parts_.push_back({key, position});
    parts_.back().shape.name = key;
    return parts_.back();
  }

  void add_points(const Roi& roi) {
    if (!has_sets_) {
      const std::string key = roi.position > 0 ? fmt::format("slice {}", roi.position) : "";
      part_of(key, roi.position).points.add(roi.points.col(0), roi.name);
      return;
    }
    const bool has_slices =
        std::adjacent_find(roi.positions.begin(), roi.positions.end(), std::not_equal_to<>()) != roi.positions.end();
    for (Eigen::Index i = 0; i < roi.points.cols(); ++i) {
      const int position = has_slices ? roi.positions[static_cast<std::size_t>(i)] : roi.position;
      const std::string key = has_slices ? fmt::format("{} slice {}", roi.name, position) : roi.name;
      part_of(key, position).points.add(roi.points.col(i));
    }
  }

  /// To the only shape, or to that of its slice.
  void add_line(const Roi& roi) {
    if (roi.points.cols() < 2) {
      ++unused_;
      return;
    }
    if (parts_.empty()) part_of("", roi.position);
    const auto is_here = [&](const Part& part) { return part.position == roi.position; };
    const auto here = std::count_if(parts_.begin(), parts_.end(), is_here);
    if (parts_.size() > 1 && (here != 1 || roi.position == 0)) {
      ++unused_;
      return;
    }
    Landmarks& shape =
        (parts_.size() == 1 ? parts_.front() : *std::find_if(parts_.begin(), parts_.end(), is_here)).shape;
    (is_outline(roi.kind) ? shape.outlines : shape.curves).push_back(roi.points);
  }

  const std::string& path_;
  std::vector<Roi> rois_;
  bool has_sets_ = false;
  std::vector<Part> parts_;
  LandmarkFile file_;
  std::size_t unused_ = 0;
};

bool is_roi_name(const ZipEntry& entry) { return text::to_lower(entry.name).ends_with(".roi"); }

bool sniff_roi(std::string_view text) {
  if (text.starts_with(kRoiMark)) return true;
  const std::vector<ZipEntry> entries = zip_entries(text);
  return std::any_of(entries.begin(), entries.end(), is_roi_name);
}

LandmarkFile read_roi(const std::string& path, std::string_view text) {
  std::vector<Roi> rois;
  if (!is_zip(text)) {
    rois.push_back(RoiBytes(path, text).read(""));
  } else {
    for (const ZipEntry& entry : zip_entries(text)) {
      if (!is_roi_name(entry)) continue;
      const std::string place = fmt::format("{}: {}", path, text::in_quotes(entry.name));
      rois.push_back(RoiBytes(place, unpacked(path, entry)).read(entry.name.substr(0, entry.name.size() - 4)));
    }
  }
  return RoiShapes(path, std::move(rois)).make();
}

}  // namespace

LandmarkFormat imagej_roi_format() {
  return {.name = "roi",
          .extensions = {"roi"},
          .help =
              "regions of ImageJ, one or those of RoiSet.zip: points are landmarks, with the names of regions or, in "
              "regions of several, each region a shape; polygons are outlines, lines curves",
          .sniff = sniff_roi,
          .read = read_roi,
          .holds_bytes = true,
          .y_down = true};
}

}  // namespace pulson::formats
