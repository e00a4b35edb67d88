#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/file_kinds.hpp"
#include "core/text.hpp"
#include "formats.hpp"
#include "frames_of_files.hpp"
#include "held_shapes.hpp"
#include "missing_marks.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "shape_options.hpp"

namespace pulson::formats {

const std::vector<LandmarkFormat>& landmark_formats() {
  using namespace text;
  static const std::vector<LandmarkFormat> formats = {
      npy_format(),         npz_format(),     imagej_roi_format(), vtk_format(),          fcsv_format(),
      markups_format(),     labelme_format(), menpo_format(),      coco_format(),         openpose_format(),
      via_json_format(),    geojson_format(), dlib_format(),       cvat_format(),         fiji_format(),
      meshlab_format(),     json_format(),    tps_format(),        ibug_format(),         elastix_format(),
      transformix_format(), idav_format(),    nts_format(),        morphologika_format(), edma_format(),
      stereomorph_format(), amira_format(),   via_csv_format(),    deeplabcut_format(),   bigwarp_format(),
      cmtk_format(),        csv_format()};
  return formats;
}

std::vector<std::string> landmark_format_names() {
  std::vector<std::string> names;
  for (const LandmarkFormat& format : landmark_formats()) names.push_back(format.name);
  return names;
}

bool is_image(std::string_view contents) {
  using namespace std::string_view_literals;
  const std::array marks = {"\x89PNG"sv, "\xFF\xD8\xFF"sv, "GIF8"sv, "II*\0"sv, "MM\0*"sv, "BM"sv};
  return contents.find('\0') != std::string_view::npos &&
         std::any_of(marks.begin(), marks.end(), [&](std::string_view mark) { return contents.starts_with(mark); });
}

namespace {

std::string first_line(std::string_view contents) {
  const std::size_t begin = contents.find_first_not_of(" \t\r\n");
  contents.remove_prefix(begin);
  return text::in_quotes(contents.substr(0, contents.find_first_of("\r\n")));
}

std::string extension_of(const std::filesystem::path& path) {
  const std::string dotted = text::to_lower(path.extension().string());
  return dotted.substr(std::min<std::size_t>(1, dotted.size()));
}

/// @throws InputError that names the kind of a file that is none of landmarks
void require_no_other_kind(const std::filesystem::path& path, std::string_view contents) {
  if (const std::optional<FileKind> kind = kind_of_bytes(contents))
    throw InputError(fmt::format("{} is {}; {}", path.string(), kind->name, kind->remedy));
}

/// How long the extension of `format` is that the file's name ends in; 0 where there is none.
std::size_t matched_length(const std::filesystem::path& path, const LandmarkFormat& format) {
  const std::string name = text::to_lower(path.filename().string());
  std::size_t longest = 0;
  for (const std::string& extension : format.extensions)
    if (name.ends_with("." + extension)) longest = std::max(longest, extension.size());
  return longest;
}

/// The only format with the longest extension that the file's name ends in, as `mrk.json` is longer than `json`; null
/// where several have it, or none.
const LandmarkFormat* format_by_extension(const std::filesystem::path& path) {
  const LandmarkFormat* found = nullptr;
  std::size_t longest = 0;
  for (const LandmarkFormat& format : landmark_formats()) {
    const std::size_t length = matched_length(path, format);
    if (length == 0 || length < longest) continue;
    found = length > longest ? &format : nullptr;
    longest = length;
  }
  return found;
}

const LandmarkFormat& format_named(std::string_view name) {
  const auto& formats = landmark_formats();
  const auto found = std::find_if(formats.begin(), formats.end(), [&](const auto& row) { return row.name == name; });
  if (found != formats.end()) return *found;
  throw InputError(fmt::format("'{}' is not a landmark format{}", name, advice_on_name(name, landmark_format_names())));
}

bool is_table(const LandmarkFormat& format) {
  return format.name == "csv" || format.name == "deeplabcut" || format.name == "bigwarp";
}

bool describes_table(const ReadOptions& options) { return !options.columns.empty() || options.dimension > 0; }

const LandmarkFormat& find_format(const std::filesystem::path& path, std::string_view contents,
                                  const ReadOptions& options) {
  const auto& formats = landmark_formats();
  if (!options.format.empty()) {
    const LandmarkFormat& named = format_named(options.format);
    if (!named.holds_bytes) require_no_other_kind(path, contents);
    return named;
  }
  const auto by_content =
      std::find_if(formats.begin(), formats.end(), [&](const LandmarkFormat& f) { return f.sniff(contents); });
  const bool is_unknown = by_content == formats.end();
  if (is_unknown) require_no_other_kind(path, contents);
  if (describes_table(options) && (is_unknown || is_table(*by_content))) return format_named("csv");
  if (!is_unknown) return *by_content;
  if (const LandmarkFormat* by_extension = format_by_extension(path)) return *by_extension;
  throw InputError(fmt::format("{} is not in any of the landmark formats ({}); it begins with {}", path.string(),
                               fmt::join(landmark_format_names(), ", "), first_line(contents)));
}

}  // namespace

std::string file_stem(const std::filesystem::path& path) {
  std::size_t longest = 0;
  for (const LandmarkFormat& format : landmark_formats()) longest = std::max(longest, matched_length(path, format));
  const std::string name = path.filename().string();
  return longest > 0 && longest + 1 < name.size() ? name.substr(0, name.size() - longest - 1) : path.stem().string();
}

std::string name_by_file(const std::filesystem::path& path) {
  const std::string stem = file_stem(path);
  return is_utf8(stem) ? stem : utf8_of_windows_1252(stem);
}

namespace {

void name_shapes(const std::filesystem::path& path, std::vector<Landmarks>& shapes) {
  const bool is_alone = shapes.size() == 1;
  const std::string stem = name_by_file(path);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const std::string number = is_alone ? "" : fmt::format("#{}", i + 1);
    shapes[i].source = path.string() + number;
    if (shapes[i].name.empty()) shapes[i].name = stem + number;
  }
}

/// Replaces zero bytes, which JSON can hold and no table can, in names of shapes and landmarks by U+FFFD.
void replace_zero_bytes(const std::string& path, LandmarkFile& file) {
  bool is_changed = false;
  const auto replace = [&](std::string& text) {
    for (std::size_t at = text.find('\0'); at != std::string::npos; at = text.find('\0', at)) {
      text.replace(at, 1, "\xEF\xBF\xBD");
      is_changed = true;
    }
  };
  for (Landmarks& shape : file.shapes) {
    replace(shape.name);
    for (std::string& label : shape.labels) replace(label);
    for (std::string& group : shape.groups) replace(group);
  }
  if (is_changed) file.warnings.push_back(path + ": zero bytes in names are read as U+FFFD");
}

// A table that names images, or has pixels, is of places in images.
bool is_of_image(const LandmarkFormat& format, const Landmarks& shape) {
  return is_table(format) && (!shape.image.empty() || shape.units == "px");
}

}  // namespace

const LandmarkFormat& landmark_format_to_write(const std::filesystem::path& path, std::string_view name) {
  std::vector<std::string> writable;
  for (const LandmarkFormat& format : landmark_formats()) {
    if (format.write == nullptr) continue;
    if (name.empty() ? matched_length(path, format) > 0 : name == format.name) return format;
    writable.push_back(format.name);
  }
  if (name.empty())
    throw InputError(
        fmt::format("{}: the extension '{}' is not of a landmark format that can be written ({}); name one",
                    path.string(), extension_of(path), fmt::join(writable, ", ")));
  throw InputError(fmt::format("{}: '{}' is not a landmark format that can be written{}", path.string(), name,
                               advice_on_name(name, writable)));
}

WrittenLandmarks text_of_landmarks(const std::filesystem::path& path, LandmarkFile file, const LandmarkFormat& format) {
  std::vector<std::string> notes;
  for (Landmarks& shape : file.shapes) put_y_in_direction(path.string(), format, shape, notes);
  WrittenLandmarks written = format.write(path.string(), file);
  written.losses.insert(written.losses.begin(), notes.begin(), notes.end());
  return written;
}

std::vector<std::string> write_landmark_file(const std::filesystem::path& path, const LandmarkFile& file,
                                             std::string_view format) {
  WrittenLandmarks written = text_of_landmarks(path, file, landmark_format_to_write(path, format));
  write_file_atomically(path, written.text);
  return std::move(written.losses);
}

LandmarkFile read_all_shapes(const std::filesystem::path& given, const ReadOptions& options) {
  if (const LandmarkFile* held = held_shapes(given)) {
    LandmarkFile file = *held;
    prepare_shapes(options, given.string(), file);
    if (options.y_down)
      for (Landmarks& shape : file.shapes) shape.frame.y_down = *options.y_down && shape.dimension() == 2;
    mark_missing(options, given.string(), file);
    return file;
  }
  const bool is_standard_input = given == "-" || given == text::kStandardInput;
  const std::filesystem::path path = is_standard_input ? "standard input" : given;
  return shapes_of_text(path, is_standard_input ? text::read_standard_input() : text::read_text_file(path), options);
}

const LandmarkFormat& landmark_format_of(const std::filesystem::path& path, std::string_view text,
                                         const ReadOptions& options) {
  return find_format(path, text, options);
}

LandmarkFile shapes_of_text(const std::filesystem::path& path, std::string contents, const ReadOptions& options) {
  const LandmarkFormat& format = find_format(path, contents, options);
  const bool is_recoded = !format.holds_bytes && !is_utf8(contents);
  if (is_recoded) contents = utf8_of_windows_1252(contents);
  LandmarkFile file = describes_table(options) && format.name == "csv" ? read_table(path.string(), contents, options)
                                                                       : format.read(path.string(), contents);
  file.format = format.name;
  prepare_shapes(options, path.string(), file);
  for (Landmarks& shape : file.shapes) {
    shape.units = file.units;
    shape.axes = file.axes;
    complete_frame(format, is_of_image(format, shape), options, shape);
  }
  if (!options.columns.empty() && format.name != "csv")
    file.warnings.push_back(
        fmt::format("{}: it is not a table but {}; the names of columns are not used", path.string(), format.name));
  if (is_recoded) file.warnings.push_back(path.string() + ": it is not in UTF-8, and read as Windows-1252");
  name_shapes(path, file.shapes);
  replace_zero_bytes(path.string(), file);
  mark_missing(options, path.string(), file);
  return file;
}

LandmarkFile read_landmark_file(const std::filesystem::path& path, const ReadOptions& options) {
  LandmarkFile file = read_all_shapes(path, options);
  apply_to_shapes(options, file);
  return file;
}

}  // namespace pulson::formats
