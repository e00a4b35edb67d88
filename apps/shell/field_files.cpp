#include "field_files.hpp"

#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/text.hpp"
#include "draw/animation.hpp"
#include "help_groups.hpp"
#include "images/compose.hpp"
#include "options.hpp"
#include "path_options.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/images/image.hpp"
#include "records/csv_rows.hpp"
#include "report_parts.hpp"
#include "tables.hpp"

namespace pulson {
namespace {

constexpr std::array kGridPoints = {401, 101, 41};  // along the longest axis in 1D, 2D, 3D
constexpr double kMostFieldNumbers = 5e7;           // of an array: 400 MB
constexpr double kFrameDpi = 48;                    // of an animation: half the pixels of a picture

enum class FieldFormat { kArray, kTable, kPicture, kAnimation };

FieldFormat format_of(const std::string& file) {
  const std::string extension = text::to_lower(std::filesystem::path(file).extension().string());
  if (extension == ".npy") return FieldFormat::kArray;
  if (extension == ".csv") return FieldFormat::kTable;
  if (is_drawing_file(file)) return FieldFormat::kPicture;
  if (extension == ".gif" || extension == ".mp4" || extension == ".webp") return FieldFormat::kAnimation;
  throw InputError(fmt::format(
      "{}: --field writes .npy and .csv, pictures .png, .svg and .pdf, and animations .gif, .mp4 and .webp", file));
}

std::vector<std::size_t> sizes_of(const warp::VelocityField& field) {
  std::vector<std::size_t> sizes{field.times.size(), field.grid.size()};
  for (const Eigen::VectorXd& axis : field.grid) sizes.push_back(static_cast<std::size_t>(axis.size()));
  return sizes;
}

std::string field_csv(const warp::VelocityField& field) {
  const auto d = static_cast<Eigen::Index>(field.grid.size());
  const Points points = warp::grid_points(field.grid);
  text::CsvTable table;
  table.word("time");
  for (Eigen::Index i = 0; i < d; ++i) table.word(std::string_view("xyz").substr(static_cast<std::size_t>(i), 1));
  records::add_axis_names(table, "u", d);
  table.end_row();
  for (std::size_t k = 0; k < field.times.size(); ++k)
    for (Eigen::Index m = 0; m < points.cols(); ++m)
      table.number(field.times[k]).numbers(points.col(m)).numbers(field.velocities[k].col(m)).end_row();
  return std::move(table).take();
}

void write_field_animation(const std::string& file, const draw::FieldPicture& picture) {
  Progress progress;
  std::optional<draw::Animation> animation;
  const auto last = static_cast<int>(picture.times.size()) - 1;
  for (const int k : shown_frames(last, picture.velocities.front().size())) {
    progress.show(static_cast<double>(k) / last, "animation");
    if (Interrupt::came()) throw InputError("interrupted");
    const images::Image frame =
        images::decode_image(field_frame_png(picture, static_cast<std::size_t>(k), {.dpi = kFrameDpi}));
    if (!animation) animation.emplace(file, frame.width(), frame.height(), draw::kFramesPerSecond);
    for (int repeat = 0; repeat < (k == 0 || k == last ? draw::kRestingFrames : 1); ++repeat)
      animation->add(images::rgb_on_white(to_rgba8(frame)));
  }
  animation->finish();
}

void write_field_file(const std::string& file, const warp::VelocityField& field, const draw::FieldPicture& picture,
                      const OutputOptions& output) {
  switch (format_of(file)) {
    case FieldFormat::kArray:
      return formats::write_npy(file, field.numbers(), sizes_of(field));
    case FieldFormat::kTable:
      return write_file_atomically(file, as_table(field_csv(field)));
    case FieldFormat::kPicture:
      write_field_picture(picture, drawing_as(file, output.width, output.dpi));
      return note_missing_font();
    case FieldFormat::kAnimation:
      return write_field_animation(file, picture);
  }
}

}  // namespace

void FieldOptions::add_to(CLI::App& verb, const std::string& path, const std::string& states) {
  begin_group(verb, more(kPictureGroup));
  CLI::Option* option = writes_file(verb.add_option(
      "--field", files,
      fmt::format("write the velocity field u(x, t) of {} on a grid, without the fields of the noise: .npy "
                  "[time][component][x][y][z], .csv, or in 1D and 2D a picture (png, svg, pdf) or an animation (gif, "
                  "mp4, webp; needs ffmpeg); may be repeated. {} has the momenta",
                  path, states)));
  option->allow_extra_args(false);
  verb.add_option("--grid-points", grid_points,
                  fmt::format("points of the grid of --field along its longest side [{} on a line, {} in the plane, "
                              "{} in space]",
                              kGridPoints[0], kGridPoints[1], kGridPoints[2]))
      ->needs(option);
}

void FieldOptions::check(int dimension, int times) const {
  if (grid_points) check_at_least(*grid_points, 2, "--grid-points");
  for (const std::string& file : files) {
    const FieldFormat format = format_of(file);
    if (dimension == 3 && format != FieldFormat::kArray && format != FieldFormat::kTable)
      throw InputError(fmt::format(
          "{}: pictures of a field are of a line or the plane, and the landmarks are in 3D; write .npy or .csv", file));
    check_output_file(file);
  }
  const int points = points_along(dimension);
  const double numbers = std::pow(points, dimension) * dimension * times;
  if (!files.empty() && numbers > kMostFieldNumbers)
    throw InputError(
        fmt::format("--field may have {:.2g} numbers, {} times of {} points a side; at most {:.2g} fit: take fewer "
                    "--grid-points or times",
                    numbers, times, points, kMostFieldNumbers));
}

int FieldOptions::points_along(int dimension) const {
  return grid_points.value_or(kGridPoints.at(static_cast<std::size_t>(dimension - 1)));
}

std::optional<warp::VelocityField> FieldOptions::field_of(const KernelOperator& kernel, const Trajectory& path,
                                                          int every) const {
  if (files.empty()) return std::nullopt;
  const warp::SpaceGrid grid = warp::grid_around(kernel, path, points_along(static_cast<int>(path.initial().q.rows())));
  const auto last = static_cast<int>(path.states.size()) - 1;
  std::vector<int> steps;
  for (int k = 0; k < last; k += every) steps.push_back(k);
  steps.push_back(last);
  return warp::velocity_field(kernel, path, grid, steps);
}

nlohmann::ordered_json field_json(const std::optional<warp::VelocityField>& field) {
  auto json = nlohmann::ordered_json::object();
  if (!field) return json;
  json["field"] = {{"sizes", sizes_of(*field)}, {"times", field->times}};
  for (std::size_t i = 0; i < field->grid.size(); ++i)
    json["field"][std::string(1, "xyz"[i])] = std::vector<double>(field->grid[i].begin(), field->grid[i].end());
  return json;
}

draw::FieldPicture make_field_picture(const warp::VelocityField& field, const Trajectory& path,
                                      const Landmarks& start) {
  draw::FieldPicture picture;
  picture.start = start;
  picture.times = field.times;
  for (const int k : field.steps) {
    picture.positions.push_back(path.states[static_cast<std::size_t>(k)].q);
    picture.momenta.push_back(path.states[static_cast<std::size_t>(k)].p);
  }
  picture.axes = field.grid;
  picture.velocities = field.velocities;
  return picture;
}

void write_field(const FieldOptions& options, const warp::VelocityField& field, const draw::FieldPicture& picture,
                 RunResults& results) {
  for (const std::string& file : options.files)
    results.write_outside([&] { write_field_file(file, field, picture, results.output()); });
}

void print_field(const FieldOptions& options, const std::optional<warp::VelocityField>& field) {
  if (!field) return;
  std::vector<std::size_t> points = sizes_of(*field);
  points.erase(points.begin(), points.begin() + 2);
  print_text("field      {} of {} points: {}\n", counted(field->times.size(), "time"), fmt::join(points, " x "),
             fmt::join(options.files, ", "));
}

}  // namespace pulson
