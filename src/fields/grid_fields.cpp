#include "pulson/fields/grid_fields.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/factorisations.hpp"
#include "core/paths.hpp"
#include "core/text.hpp"
#include "grid_formats.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::fields {
namespace {

struct GridFormat {
  std::string_view extension;
  bool (*sniff)(std::string_view text);
  Grid (*read)(const std::string& path, std::string_view text, const GridLimits& limits);
  std::string (*file)(const Grid& grid, bool compressed);
};

constexpr GridFormat kFormats[] = {
    {".mha", sniff_meta_image, read_meta_image, meta_image_file},
    {".nrrd", sniff_nrrd, read_nrrd, nrrd_file},
};

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw InputError(fmt::format("grid field '{}': {}", path, why));
}

void check_sizes(const std::string& path, const Grid& field, bool any_components) {
  const std::size_t d = field.sizes.size();
  if (d != 2 && d != 3) refuse(path, fmt::format("its dimension is {}; it must be 2 or 3", d));
  for (const int size : field.sizes)
    if (size < 1) refuse(path, fmt::format("a size is {}; it must be 1 or greater", size));
  if (field.components < 1 || (!any_components && field.components != 1 && field.components != static_cast<int>(d)))
    refuse(path, fmt::format("each point has {} numbers; it must be 1 or, in {}D, {}", field.components, d, d));
}

void check_places(const std::string& path, const Grid& field) {
  const std::size_t d = field.sizes.size();
  if (field.spacing.size() != d || field.origin.size() != d)
    refuse(path, fmt::format("{} and {} of the origin for {} axes", text::counted(field.spacing.size(), "spacing"),
                             text::counted(field.origin.size(), "coordinate"), d));
  for (const double spacing : field.spacing)
    if (!(std::isfinite(spacing) && spacing > 0))
      refuse(path, fmt::format("a spacing is {}; it must be finite and greater than 0", spacing));
  for (const double coordinate : field.origin)
    if (!std::isfinite(coordinate)) refuse(path, fmt::format("the origin has {}; it must be finite", coordinate));
}

void check_direction(const std::string& path, const Grid& field) {
  constexpr double kRounding = 1e-3;  // files may have few digits
  constexpr double kFlat = 1e-6;      // volume that the axes span
  const auto d = static_cast<Eigen::Index>(field.sizes.size());
  const Eigen::MatrixXd& direction = field.direction;
  if (direction.rows() != d || direction.cols() != d)
    refuse(path, fmt::format("the direction is {}×{}; it must be {}×{}", direction.rows(), direction.cols(), d, d));
  if (!direction.allFinite() || ((direction.colwise().norm().array() - 1).abs() > kRounding).any() ||
      std::abs(direction.determinant()) < kFlat)
    refuse(path, "the directions of its axes must be unit vectors that span the space");
}

void check(const std::string& path, const Grid& field, bool any_components) {
  check_sizes(path, field, any_components);
  check_places(path, field);
  check_direction(path, field);
}

void write(const std::filesystem::path& path, Grid grid, bool compressed, bool any_components) {
  const std::string extension = text::to_lower(path.extension().string());
  const auto* const format = std::find_if(std::begin(kFormats), std::end(kFormats),
                                          [&](const GridFormat& f) { return f.extension == extension; });
  if (format == std::end(kFormats))
    refuse(path.string(), fmt::format("its extension is {}; it must be .mha or .nrrd", text::in_quotes(extension)));
  const auto d = static_cast<Eigen::Index>(grid.sizes.size());
  if (grid.direction.size() == 0) grid.direction = Eigen::MatrixXd::Identity(d, d);
  check(path.string(), grid, any_components);
  const std::size_t values = grid.bytes.size() / byte_count(grid.type);
  if (const auto count = grid_count(grid.sizes, grid.components); count != values)
    refuse(path.string(), fmt::format("it has {}; sizes {} of {} need {}", text::counted(values, "value"),
                                      fmt::join(grid.sizes, " × "), text::counted(grid.components, "number"),
                                      count ? std::to_string(*count) : "too many"));
  write_file_atomically(path, format->file(grid, compressed));
}

Grid read(const std::filesystem::path& path, const GridLimits& limits) {
  const std::string text = read_file(path);
  if (text.empty()) throw InputError(path.string() + " is empty");
  const auto* const format =
      std::find_if(std::begin(kFormats), std::end(kFormats), [&](const GridFormat& f) { return f.sniff(text); });
  if (format == std::end(kFormats))
    throw InputError(path.string() + " is neither MetaImage (.mha) nor NRRD (.nrrd); it begins with " +
                     text::in_quotes(std::string_view(text).substr(0, text.find_first_of("\r\n"))));
  Grid grid = format->read(path.string(), text, limits);
  check(path.string(), grid, limits.any_components);
  return grid;
}

/// The nearest number that the type has; 0 for NaN.
template <class T>
T nearest(float value) {
  if constexpr (std::is_floating_point_v<T>) {
    return value;
  } else {
    using Limits = std::numeric_limits<T>;
    if (std::isnan(value)) return 0;
    const double whole = std::nearbyint(static_cast<double>(value));
    if (whole <= static_cast<double>(Limits::lowest())) return Limits::lowest();
    return whole >= static_cast<double>(Limits::max()) ? Limits::max() : static_cast<T>(whole);
  }
}

}  // namespace

Grid grid_of(const GridField& field) {
  Grid grid{field.sizes, field.spacing, field.origin, field.components, field.direction, field.type};
  grid.bytes.resize(field.values.size() * byte_count(field.type));
  with_number_type(field.type, [&]<class T>() {
    std::byte* to = grid.bytes.data();
    for (const float value : field.values) {
      const T number = nearest<T>(value);
      std::memcpy(to, &number, sizeof(T));
      to += sizeof(T);
    }
  });
  return grid;
}

GridField field_of(Grid grid) {
  GridField field{std::move(grid.sizes),
                  std::move(grid.spacing),
                  std::move(grid.origin),
                  grid.components,
                  {},
                  std::move(grid.direction),
                  grid.type};
  field.values.resize(grid.bytes.size() / byte_count(grid.type));
  with_number_type(grid.type, [&]<class T>() {
    const std::byte* from = grid.bytes.data();
    for (float& value : field.values) {
      T number;
      std::memcpy(&number, from, sizeof(T));
      value = static_cast<float>(number);
      from += sizeof(T);
    }
  });
  return field;
}

void write_grid(const std::filesystem::path& path, const Grid& grid) { write(path, grid, grid.is_compressed, true); }

void write_grid_field(const std::filesystem::path& path, const GridField& field, bool compressed) {
  write(path, grid_of(field), compressed, false);
}

Grid read_grid(const std::filesystem::path& path, std::uint64_t max_points) { return read(path, {max_points, true}); }

GridField read_grid_field(const std::filesystem::path& path, std::uint64_t max_points) {
  return field_of(read(path, {max_points, false}));
}

}  // namespace pulson::fields
