#include "pulson/images/image_warp.hpp"

#include <string>
#include <utility>

#include <Eigen/LU>

#include "pulson/core/errors.hpp"

namespace pulson::images {

namespace {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::MatrixXd;

// left · G · right of every column of 2×2 gradients.
MatrixXd sandwiched(const Matrix2d& left, const MatrixXd& gradients, const Matrix2d& right) {
  MatrixXd products(4, gradients.cols());
  for (Index m = 0; m < gradients.cols(); ++m)
    products.col(m) = (left * gradients.col(m).reshaped(2, 2) * right).reshaped();
  return products;
}

}  // namespace

ImageWarp::ImageWarp(const warp::MaterialFlow& flow, Alignment alignment, const Frame& source, const Frame& target)
    : flow_(flow), alignment_(std::move(alignment)), source_(source), target_(target) {
  if (flow.dimension() != 2)
    throw InputError("images are of the plane, and the landmarks are in " + std::to_string(flow.dimension()) + "D");
}

warp::MovedPoints ImageWarp::forward(const Points& pixels) const {
  warp::MovedPoints moved = flow_.end_with_gradients(alignment_.apply(source_.to_landmarks(pixels)));
  moved.places = target_.to_pixels(moved.places);
  const Matrix2d before = alignment_.scale * alignment_.linear * Matrix2d(source_.scale().asDiagonal());
  moved.gradients = sandwiched(target_.scale().cwiseInverse().asDiagonal(), moved.gradients, before);
  return moved;
}

warp::MovedPoints ImageWarp::backward(const Points& pixels) const {
  warp::MovedPoints moved = flow_.inverse(target_.to_landmarks(pixels));
  const Matrix2d inverse = Matrix2d(alignment_.scale * alignment_.linear).inverse();
  moved.places = source_.to_pixels(inverse * (moved.places.colwise() - alignment_.translation));
  moved.gradients =
      sandwiched(source_.scale().cwiseInverse().asDiagonal() * inverse, moved.gradients, target_.scale().asDiagonal());
  return moved;
}

Points ImageWarp::aligned(const Points& pixels) const {
  return target_.to_pixels(alignment_.apply(source_.to_landmarks(pixels)));
}

std::vector<Points> ImageWarp::paths(const Points& pixels) const {
  std::vector<Points> places = flow_.paths(alignment_.apply(source_.to_landmarks(pixels)));
  for (Points& each : places) each = target_.to_pixels(each);
  return places;
}

Points ImageWarp::label_pixels() const {
  const Eigen::MatrixXd inverse = (alignment_.scale * alignment_.linear).inverse();
  return source_.to_pixels(inverse * (flow_.path().initial().q.colwise() - alignment_.translation));
}

std::vector<Points> ImageWarp::landmark_paths() const {
  std::vector<Points> places;
  for (const PhaseState& state : flow_.path().states) places.push_back(target_.to_pixels(state.q));
  return places;
}

int ImageWarp::orientation() const {
  const double determinant =
      Matrix2d(alignment_.linear).determinant() * source_.scale().prod() * target_.scale().prod();
  return determinant < 0 ? -1 : 1;
}

double ImageWarp::landmark_error() const { return flow_.landmark_error() / target_.scale().cwiseAbs().minCoeff(); }

const NameTable<Interpolation>& interpolation_table() {
  static const NameTable<Interpolation> kTable("interpolation",
                                               {{"nearest", {}, "the nearest pixel", Interpolation::kNearest},
                                                {"linear", {}, "of 2 x 2 pixels", Interpolation::kLinear},
                                                {"cubic", {}, "of 4 x 4 pixels", Interpolation::kCubic},
                                                {"lanczos", {}, "of 8 x 8 pixels", Interpolation::kLanczos},
                                                {"label", {}, "that of most samples", Interpolation::kLabel}});
  return kTable;
}

const NameTable<Border>& border_table() {
  static const NameTable<Border> kTable("border",
                                        {{"constant", {}, "the fill value", Border::kConstant},
                                         {"replicate", {}, "the pixel at the edge", Border::kReplicate},
                                         {"reflect", {}, "the image mirrored at its edge", Border::kReflect},
                                         {"transparent", {}, "nothing, in an alpha channel", Border::kTransparent}});
  return kTable;
}

Interpolation parse_interpolation(std::string_view name) { return interpolation_table().find(name).make; }

Border parse_border(std::string_view name) { return border_table().find(name).make; }

}  // namespace pulson::images
