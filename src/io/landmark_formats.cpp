#include <algorithm>

#include <fmt/format.h>

#include "formats.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/io/landmark_files.hpp"
#include "text.hpp"

namespace pulson {

const std::vector<LandmarkFormat>& landmark_formats() {
  static const std::vector<LandmarkFormat> formats = {
      {"tps",
       {"tps"},
       "tpsDig text: LM= or LM3=, coordinates, ID=, IMAGE=; several shapes",
       io::sniff_tps,
       io::read_tps},
      {"vtk",
       {"vtk"},
       "VTK legacy polydata, 1.0 to 5.1, ASCII or BINARY: POINTS; in the plane where all z are equal; pieces of LINES "
       "and POLYGONS are groups",
       io::sniff_vtk,
       io::read_vtk},
      {"csv",
       {"csv", "tsv"},
       "table x[,y[,z]] with , ; tab or blanks between, with or without header (label, group); several shapes with a "
       "column specimen",
       io::sniff_csv,
       io::read_csv},
  };
  return formats;
}

namespace {

std::string first_line(std::string_view contents) {
  const std::size_t begin = contents.find_first_not_of(" \t\r\n");
  contents.remove_prefix(begin);
  return io::in_quotes(contents.substr(0, contents.find_first_of("\r\n")));
}

const LandmarkFormat& find_format(const std::filesystem::path& path, std::string_view contents) {
  const auto& formats = landmark_formats();
  const auto by_content =
      std::find_if(formats.begin(), formats.end(), [&](const LandmarkFormat& f) { return f.sniff(contents); });
  if (by_content != formats.end()) return *by_content;
  const std::string dotted = io::to_lower(path.extension().string());
  const std::string extension = dotted.substr(std::min<std::size_t>(1, dotted.size()));
  std::string known;
  for (const LandmarkFormat& format : formats) {
    if (std::find(format.extensions.begin(), format.extensions.end(), extension) != format.extensions.end())
      return format;
    known += (known.empty() ? "" : ", ") + format.name;
  }
  throw InputError(fmt::format("{} is in none of the landmark formats ({}); it begins with {}", path.string(), known,
                               first_line(contents)));
}

void name_shapes(const std::filesystem::path& path, std::vector<Landmarks>& shapes) {
  const bool is_alone = shapes.size() == 1;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const std::string number = is_alone ? "" : fmt::format("#{}", i + 1);
    shapes[i].source = path.string() + number;
    if (shapes[i].name.empty()) shapes[i].name = path.stem().string() + number;
  }
}

}  // namespace

LandmarkFile read_landmark_file(const std::filesystem::path& path) {
  const std::string contents = io::read_text_file(path);
  const LandmarkFormat& format = find_format(path, contents);
  LandmarkFile file = format.read(path.string(), contents);
  file.format = format.name;
  name_shapes(path, file.shapes);
  return file;
}

}  // namespace pulson
