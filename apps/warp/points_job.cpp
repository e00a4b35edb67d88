#include "points_job.hpp"

#include <cmath>
#include <limits>
#include <string>

#include <Eigen/LU>

#include "pulson/io/landmark_files.hpp"

namespace pulson {

WarpFigures warp_points(const MaterialFlow& flow, const Alignment& alignment, const WarpArguments& arguments) {
  Landmarks shape = read_landmarks(arguments.input);
  if (shape.dimension() != flow.dimension())
    throw InputError(arguments.input + " is in " + std::to_string(shape.dimension()) + "D, the registration in " +
                     std::to_string(flow.dimension()) + "D");
  std::vector<int> known;
  for (int a = 0; a < shape.count(); ++a)
    if (shape.points.col(a).allFinite()) known.push_back(a);
  const Points points = shape.points(Eigen::all, known);
  MovedPoints moved;
  if (arguments.inverse) {
    moved = flow.inverse(points);
    moved.places = (alignment.scale * alignment.linear).inverse() * (moved.places.colwise() - alignment.translation);
  } else {
    moved = flow.end_with_gradients(alignment.apply(points));
  }
  shape.points.setConstant(std::numeric_limits<double>::quiet_NaN());
  shape.points(Eigen::all, known) = moved.places;
  write_landmarks_csv(arguments.out, shape);

  WarpFigures figures;
  figures.method = "points";
  figures.reason = arguments.inverse ? "by the inverse of every step" : "by every step of the flow";
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
  return figures;
}

}  // namespace pulson
