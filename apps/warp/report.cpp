#include "report.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "drawings.hpp"
#include "html/html_report.hpp"
#include "images/compose.hpp"
#include "pictures.hpp"
#include "pulson/images/image.hpp"
#include "register/picture.hpp"
#include "register/registration_warnings.hpp"
#include "shell/facts.hpp"
#include "shell/report_parts.hpp"

namespace pulson {
namespace {

constexpr double kLongestOnPage = 1100;  // pixels of pictures on the page
constexpr int kMeshCells = 18;           // of the mesh, along the longer side
constexpr int kPointsPerMeshCell = 2;

html::EncodedPicture small_picture(const images::Image& image) {
  const double factor = std::max(image.width(), image.height()) / kLongestOnPage;
  return jpeg_of(factor > 1 ? scaled_down(to_rgba8(for_show(image)), factor) : image);
}

// Lines across the image, then along it, in its pixels: those across are the columns of the mesh.
std::vector<Points> mesh_lines(const images::Image& image, int& columns) {
  const double cell = std::max(image.width(), image.height()) / static_cast<double>(kMeshCells);
  const auto cells = [&](int side) { return std::max(1, static_cast<int>(std::lround(side / cell))); };
  std::vector<Points> lines;
  for (const int axis : {0, 1}) {
    const int side = axis == 0 ? image.width() : image.height(), other = axis == 0 ? image.height() : image.width();
    for (int i = 0; i <= cells(side); ++i) {
      Points line(2, cells(other) * kPointsPerMeshCell + 1);
      line.row(axis).setConstant(side * static_cast<double>(i) / cells(side) - 0.5);
      line.row(1 - axis) = Eigen::RowVectorXd::LinSpaced(line.cols(), -0.5, other - 0.5);
      lines.push_back(std::move(line));
    }
  }
  columns = cells(image.width()) + 1;
  return lines;
}

std::optional<html::ReportMotion> image_motion(const images::Image& image, const images::ImageWarp& warp,
                                               const WarpFrames& frames, const matching::Registration& registration) {
  const Trajectory& path = warp.flow().path();
  const std::vector<int> steps = shown_frames(path.grid.steps, registration.source.points.size());
  html::ReportMotion motion;
  motion.source = registration.source;
  motion.target = registration.target;
  for (Landmarks* shape : {&motion.source, &motion.target})
    shape->points = images::in_plane(shape->points, frames.result);
  motion.corresponds = registration.data.kind == matching::DataKind::kLandmarks;
  motion.source.frame.y_down = motion.target.frame.y_down = frames.result.y_down;
  html::MotionImage moved{small_picture(image), {0, 0}, {1, 1}, 0, kPointsPerMeshCell};
  const std::vector<Points> lines = mesh_lines(image, moved.columns);
  for (const Points& line : lines) motion.lines.push_back(static_cast<int>(line.cols()));
  const std::vector<Points> places = warp.paths(joined_lines(lines));
  for (const int k : steps) {
    motion.times.push_back(path.grid.at(k));
    motion.frames.push_back(images::in_plane(path.states[static_cast<std::size_t>(k)].q, frames.result));
    motion.grid.push_back(frames.result.to_landmarks(places[static_cast<std::size_t>(k)]));
  }
  motion.image = moved;
  motion.caption = "The image, its grid and the landmarks as the map moves them, after the alignment.";
  if (!can_be_drawn(motion.frames) || !can_be_drawn(motion.grid)) return std::nullopt;
  return motion;
}

html::ReportTable numbers(const WarpRun& run, const matching::Registration& registration) {
  html::ReportTable table{{"quantity", "value"},
                          {{{"registration"}, {run.arguments.registration}},
                           {{"direction"}, {run.arguments.inverse ? "target to source" : "source to target"}},
                           {{"kernel"}, {registration_system(registration).kernel.spec(4)}},
                           {{"noise"}, {registration.noise}}},
                          "",
                          true};
  const auto add = [&](std::initializer_list<std::string_view> keys) {
    const html::ReportTable facts = report_facts(chosen(warp_facts(), keys), run, "");
    table.rows.insert(table.rows.end(), facts.rows.begin(), facts.rows.end());
  };
  add({"method", "reason", "folded_fraction", "min_jacobian"});
  if (const WarpFrames* const frames = run.frames) {
    table.rows.push_back({{"size of the result"}, {fmt::format("{} x {} pixels", frames->width, frames->height)}});
    table.rows.push_back({{"landmark units per pixel"}, {report_number(frames->input.unit_per_pixel[0])}});
    table.rows.push_back({{"y"}, {frames->input.y_down ? "down" : "up"}});
    add({"max_multiplicity", "uncovered_fraction", "hole_fraction", "map_error"});
  }
  add({"landmark_error_max"});
  if (run.figures.ridge > 0) add({"ridge"});
  return table;
}

std::string lead(const WarpFigures& figures, const WarpArguments& arguments, const std::string& what) {
  const std::string folds = figures.folded_fraction > 0
                                ? fmt::format("folds {} of {}", percent_text(figures.folded_fraction), what)
                                : "does not fold";
  return fmt::format("{} by {}map of {}. The map {}; its smallest Jacobian is {}.", file_name(arguments.input),
                     arguments.inverse ? "the inverse " : "the ", arguments.registration, folds,
                     report_number(figures.min_jacobian, 3));
}

html::HtmlReport begun(const WarpFigures& figures, const WarpArguments& arguments,
                       const matching::Registration& registration, const std::string& what) {
  std::vector<std::string> warnings;
  for (const std::string& text : path_warnings(registration)) warnings.push_back("of the registration: " + text);
  return new_report(fmt::format("{} → {}", file_name(arguments.input), file_name(arguments.out)),
                    lead(figures, arguments, what), warnings, {});
}

}  // namespace

void write_warp_report(const images::Image& image, const images::WarpedImage& result, const WarpFigures& figures,
                       const images::ImageWarp& warp, const WarpFrames& frames,
                       const matching::Registration& registration, const WarpArguments& arguments) {
  html::HtmlReport report = begun(figures, arguments, registration, "the image");
  if (!arguments.inverse)
    if (std::optional<html::ReportMotion> motion = image_motion(image, warp, frames, registration))
      report.sections.push_back({"Motion", {std::move(*motion)}});
  if (frames.like)
    report.sections.push_back(
        {"Result and target",
         {html::ReportStack{small_picture(frames.like->image), small_picture(result.image), file_name(arguments.like),
                            file_name(arguments.out),
                            "The slider goes from the one to the other; zoom in to see edges."}}});
  const Drawings drawings(arguments);
  std::string narrow;
  const std::string both = drawings.png_of(drawings.side_by_side(image, result, warp, frames), narrow);
  report.sections.push_back(
      {"Before and after",
       {html::ReportPicture{jpeg_of(images::decode_image(both)),  // a tenth of the size
                            "The image, and what the map makes of it.", true, jpeg_of(images::decode_image(narrow))}}});
  if (!arguments.inverse || warp.flow().is_diffeomorphic()) {
    const std::vector<float> jacobians =
        jacobians_on_image(image, warp, {.inverse = arguments.inverse, .tolerance = arguments.tolerance});
    html::EncodedPicture drawn{html::MediaType::kPng,
                               drawings.png_of(drawings.jacobian(image, warp, jacobians), narrow)};
    report.sections.push_back(
        {"Jacobian",
         {html::ReportPicture{std::move(drawn), "Above 1 areas grow, below 1 they shrink, below 0 they are flipped.",
                              true, html::EncodedPicture{html::MediaType::kPng, std::move(narrow)}}}});
  }
  report.sections.push_back({"Numbers", {numbers({figures, arguments, &frames}, registration)}});
  write_file_atomically(arguments.report, html_report(report));
}

void write_warp_report(const WarpedPoints& points, const warp::MaterialFlow& flow,
                       const matching::Registration& registration, const WarpArguments& arguments) {
  const auto& [before, after, figures] = points;
  html::HtmlReport report = begun(figures, arguments, registration, "the points");
  const Trajectory& path = flow.path();
  html::ReportMotion motion;
  motion.source = arguments.inverse ? after : before;
  const std::vector<int> missing = incomplete_points(motion.source.points);
  if (missing.empty() && motion.source.count() > 0) {
    motion.source.points = registration.alignment.apply(motion.source.points);
    const std::vector<Points> places = flow.paths(motion.source.points);
    for (const int k : shown_frames(path.grid.steps, motion.source.points.size())) {
      motion.times.push_back(path.grid.at(k));
      motion.frames.push_back(places[static_cast<std::size_t>(k)]);
    }
    motion.caption = "The points as the map moves them, after the alignment.";
    if (can_be_drawn(motion.frames)) report.sections.push_back({"Motion", {std::move(motion)}});
  }
  report.sections.push_back({"Numbers", {numbers({figures, arguments, nullptr}, registration)}});
  html::ReportTable table = landmark_table(before);
  for (const char axis : std::string("xyz").substr(0, static_cast<std::size_t>(before.dimension())))
    table.header.insert(table.header.end(), {std::string(1, axis), fmt::format("{}, warped", axis)});
  for (const int a : listed_landmarks(Eigen::VectorXd::Zero(before.count()))) {
    std::vector<html::ReportCell> row = landmark_cells(before, a);
    for (int i = 0; i < before.dimension(); ++i)
      row.insert(row.end(), {{report_number(before.points(i, a), 6)}, {report_number(after.points(i, a), 6)}});
    table.rows.push_back(std::move(row));
  }
  table.caption = arguments.out + " has all shapes with all digits.";
  report.sections.push_back({"Landmarks", {std::move(table)}});
  write_file_atomically(arguments.report, html_report(report));
}

}  // namespace pulson
