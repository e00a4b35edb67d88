#include "pulson/core/frame.hpp"

namespace pulson {
namespace {

Eigen::Vector2d first_pixel(const Frame& frame) {
  return {frame.origin[0], frame.origin[1] + (frame.y_down ? 0 : frame.unit_per_pixel[1] * frame.height)};
}

}  // namespace

Eigen::Vector2d Frame::scale() const { return {unit_per_pixel[0], y_down ? unit_per_pixel[1] : -unit_per_pixel[1]}; }

Eigen::MatrixXd Frame::to_landmarks(const Eigen::MatrixXd& pixels) const {
  return (scale().asDiagonal() * pixels).colwise() + first_pixel(*this);
}

Eigen::MatrixXd Frame::to_pixels(const Eigen::MatrixXd& landmarks) const {
  return scale().cwiseInverse().asDiagonal() * (landmarks.colwise() - first_pixel(*this));
}

}  // namespace pulson
