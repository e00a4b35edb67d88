#include <algorithm>
#include <string>

#include <fmt/format.h>

#include "core/text.hpp"
#include "grid_formats.hpp"

namespace pulson::fields {
namespace {

constexpr std::string_view kLocal = "LOCAL";

/// What is written of every grid, and other names for it.
constexpr std::string_view kWrittenKeys[] = {"ObjectType",
                                             "NDims",
                                             "BinaryData",
                                             "BinaryDataByteOrderMSB",
                                             "ElementByteOrderMSB",
                                             "DimSize",
                                             "CompressedData",
                                             "CompressedDataSize",
                                             "TransformMatrix",
                                             "Rotation",
                                             "Orientation",
                                             "Offset",
                                             "Origin",
                                             "Position",
                                             "CenterOfRotation",
                                             "ElementType",
                                             "ElementSpacing",
                                             "ElementSize",
                                             "ElementNumberOfChannels",
                                             "HeaderSize",
                                             "ElementMin",
                                             "ElementMax",
                                             "ElementDataFile"};

/// Takes the header off `text`; ElementDataFile is its last line.
GridHeader take_meta_header(const std::string& path, std::string_view& text) {
  GridHeader header(path);
  for (std::size_t line = 1; !text.empty(); ++line) {
    const std::string_view entry = take_header_line(text);
    if (text::trim(entry).empty()) continue;
    const std::size_t equals = entry.find('=');
    if (equals == std::string_view::npos)
      text::fail(path, line, text::in_quotes(entry) + " is in the header; 'Key = value' is needed");
    header.add(line, text::trim(entry.substr(0, equals)), entry.substr(equals + 1));
    if (header.find({"ElementDataFile"}) != nullptr) break;
  }
  const HeaderEntry& file = header.need({"ElementDataFile"});
  if (file.value != kLocal)
    header.refuse(file, "numbers in another file are not read; they must be in this one (LOCAL)");
  return header;
}

bool flag(const GridHeader& header, std::initializer_list<std::string_view> keys, bool otherwise) {
  const HeaderEntry* const entry = header.find(keys);
  if (entry == nullptr) return otherwise;
  const std::string value = text::to_lower(entry->value);
  if (value != "true" && value != "false") header.refuse(*entry, "it must be True or False");
  return value == "true";
}

/// d numbers, or d times `otherwise` where the header has none of these keys.
std::vector<double> numbers(const GridHeader& header, std::initializer_list<std::string_view> keys, std::size_t d,
                            double otherwise) {
  const HeaderEntry* const entry = header.find(keys);
  std::vector<double> values(d, otherwise);
  if (entry != nullptr) values = header.numbers(*entry, entry->value, d);
  return values;
}

GridBytes bytes_of_meta_image(const GridHeader& header, std::string_view text) {
  const HeaderEntry& name = header.need({"ElementType"});
  const GridNumberType* const type = find_meta_image_type(name.value);
  if (type == nullptr) header.refuse(name, "it must be MET_FLOAT, MET_DOUBLE or a whole type such as MET_UCHAR");
  if (!flag(header, {"BinaryData"}, false))
    header.refuse(header.need({"BinaryData"}), "numbers as text are not read; it must be True");
  return {text, *type, flag(header, {"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}, false),
          flag(header, {"CompressedData"}, false)};
}

}  // namespace

bool sniff_meta_image(std::string_view text) {
  const std::string_view first = take_header_line(text);
  const std::string key = text::to_lower(text::trim(first.substr(0, std::min(first.find('='), first.size()))));
  return key == "objecttype" || key == "ndims" || key == "comment";
}

Grid read_meta_image(const std::string& path, std::string_view text, const GridLimits& limits) {
  const GridHeader header = take_meta_header(path, text);
  const HeaderEntry& dimension = header.need({"NDims"});
  const int d = header.counts(dimension, 1).front();
  if (d != 2 && d != 3) header.refuse(dimension, "it must be 2 or 3");
  Grid field;
  field.sizes = header.counts(header.need({"DimSize"}), d);
  field.spacing = numbers(header, {"ElementSpacing", "ElementSize"}, d, 1);
  field.origin = numbers(header, {"Offset", "Origin", "Position"}, d, 0);
  // The file lists the vectors of the axes one after the other, which is how Eigen stores columns.
  field.direction = Eigen::MatrixXd::Identity(d, d);
  if (const HeaderEntry* const axes = header.find({"TransformMatrix", "Rotation", "Orientation"}))
    field.direction = Eigen::MatrixXd::Map(header.numbers(*axes, axes->value, d * d).data(), d, d);
  if (const HeaderEntry* const channels = header.find({"ElementNumberOfChannels"})) {
    field.components = header.counts(*channels, 1).front();
    if (!limits.any_components && field.components != 1 && field.components != d)
      header.refuse(*channels, fmt::format("it must be 1 or {}", d));
  }
  const GridBytes bytes = bytes_of_meta_image(header, text);
  field.type = bytes.type.type;
  field.is_compressed = bytes.is_compressed;
  field.bytes = grid_bytes(path, bytes, field.sizes, field.components, limits.max_points);
  field.lines = header.others(kWrittenKeys);
  return field;
}

namespace {

/// Whether points are where MetaImage puts them unless the header says otherwise: one unit apart, from 0.
bool has_usual_places(const Grid& field) {
  const auto are_all = [](const std::vector<double>& values, double value) {
    return std::all_of(values.begin(), values.end(), [value](double each) { return each == value; });
  };
  return are_all(field.spacing, 1) && are_all(field.origin, 0) && field.direction.isIdentity(0);
}

}  // namespace

std::string meta_image_file(const Grid& field, bool compressed) {
  std::string lines;
  for (const auto& [key, value] : field.lines) lines += fmt::format("{} = {}\n", key, value);
  if (!has_usual_places(field))
    lines += fmt::format("TransformMatrix = {}\nOffset = {}\nCenterOfRotation = {}\nElementSpacing = {}\n",
                         fmt::join(field.direction.data(), field.direction.data() + field.direction.size(), " "),
                         fmt::join(field.origin, " "), fmt::join(std::vector<int>(field.sizes.size()), " "),
                         fmt::join(field.spacing, " "));
  const std::string bytes = encoded(field.bytes, compressed ? GridEncoding::kZlib : GridEncoding::kRaw);
  return fmt::format(
             "ObjectType = Image\nNDims = {}\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = {}\n"
             "{}{}DimSize = {}\n{}ElementType = {}\nElementDataFile = {}\n",
             field.sizes.size(), compressed ? "True" : "False",
             compressed ? fmt::format("CompressedDataSize = {}\n", bytes.size()) : "", lines,
             fmt::join(field.sizes, " "),
             field.components > 1 ? fmt::format("ElementNumberOfChannels = {}\n", field.components) : "",
             grid_number_type(field.type).meta_image_name(), kLocal) +
         bytes;
}

}  // namespace pulson::fields
