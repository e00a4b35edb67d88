#include "pulson/fields/grid_fields.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

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
  GridField (*read)(const std::string& path, std::string_view text, std::uint64_t max_points);
  std::string (*file)(const GridField& field, bool compressed);
};

constexpr GridFormat kFormats[] = {
    {".mha", sniff_meta_image, read_meta_image, meta_image_file},
    {".nrrd", sniff_nrrd, read_nrrd, nrrd_file},
};

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw InputError(fmt::format("grid field '{}': {}", path, why));
}

void check_sizes(const std::string& path, const GridField& field) {
  const std::size_t d = field.sizes.size();
  if (d != 2 && d != 3) refuse(path, fmt::format("its dimension is {}; it must be 2 or 3", d));
  for (const int size : field.sizes)
    if (size < 1) refuse(path, fmt::format("a size is {}; it must be 1 or greater", size));
  if (field.components != 1 && field.components != static_cast<int>(d))
    refuse(path, fmt::format("each point has {} numbers; it must be 1 or, in {}D, {}", field.components, d, d));
}

void check_places(const std::string& path, const GridField& field) {
  const std::size_t d = field.sizes.size();
  if (field.spacing.size() != d || field.origin.size() != d)
    refuse(path, fmt::format("{} and {} of the origin for {} axes", io::counted(field.spacing.size(), "spacing"),
                             io::counted(field.origin.size(), "coordinate"), d));
  for (const double spacing : field.spacing)
    if (!(std::isfinite(spacing) && spacing > 0))
      refuse(path, fmt::format("a spacing is {}; it must be finite and greater than 0", spacing));
  for (const double coordinate : field.origin)
    if (!std::isfinite(coordinate)) refuse(path, fmt::format("the origin has {}; it must be finite", coordinate));
}

void check_direction(const std::string& path, const GridField& field) {
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

void check(const std::string& path, const GridField& field) {
  check_sizes(path, field);
  check_places(path, field);
  check_direction(path, field);
}

}  // namespace

void write_grid_field(const std::filesystem::path& path, const GridField& field, bool compressed) {
  const std::string extension = io::to_lower(path.extension().string());
  const auto* const format = std::find_if(std::begin(kFormats), std::end(kFormats),
                                          [&](const GridFormat& f) { return f.extension == extension; });
  if (format == std::end(kFormats))
    refuse(path.string(), fmt::format("its extension is {}; it must be .mha or .nrrd", io::in_quotes(extension)));
  GridField whole = field;
  const auto d = static_cast<Eigen::Index>(field.sizes.size());
  if (whole.direction.size() == 0) whole.direction = Eigen::MatrixXd::Identity(d, d);
  check(path.string(), whole);
  if (const auto count = grid_count(whole.sizes, whole.components); count != whole.values.size())
    refuse(path.string(), fmt::format("it has {}; sizes {} of {} need {}", io::counted(whole.values.size(), "value"),
                                      fmt::join(whole.sizes, " × "), io::counted(whole.components, "number"),
                                      count ? std::to_string(*count) : "too many"));
  write_file_atomically(path, format->file(whole, compressed));
}

GridField read_grid_field(const std::filesystem::path& path, std::uint64_t max_points) {
  const std::string text = read_file(path);
  if (text.empty()) throw InputError(path.string() + " is empty");
  const auto* const format =
      std::find_if(std::begin(kFormats), std::end(kFormats), [&](const GridFormat& f) { return f.sniff(text); });
  if (format == std::end(kFormats))
    throw InputError(path.string() + " is neither MetaImage (.mha) nor NRRD (.nrrd); it begins with " +
                     io::in_quotes(std::string_view(text).substr(0, text.find_first_of("\r\n"))));
  GridField field = format->read(path.string(), text, max_points);
  check(path.string(), field);
  return field;
}

}  // namespace pulson::fields
