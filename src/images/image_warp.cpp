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

// Pixels of x on a line, in the rows of others.
Points with_rows(const Frame& frame, const Points& line, const Points& rows_of) {
  Points pixels = frame.to_pixels(in_plane(line, frame));
  pixels.row(1) = rows_of.row(1);
  return pixels;
}

// Gradients in the plane: of a map of a line, which keeps the rows, diag(g, 1).
MatrixXd in_plane_gradients(const MatrixXd& gradients) {
  if (gradients.rows() == 4) return gradients;
  MatrixXd plane = Eigen::Vector4d(0, 0, 0, 1).replicate(1, gradients.cols());
  plane.row(0) = gradients;
  return plane;
}

}  // namespace

Points in_plane(const Points& places, const Frame& frame) {
  if (places.rows() != 1) return places;
  Points plane(2, places.cols());
  plane.row(0) = places;
  plane.row(1).setConstant(frame.to_landmarks(Eigen::Vector2d(0, (frame.height - 1) / 2.0))(1));
  return plane;
}

ImageWarp::ImageWarp(const warp::MaterialFlow& flow, Alignment alignment, const Frame& source, const Frame& target)
    : flow_(flow), alignment_(std::move(alignment)), source_(source), target_(target) {
  if (flow.dimension() > 2)
    throw InputError("images are of a line or the plane, and the landmarks are in " + std::to_string(flow.dimension()) +
                     "D");
}

Points ImageWarp::labels_of(const Points& pixels) const {
  return alignment_.apply(source_.to_landmarks(pixels).topRows(flow_.dimension()));
}

Points ImageWarp::source_pixels(const Points& labels, const Points& rows_of) const {
  const MatrixXd inverse = (alignment_.scale * alignment_.linear).inverse();
  const Points places = inverse * (labels.colwise() - alignment_.translation);
  return flow_.dimension() == 1 ? with_rows(source_, places, rows_of) : source_.to_pixels(places);
}

Points ImageWarp::target_pixels(const Points& places, const Points& rows_of) const {
  return flow_.dimension() == 1 ? with_rows(target_, places, rows_of) : target_.to_pixels(places);
}

Matrix2d ImageWarp::label_scale() const {
  const MatrixXd linear = alignment_.scale * alignment_.linear;
  if (flow_.dimension() == 2) return linear * source_.scale().asDiagonal();
  return Eigen::Vector2d(linear(0, 0) * source_.scale().x(), 1).asDiagonal();
}

Eigen::Vector2d ImageWarp::place_scale() const {
  return flow_.dimension() == 2 ? target_.scale() : Eigen::Vector2d(target_.scale().x(), 1);
}

warp::MovedPoints ImageWarp::forward(const Points& pixels) const {
  warp::MovedPoints moved = flow_.end_with_gradients(labels_of(pixels));
  moved.places = target_pixels(moved.places, pixels);
  moved.gradients =
      sandwiched(place_scale().cwiseInverse().asDiagonal(), in_plane_gradients(moved.gradients), label_scale());
  return moved;
}

warp::MovedPoints ImageWarp::backward(const Points& pixels) const {
  warp::MovedPoints moved = flow_.inverse(target_.to_landmarks(pixels).topRows(flow_.dimension()));
  moved.places = source_pixels(moved.places, pixels);
  moved.gradients =
      sandwiched(label_scale().inverse(), in_plane_gradients(moved.gradients), place_scale().asDiagonal());
  return moved;
}

Points ImageWarp::aligned(const Points& pixels) const { return target_pixels(labels_of(pixels), pixels); }

Points ImageWarp::aligned_backward(const Points& pixels) const {
  return source_pixels(target_.to_landmarks(pixels).topRows(flow_.dimension()), pixels);
}

std::vector<Points> ImageWarp::paths(const Points& pixels) const {
  std::vector<Points> places = flow_.paths(labels_of(pixels));
  for (Points& each : places) each = target_pixels(each, pixels);
  return places;
}

Points ImageWarp::label_pixels() const {
  const Points& labels = flow_.path().initial().q;
  return source_pixels(labels, source_.to_pixels(in_plane(labels, source_)));
}

std::vector<Points> ImageWarp::landmark_paths() const {
  std::vector<Points> places;
  for (const PhaseState& state : flow_.path().states) places.push_back(target_.to_pixels(in_plane(state.q, target_)));
  return places;
}

int ImageWarp::orientation() const { return label_scale().determinant() * place_scale().prod() < 0 ? -1 : 1; }

double ImageWarp::landmark_error() const {
  return flow_.landmark_error() / target_.scale().head(flow_.dimension()).cwiseAbs().minCoeff();
}

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
