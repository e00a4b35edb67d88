#include "outputs.hpp"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>

#include "core/text.hpp"
#include "draw/typeface.hpp"
#include "help_groups.hpp"
#include "path_options.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "tables.hpp"

namespace pulson {

void check_picture_size(const std::optional<double>& width, double dpi) {
  constexpr double kMostPixels = 30000;  // of a png's width
  if (width) require_positive("--width", *width);
  require_positive("--dpi", dpi);
  if (const double pixels = width.value_or(423) / 25.4 * dpi; !(pixels >= 100 && pixels <= kMostPixels))
    throw InputError(fmt::format("--width and --dpi make pictures {:.0f} pixels wide; it must be from 100 to {:.0f}",
                                 pixels, kMostPixels));
}

bool is_drawing_file(const std::filesystem::path& file) {
  const std::string extension = text::to_lower(file.extension().string());
  return extension == ".png" || extension == ".svg" || extension == ".pdf";
}

draw::PictureFiles drawing_as(const std::filesystem::path& file, const std::optional<double>& width, double dpi) {
  draw::PictureFiles files{.width = width, .dpi = dpi};
  const std::string extension = text::to_lower(file.extension().string());
  (extension == ".svg" ? files.svg : extension == ".pdf" ? files.pdf : files.png) = file;
  return files;
}

void note_missing_font() {
  static bool is_noted = false;
  if (const std::string note = is_noted ? "" : draw::font_note(); !note.empty()) print_note(note);
  is_noted = true;
}

CLI::Option* OutputOptions::add_files_to(CLI::App& verb) {
  begin_group(verb, kInputGroup);
  CLI::Option* folder = writes_folder(verb.add_option("-o,--out", out, "folder for the results"));
  writes_file(verb.add_option(
      "--json", json, "also write the record to this file; -: to standard output, with nothing else printed there"));
  return folder;
}

void OutputOptions::add_to(CLI::App& verb, const std::string& drawn) {
  add_files_to(verb)->required();
  begin_group(verb, kPictureGroup);
  verb.add_flag("--no-picture", no_picture, "do not draw " + drawn);
  begin_group(verb, more(kPictureGroup));
  verb.add_option("--pictures", pictures, "formats of the pictures: png, svg, pdf")
      ->type_name("NAMES")
      ->capture_default_str();
  verb.add_option("--width", width, "width of the pictures in mm [about 420]")->type_name("NUMBER");
  verb.add_option("--dpi", dpi, "pixels per inch of png pictures")->type_name("NUMBER")->capture_default_str();
  begin_group(verb, more(kInputGroup));
  add_table_option(verb);
  add_quiet_option(verb);
}

std::vector<std::string> OutputOptions::formats() const {
  const std::vector<std::string> valid = {"png", "svg", "pdf"};
  std::vector<std::string> names;
  std::istringstream stream(pictures);
  for (std::string name; std::getline(stream, name, ',');) {
    if (std::find(valid.begin(), valid.end(), name) == valid.end())
      throw InputError(
          fmt::format("--pictures: '{}' is not a format of pictures{}", name, advice_on_name(name, valid)));
    names.push_back(name);
  }
  if (names.empty()) throw InputError("--pictures is empty; it must name formats, or be replaced by --no-picture");
  return names;
}

std::vector<std::string> OutputOptions::picture_names(const std::vector<std::string>& stems) const {
  std::vector<std::string> names;
  if (no_picture) return names;
  for (const std::string& stem : stems)
    for (const std::string& format : formats()) names.push_back(fmt::format("{}.{}", stem, format));
  return names;
}

draw::PictureFiles OutputOptions::picture_files(const std::filesystem::path& stem) const {
  draw::PictureFiles files{.width = width, .dpi = dpi};
  for (const std::string& format : formats()) {
    std::filesystem::path& file = format == "png" ? files.png : format == "svg" ? files.svg : files.pdf;
    file = stem;
    file += "." + format;
  }
  return files;
}

std::filesystem::path OutputOptions::shown_picture(const std::filesystem::path& stem) const {
  if (no_picture) return {};
  const draw::PictureFiles files = picture_files(stem);
  return files.png.empty() ? files.svg : files.png;
}

void OutputOptions::check(const std::vector<std::string>& files, const std::vector<std::string>& stems) const {
  check_picture_size(width, dpi);
  const std::vector<std::string> drawn = picture_names(stems);
  if (!json.empty() && json != "-") check_output_file(json);
  create_output_directory(out);
  lock = std::make_shared<FolderLock>(out);
  for (const std::string& name : files) check_result_file(file(name), "--out");
  for (const std::string& name : drawn) check_result_file(file(name), "--out");
}

void OutputOptions::check_only(const std::string& name) const {
  create_output_directory(out);
  lock = std::make_shared<FolderLock>(out, name);
  check_result_file(file(name), "--out");
}

void OutputOptions::write_json(const std::string& record) const {
  if (json == "-")
    print_exact(record);
  else if (!json.empty())
    write_file_atomically(json, record);
}

}  // namespace pulson
