#include <algorithm>
#include <string>

#include <fmt/format.h>

#include "core/text.hpp"
#include "grid_formats.hpp"

namespace pulson::fields {
namespace {

constexpr std::string_view kNrrdMagic = "NRRD000";
constexpr std::string_view kLps = "left-posterior-superior";

using Lines = std::vector<std::pair<std::string, std::string>>;

/// Takes the header off `text`, with the empty line that ends it. @param lines of `key:=value`
GridHeader take_nrrd_header(const std::string& path, std::string_view& text, Lines& lines) {
  GridHeader header(path);
  take_header_line(text);
  for (std::size_t line = 2;; ++line) {
    if (text.empty()) text::fail(path, line, "the file ends in its header; an empty line and the numbers are needed");
    const std::string_view entry = take_header_line(text);
    if (entry.empty()) return header;
    const std::size_t colon = entry.find(':');
    if (entry.starts_with('#')) continue;
    if (entry.substr(std::min(colon, entry.size())).starts_with(":=")) {
      lines.emplace_back(entry.substr(0, colon), entry.substr(colon + 2));
      continue;
    }
    if (colon == std::string_view::npos)
      text::fail(path, line, text::in_quotes(entry) + " is in the header; 'field: value' is needed");
    header.add(line, entry.substr(0, colon), entry.substr(colon + 1));
  }
}

/// `(1,2) none (3, 4)` as vectors of d numbers; none is an empty one.
std::vector<std::vector<double>> vectors(const GridHeader& header, const HeaderEntry& entry, std::size_t d) {
  std::vector<std::vector<double>> result;
  for (std::string_view left = entry.value; !left.empty(); left = text::trim(left)) {
    const std::size_t end = left.find(')');
    if (left.starts_with("none")) {
      result.emplace_back();
      left.remove_prefix(4);
    } else if (left.starts_with('(') && end != std::string_view::npos) {
      std::string numbers(left.substr(1, end - 1));
      std::replace(numbers.begin(), numbers.end(), ',', ' ');
      result.push_back(header.numbers(entry, numbers, d));
      left.remove_prefix(end + 1);
    } else {
      header.refuse(entry, "vectors such as (1,0) are needed");
    }
  }
  return result;
}

/// Whether the first axis, of `axes`, is of components: its kind says so, or that it has no direction.
bool has_components(const GridHeader& header, std::size_t axes) {
  bool result = axes == 4;
  if (const HeaderEntry* const directions = header.find({"space directions"}))
    result = directions->value.starts_with("none");
  const HeaderEntry* const entry = header.find({"kinds"});
  if (entry == nullptr) return result;
  const auto is_of_space = [](std::string_view kind) { return kind == "domain" || kind == "space"; };
  const auto is_unknown = [](std::string_view kind) { return kind == "none" || kind == "???"; };
  const std::vector<std::string_view> kinds = text::split_words(entry->value);
  if (kinds.size() != axes) header.refuse(*entry, text::counted(axes, "kind") + " are needed");
  if (!std::all_of(kinds.begin() + 1, kinds.end(), [&](auto kind) { return is_of_space(kind) || is_unknown(kind); }))
    header.refuse(*entry, "the axis of components must be the first and the others domain");
  return is_unknown(kinds.front()) ? result : !is_of_space(kinds.front());
}

void check_space(const GridHeader& header, int d) {
  if (const HeaderEntry* const space = header.find({"space"})) {
    const std::string name = text::to_lower(space->value);
    if (d != 3 || (name != kLps && name != "lps"))
      header.refuse(*space, fmt::format("it must be {} in 3D and not be there in 2D", kLps));
  } else if (const HeaderEntry* const dimension = header.find({"space dimension"})) {
    if (header.counts(*dimension, 1).front() != d)
      header.refuse(*dimension, fmt::format("the grid has {} axes in space", d));
  }
  if (const HeaderEntry* const minima = header.find({"axis mins", "axismins"}))
    header.refuse(*minima, "positions are read from space origin and space directions");
}

/// `before` the axes of space there are so many others, 0 or 1.
void read_directions(const GridHeader& header, std::size_t before, Grid& field) {
  const auto d = static_cast<Eigen::Index>(field.sizes.size());
  field.direction = Eigen::MatrixXd::Identity(d, d);
  field.spacing.assign(d, 1);
  if (const HeaderEntry* const directions = header.find({"space directions"})) {
    const auto axes = vectors(header, *directions, d);
    if (axes.size() != d + before) header.refuse(*directions, text::counted(d + before, "vector") + " are needed");
    for (Eigen::Index k = 0; k < d; ++k) {
      if (axes[k + before].empty()) header.refuse(*directions, "each axis in space needs a vector");
      const Eigen::VectorXd axis = Eigen::VectorXd::Map(axes[k + before].data(), d);
      field.spacing[k] = axis.stableNorm();  // exact along an axis of space
      field.direction.col(k) = axis / field.spacing[k];
    }
  } else if (const HeaderEntry* const spacings = header.find({"spacings"})) {
    const std::size_t first = std::min(spacings->value.find(' '), spacings->value.size());
    field.spacing = header.numbers(*spacings, spacings->value.substr(before * first), d);
  }
}

/// A measurement frame other than the identity would turn the vectors.
void check_frame(const GridHeader& header, std::size_t d) {
  const HeaderEntry* const frame = header.find({"measurement frame"});
  if (frame == nullptr) return;
  const auto columns = vectors(header, *frame, d);
  for (std::size_t k = 0; k < columns.size(); ++k)
    for (std::size_t i = 0; i < columns[k].size(); ++i)
      if (columns[k][i] != (i == k ? 1 : 0))
        header.refuse(*frame, "vectors are read only in the frame of the identity");
}

GridBytes bytes_of_nrrd(const GridHeader& header, std::string_view text) {
  if (const HeaderEntry* const file = header.find({"data file"}))
    header.refuse(*file, "numbers in another file are not read; they must follow the header");
  for (const std::string_view key : {"line skip", "byte skip"})
    if (const HeaderEntry* const skip = header.find({key}); skip != nullptr && skip->value != "0")
      header.refuse(*skip, "it must be 0");
  const HeaderEntry& name = header.need({"type"});
  const GridNumberType* const type = find_nrrd_type(name.value);
  if (type == nullptr) header.refuse(name, "it must be float, double or a whole type such as uint8");
  const HeaderEntry& encoding = header.need({"encoding"});
  const std::string how = text::to_lower(encoding.value);
  const bool is_compressed = how == "gzip" || how == "gz";
  if (!is_compressed && how != "raw") header.refuse(encoding, "it must be raw or gzip");
  bool is_big_endian = false;
  if (byte_count(type->type) > 1) {
    const HeaderEntry& endian = header.need({"endian"});
    is_big_endian = text::to_lower(endian.value) == "big";
    if (!is_big_endian && text::to_lower(endian.value) != "little") header.refuse(endian, "it must be little or big");
  }
  return {text, *type, is_big_endian, is_compressed};
}

std::string in_brackets(const auto& numbers) { return fmt::format("({})", fmt::join(numbers, ",")); }

}  // namespace

bool sniff_nrrd(std::string_view text) { return text.starts_with(kNrrdMagic); }

Grid read_nrrd(const std::string& path, std::string_view text, const GridLimits& limits) {
  Grid field;
  const GridHeader header = take_nrrd_header(path, text, field.lines);
  const HeaderEntry& dimension = header.need({"dimension"});
  const int axes = header.counts(dimension, 1).front();
  if (axes < 2 || axes > 4) header.refuse(dimension, "it must be 2 or 3, or with an axis of components 3 or 4");
  const HeaderEntry& sizes = header.need({"sizes"});
  field.sizes = header.counts(sizes, axes);
  if (has_components(header, axes)) {
    field.components = field.sizes.front();
    field.sizes.erase(field.sizes.begin());
    if (const HeaderEntry* const kinds = header.find({"kinds"})) field.kind = text::split_words(kinds->value).front();
  }
  const auto d = static_cast<int>(field.sizes.size());
  if (d != 2 && d != 3) header.refuse(dimension, fmt::format("its axes of space are {}, and must be 2 or 3", d));
  if (!limits.any_components && field.components != 1 && field.components != d)
    header.refuse(sizes, fmt::format("the axis of components must have size 1 or {}", d));
  check_space(header, d);
  read_directions(header, axes - d, field);
  if (!limits.any_components && field.components > 1) check_frame(header, d);
  field.origin.assign(d, 0);
  if (const HeaderEntry* const origin = header.find({"space origin"})) {
    const auto places = vectors(header, *origin, d);
    if (places.size() != 1 || places.front().empty()) header.refuse(*origin, "one vector is needed");
    field.origin = places.front();
  }
  const GridBytes bytes = bytes_of_nrrd(header, text);
  field.type = bytes.type.type;
  field.is_compressed = bytes.is_compressed;
  field.bytes = grid_bytes(path, bytes, field.sizes, field.components, limits.max_points);
  return field;
}

std::string nrrd_file(const Grid& field, bool compressed) {
  const std::size_t d = field.sizes.size();
  const bool has_vectors = field.components > 1;
  std::string directions = has_vectors ? " none" : "", kinds;
  if (has_vectors) kinds = " " + (field.kind.empty() ? std::string("vector") : field.kind);
  std::string lines;
  for (const auto& [key, value] : field.lines) lines += fmt::format("{}:={}\n", key, value);
  for (std::size_t k = 0; k < d; ++k) {
    const Eigen::VectorXd axis = field.spacing[k] * field.direction.col(static_cast<Eigen::Index>(k));
    directions += fmt::format(" {}", in_brackets(axis));
    kinds += " domain";
  }
  return fmt::format(
             "NRRD0004\ntype: {}\ndimension: {}\n{}\nsizes: {}{}\nspace directions:{}\nkinds:{}\nendian: little\n"
             "encoding: {}\nspace origin: {}\n{}\n",
             grid_number_type(field.type).nrrd_name(), has_vectors ? d + 1 : d,
             d == 3 ? fmt::format("space: {}", kLps) : fmt::format("space dimension: {}", d),
             has_vectors ? fmt::format("{} ", field.components) : "", fmt::join(field.sizes, " "), directions, kinds,
             compressed ? "gzip" : "raw", in_brackets(field.origin), lines) +
         encoded(field.bytes, compressed ? GridEncoding::kGzip : GridEncoding::kRaw);
}

}  // namespace pulson::fields
