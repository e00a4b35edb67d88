#include "carried_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>

#include <fmt/format.h>

#include "core/paths.hpp"
#include "core/text.hpp"
#include "formats/formats.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

template <class Number>
void append_ordered(std::string& out, double value, bool is_big) {
  std::array<char, sizeof(Number)> bytes{};
  const auto number = static_cast<Number>(value);
  std::memcpy(bytes.data(), &number, sizeof(Number));
  if (is_big != (std::endian::native == std::endian::big)) std::reverse(bytes.begin(), bytes.end());
  out.append(bytes.data(), bytes.size());
}

template <class Number>
double ordered_number(const char* bytes, bool is_big) {
  std::array<char, sizeof(Number)> raw{};
  std::memcpy(raw.data(), bytes, sizeof(Number));
  if (is_big != (std::endian::native == std::endian::big)) std::reverse(raw.begin(), raw.end());
  return static_cast<double>(std::bit_cast<Number>(raw));
}

}  // namespace

double number_of_bytes(const char* bytes, NumberCoding coding) {
  const bool is_big = coding == NumberCoding::kBigFloat || coding == NumberCoding::kBigDouble;
  const bool is_float = coding == NumberCoding::kFloat || coding == NumberCoding::kBigFloat;
  return is_float ? ordered_number<float>(bytes, is_big) : ordered_number<double>(bytes, is_big);
}

void CarriedFile::add_place(std::size_t begin, std::size_t length, std::uint32_t value, NumberCoding coding) {
  if (length > std::size_t{NumberPlace::kLongest}) throw InputError(fmt::format("a number has {} characters", length));
  places_.push_back({begin, static_cast<std::uint32_t>(length) & NumberPlace::kLongest, coding, value});
}

void CarriedFile::leave_out(std::size_t begin, std::size_t end) {
  for (std::size_t length = 0; begin < end; begin += length) {
    length = std::min(std::size_t{NumberPlace::kLongest}, end - begin);
    add_place(begin, length, NumberPlace::kNoValue);
  }
}

void CarriedFile::sort_places() {
  const auto by_begin = [](const auto& a, const auto& b) { return a.begin < b.begin; };
  if (!std::is_sorted(places_.begin(), places_.end(), by_begin)) std::sort(places_.begin(), places_.end(), by_begin);
}

void CarriedFile::take_plane() {
  const auto [low, high] = bounding_box(shape.points);
  if (low[2] != high[2]) return;
  keep_z();
  shape.points = Points(shape.points.topRows(2));
  normals.resize(3, 0);
  normal_points.clear();
}

void CarriedFile::keep_z() {
  std::erase_if(places_, [](NumberPlace& place) {
    if (place.value == NumberPlace::kNoValue) return false;
    const bool stays = (place.value & NumberPlace::kNormal) != 0 || place.value % 3 == 2;
    place.value = place.value / 3 * 2 + place.value % 3;
    return stays;
  });
}

void CarriedFile::use_decimal_commas(bool are_between_commas) {
  has_decimal_commas_ = true;
  quotes_decimal_commas_ = are_between_commas;
}

std::string CarriedFile::with(const Points& points, const Points& new_normals) const {
  return replaced(text_, points, new_normals);
}

std::string CarriedFile::replaced(std::string_view source, const Points& points, const Points& new_normals) const {
  std::string out;
  out.reserve(source.size() + 8 * places_.size());
  std::size_t at = 0;
  for (const NumberPlace& place : places_) {
    out.append(source, at, place.begin - at);
    at = place.begin + place.length;
    if (place.value == NumberPlace::kNoValue) continue;
    const bool is_normal = (place.value & NumberPlace::kNormal) != 0;
    append(out, source, place,
           is_normal ? new_normals.data()[place.value ^ NumberPlace::kNormal] : points.data()[place.value]);
  }
  out.append(source, at);
  return out;
}

void CarriedFile::append(std::string& out, std::string_view source, const NumberPlace& place, double value) const {
  switch (place.coding) {
    case NumberCoding::kText:
    case NumberCoding::kTextOfFloat:
      append_text(out, source, place, value);
      break;
    case NumberCoding::kFloat:
    case NumberCoding::kBigFloat:
      append_ordered<float>(out, value, place.coding == NumberCoding::kBigFloat);
      break;
    case NumberCoding::kDouble:
    case NumberCoding::kBigDouble:
      append_ordered<double>(out, value, place.coding == NumberCoding::kBigDouble);
      break;
  }
}

void CarriedFile::append_text(std::string& out, std::string_view source, const NumberPlace& place, double value) const {
  if (std::isnan(value)) {
    out += missing_mark_;
    return;
  }
  const std::size_t begin = out.size();
  if (place.coding == NumberCoding::kTextOfFloat)
    fmt::format_to(std::back_inserter(out), "{}", static_cast<float>(value));
  else
    fmt::format_to(std::back_inserter(out), "{}", value);
  if (!has_decimal_commas_) return;
  const std::size_t point = out.find('.', begin);
  if (point == std::string::npos) return;
  out[point] = ',';
  if (!quotes_decimal_commas_ || (place.begin > 0 && source[place.begin - 1] == '"')) return;
  out.insert(begin, 1, '"');
  out += '"';
}

namespace {

struct MeshKind {
  const char* extension;
  std::unique_ptr<CarriedFile> (*carry)(const std::string& path, std::string text);
};

constexpr std::array<MeshKind, 5> kMeshes = {
    {{".ply", carry_ply}, {".obj", carry_obj}, {".stl", carry_stl}, {".vtk", carry_vtk}, {".vtp", carry_vtp}}};

const MeshKind* mesh_kind(const std::filesystem::path& path) {
  const std::string extension = text::to_lower(path.extension().string());
  const auto* const found =
      std::find_if(kMeshes.begin(), kMeshes.end(), [&](const MeshKind& kind) { return extension == kind.extension; });
  return found == kMeshes.end() ? nullptr : found;
}

}  // namespace

bool is_mesh_file(const std::filesystem::path& path) { return mesh_kind(path) != nullptr; }

std::unique_ptr<CarriedFile> carry(const std::string& path, std::string text, const ReadOptions& options,
                                   int dimension) {
  if (!options.landmarks.empty() || options.curve_points > 0 || options.applies_scale) return nullptr;
  if (const MeshKind* const kind = options.format.empty() ? mesh_kind(path) : nullptr) {
    std::unique_ptr<CarriedFile> file = kind->carry(path, std::move(text));
    file->shape.source = path;
    if (file->shape.count() == 0) throw InputError(path + " has no points");
    if (dimension == 2) file->take_plane();
    return file;
  }
  const std::string format = landmark_format_of(path, text, options).name;
  if (format == "fcsv") return carry_fcsv(path, std::move(text), options);
  if (format == "deeplabcut") return carry_deeplabcut(path, std::move(text), options);
  return format == "csv" ? carry_table(path, std::move(text), options) : nullptr;
}

std::unique_ptr<CarriedFile> read_carried_file(const std::filesystem::path& path, const ReadOptions& options,
                                               int dimension) {
  const std::string name = path.string();
  const auto contents = [&] {
    if (is_mesh_file(path)) return read_file(path);
    return name == text::kStandardInput ? text::read_standard_input() : text::read_text_file(path);
  };
  return carry(name, contents(), options, dimension);
}

}  // namespace pulson::formats
