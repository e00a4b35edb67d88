#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/factorisations.hpp"
#include "core/landmark_pairs.hpp"
#include "core/shape_frames.hpp"
#include "core/text.hpp"
#include "formats/carriers/carried_file.hpp"
#include "formats/frame_text.hpp"
#include "formats/shape_address.hpp"
#include "jobs.hpp"
#include "points_frame.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "shell/messages.hpp"
#include "shell/tables.hpp"

namespace pulson {
namespace {

/// The landmarks, curves and outlines of all shapes.
std::vector<Points*> blocks_of(formats::LandmarkFile& file) {
  std::vector<Points*> blocks;
  for (Landmarks& shape : file.shapes) {
    blocks.push_back(&shape.points);
    for (Points& curve : shape.curves) blocks.push_back(&curve);
    for (Points& outline : shape.outlines) blocks.push_back(&outline);
  }
  std::erase_if(blocks, [](const Points* block) { return block->cols() == 0; });
  return blocks;
}

/// visit(column) for each point that misses no coordinate.
template <class Visit>
void visit_known(const std::vector<Points*>& blocks, const Visit& visit) {
  for (Points* block : blocks)
    for (auto point : block->colwise())
      if (!point.hasNaN()) visit(point);
}

Points known_points(const std::vector<Points*>& blocks) {
  Eigen::Index count = 0;
  visit_known(blocks, [&](const auto&) { ++count; });
  Points points(blocks.empty() ? 0 : blocks.front()->rows(), count);
  count = 0;
  visit_known(blocks, [&](const auto& point) { points.col(count++) = point; });
  return points;
}

void put_known_points(const Points& points, const std::vector<Points*>& blocks) {
  Eigen::Index next = 0;
  visit_known(blocks, [&](auto& point) { point = points.col(next++); });
}

/// What is moved: shapes and, where the result is of their format, all that their file holds besides.
struct PointsInput {
  formats::LandmarkFile file;
  std::unique_ptr<formats::CarriedFile> carried;
};

std::string extension(const std::string& path) {
  return text::to_lower(std::filesystem::path(path).extension().string());
}

/// Whether the result is in the format of the input. A table whose name does not say what is between its columns may
/// become a csv.
bool keeps_format(const std::string& input, const std::string& out) {
  const std::string from = extension(input), to = extension(out);
  if (from == to) return true;
  return to == ".csv" && from != ".tsv" && from != ".fcsv" && !formats::is_mesh_file(input);
}

PointsInput read_points(const WarpArguments& arguments, const formats::ReadOptions& reading, int dimension,
                        const Landmarks& frame) {
  const std::string path = formats::file_of_address(arguments.input);
  const bool is_whole = path == arguments.input || arguments.input == "-";
  const bool is_mesh = formats::is_mesh_file(path);
  PointsInput input;
  const bool keeps = keeps_format(path, arguments.out);
  if (is_whole && (keeps || is_mesh)) input.carried = read_carried_file(path, reading, dimension);
  if (!input.carried) {
    input.file = formats::read_addressed_shapes(arguments.input, reading);
    return input;
  }
  input.file.shapes = {input.carried->shape};
  input.file.axes = input.carried->shape.axes;
  input.file.units = input.carried->shape.units;
  if (keeps) {
    if (makes_tables_safe() && !is_mesh)
      throw InputError("--spreadsheet-safe changes texts; those of a table that is warped stay as they are");
    input.file.warnings = input.carried->notes;
    if (is_mesh && dimension == 3 && !frame.axes.empty() && input.file.axes.empty())
      input.file.warnings.push_back(
          fmt::format("{}: it does not say where its axes point; they are taken as {}, as of "
                      "the registration's landmarks",
                      path, frame.axes));
    return input;
  }
  input.carried.reset();
  input.file.warnings = {
      fmt::format("{}: it gets the points of {} alone, without faces and data; a mesh stays whole "
                  "in a file {}",
                  arguments.out, path, extension(path))};
  return input;
}

/// A point that misses a coordinate is missing.
void drop_half_points(const std::vector<Points*>& blocks, const WarpArguments& arguments,
                      std::vector<std::string>& notes) {
  std::size_t halves = 0;
  for (Points* block : blocks)
    for (auto point : block->colwise()) {
      if (!point.hasNaN()) continue;
      if (!point.array().isNaN().all()) ++halves;
      point.setConstant(text::kMissing);
    }
  if (halves > 0)
    notes.push_back(fmt::format("{}: {} a coordinate and cannot be moved: all of its coordinates are missing in {}",
                                arguments.input, halves == 1 ? "1 point lacks" : fmt::format("{} points lack", halves),
                                arguments.out));
}

/// How coordinates of the file become those of the registration, without the translation.
Eigen::MatrixXd frame_change(const Landmarks& frame, const Landmarks& shape) {
  const int d = shape.dimension();
  Landmarks axes = shape;
  axes.points = Points::Zero(d, d + 1);
  axes.points.rightCols(d).setIdentity();
  std::vector<std::string> said_before;
  const Points changed = in_frame_of(frame, axes, said_before).points;
  return changed.rightCols(d).colwise() - Eigen::VectorXd(changed.col(0));
}

/// Normals turn by the cofactors of the map's gradient J: n ↦ det(J) J⁻ᵀ n, of length 1.
Points moved_normals(const formats::CarriedFile& carried, const Landmarks& frame, const Alignment& alignment,
                     const Eigen::MatrixXd& gradients, bool is_inverse) {
  Points normals = carried.normals;
  if (normals.cols() == 0) return normals;
  const Eigen::Matrix3d change = frame_change(frame, carried.shape), linear = alignment.scale * alignment.linear;
  std::vector<Eigen::Index> known;
  Eigen::Index count = 0;
  for (const auto point : carried.shape.points.colwise()) known.push_back(point.hasNaN() ? -1 : count++);
  for (Eigen::Index i = 0; i < normals.cols(); ++i) {
    const Eigen::Index point = known[static_cast<std::size_t>(carried.normal_points[static_cast<std::size_t>(i)])];
    if (point < 0) continue;
    const Eigen::Matrix3d gradient = Eigen::Map<const Eigen::Matrix3d>(gradients.col(point).data());
    const Eigen::Matrix3d moved =
        is_inverse ? Eigen::Matrix3d(linear.inverse() * gradient) : Eigen::Matrix3d(gradient * linear);
    const Eigen::Matrix3d j = change.inverse() * moved * change;
    const Eigen::Vector3d normal = j.determinant() * j.inverse().transpose() * normals.col(i);
    if (normal.norm() > 0) normals.col(i) = normal.normalized();
  }
  return normals;
}

/// The carried file with its points where `moved`, in the frame of the registration, has them.
void write_carried(const formats::CarriedFile& carried, const Landmarks& moved, const Points& normals,
                   const std::string& out) {
  std::vector<std::string> said_before;
  const Points points = in_frame_of(carried.shape, moved, said_before).points;
  write_file_atomically(out, formats::with_frame_comment(carried.with(points, normals), moved.frame));
}

}  // namespace

void check_points_output(const std::string& input, const std::string& out) {
  if (keeps_format(input, out)) return;
  const bool is_mesh = formats::is_mesh_file(input) && formats::is_mesh_file(out);
  if (is_mesh && extension(out) != ".vtk")
    throw InputError(
        fmt::format("{}: a mesh is written whole in the format of its file, here {}", out, extension(input)));
  formats::landmark_format_to_write(out);
}

WarpedPoints warp_points(const warp::MaterialFlow& flow, const matching::Registration& registration,
                         const WarpArguments& arguments) {
  formats::ReadOptions reading = arguments.reading;
  if (arguments.flip_y) reading.y_down = !*arguments.flip_y;
  PointsInput input = read_points(arguments, reading, flow.dimension(), registration.original);
  formats::LandmarkFile& file = input.file;
  std::vector<std::string> notes = std::move(file.warnings);
  const PointsFrame frame(arguments.inverse ? registration.target : registration.original,
                          arguments.inverse ? registration.original : registration.target);
  std::vector<Frame> own;
  for (Landmarks& shape : file.shapes) {
    own.push_back(shape.frame);
    shape = frame.enter(std::move(shape), notes);
  }
  if (!registration.original.axes.empty()) file.axes = registration.original.axes;
  if (!registration.original.units.empty()) file.units = registration.original.units;
  const Alignment& alignment = registration.alignment;
  std::vector<Points*> blocks = blocks_of(file);
  for (const Points* block : blocks)
    if (block->rows() != flow.dimension())
      throw InputError(
          fmt::format("{} is in {}D, the registration in {}D", arguments.input, block->rows(), flow.dimension()));
  drop_half_points(blocks, arguments, notes);
  const Landmarks before_map = file.shapes.front();
  const Points points = known_points(blocks);
  warp::MovedPoints moved;
  if (arguments.inverse) {
    moved = flow.inverse(points);
    moved.places = (alignment.scale * alignment.linear).inverse() * (moved.places.colwise() - alignment.translation);
  } else {
    moved = flow.end_with_gradients(alignment.apply(points));
  }
  if (!moved.places.allFinite())
    throw NumericalError(
        fmt::format("{}: a point is moved out of the range of numbers; nothing was written", arguments.input));
  put_known_points(moved.places, blocks);
  const Landmarks after_map = file.shapes.front();
  for (std::size_t s = 0; s < own.size(); ++s) {
    frame.leave(file.shapes[s], own[s]);
    if (arguments.flip_y && !input.carried) file.shapes[s].frame = Frame{.y_down = false};  // not as the format has it
  }
  for (Landmarks& shape : file.shapes) {  // they lie on another image now
    shape.image.clear();
    shape.scale.reset();
  }
  if (input.carried)
    write_carried(*input.carried, file.shapes.front(),
                  moved_normals(*input.carried, registration.original, alignment, moved.gradients, arguments.inverse),
                  arguments.out);
  else
    for (std::string& loss : write_landmarks(arguments.out, file)) notes.push_back(std::move(loss));
  print_notes(notes);

  WarpFigures figures;
  figures.method = "points";
  figures.reason = arguments.inverse ? "moved by the inverse of every step" : "moved by every step of the flow";
  const Eigen::VectorXd jacobians = moved.jacobians();
  if (jacobians.size() > 0) {
    const double least = jacobians.minCoeff();
    const double aligned = std::pow(alignment.scale, flow.dimension()) * std::abs(alignment.linear.determinant());
    figures.min_jacobian = aligned * (arguments.inverse && least > 0 ? 1 / jacobians.maxCoeff() : least);
    figures.folded_fraction = moved.folded_fraction();
  }
  figures.landmark_error_max = flow.landmark_error();
  figures.ridge = flow.ridge();
  return {before_map, after_map, figures};
}

}  // namespace pulson
