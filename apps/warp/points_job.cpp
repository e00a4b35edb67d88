#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/factorisations.hpp"
#include "core/landmark_pairs.hpp"
#include "core/shape_frames.hpp"
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

}  // namespace

WarpedPoints warp_points(const warp::MaterialFlow& flow, const matching::Registration& registration,
                         const WarpArguments& arguments) {
  formats::ReadOptions reading = arguments.reading;
  if (arguments.flip_y) reading.y_down = !*arguments.flip_y;
  formats::LandmarkFile file = read_addressed_shapes(arguments.input, reading);
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
  for (std::size_t s = 0; s < own.size(); ++s) frame.leave(file.shapes[s], own[s]);
  for (Landmarks& shape : file.shapes) {  // they lie on another image now
    shape.image.clear();
    shape.scale.reset();
  }
  for (std::string& loss : write_landmarks(arguments.out, file)) notes.push_back(std::move(loss));
  print_notes(notes);

  WarpFigures figures;
  figures.method = "points";
  figures.reason = arguments.inverse ? "moved by the inverse of every step" : "moved by every step of the flow";
  const Eigen::VectorXd jacobians = moved.jacobians();
  if (jacobians.size() > 0) {
    const double least = jacobians.minCoeff();
    const double aligned = std::pow(alignment.scale, flow.dimension()) * alignment.linear.determinant();
    figures.min_jacobian = aligned * (arguments.inverse && least > 0 ? 1 / jacobians.maxCoeff() : least);
    figures.folded_fraction =
        static_cast<double>((jacobians.array() <= 0).count()) / static_cast<double>(jacobians.size());
  }
  figures.landmark_error_max = flow.landmark_error();
  figures.ridge = flow.ridge();
  return {before_map, after_map, figures};
}

}  // namespace pulson
