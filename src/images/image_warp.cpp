#include "pulson/images/image_warp.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

#include "channels.hpp"
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

namespace {

using images::mat_of;

int opencv_interpolation(Interpolation interpolation) {
  switch (interpolation) {
    case Interpolation::kNearest:
    case Interpolation::kLabel:
      return cv::INTER_NEAREST;
    case Interpolation::kLinear:
      return cv::INTER_LINEAR;
    case Interpolation::kCubic:
      return cv::INTER_CUBIC;
    case Interpolation::kLanczos:
      return cv::INTER_LANCZOS4;
  }
  return cv::INTER_LINEAR;
}

int opencv_border(Border border) {
  if (border == Border::kReplicate) return cv::BORDER_REPLICATE;
  return border == Border::kReflect ? cv::BORDER_REFLECT : cv::BORDER_CONSTANT;
}

void check_size(int width, int height, const std::string& what) {
  constexpr int kLongest = SHRT_MAX - 1;
  if (width <= kLongest && height <= kLongest) return;
  throw InputError(what + " has " + std::to_string(width) + " x " + std::to_string(height) + " pixels; at most " +
                   std::to_string(kLongest) + " on a side can be warped: scale it down first");
}

constexpr int kWidestFilter = 8;

/// The coordinate, or one near the image at which the border rule gives the same value: cv::remap keeps 16 bits.
float near_image(float x, int size, Border border) {
  const auto length = static_cast<double>(size);
  if (border == Border::kReflect) {
    // Mirrors at -1/2 and length - 1/2.
    double folded = x - 2 * length * std::floor((x + 0.5) / (2 * length));
    if (folded > length - 0.5) folded = 2 * length - 1 - folded;
    return static_cast<float>(folded);
  }
  return static_cast<float>(std::clamp<double>(x, -kWidestFilter, length + kWidestFilter));
}

struct SamplingPlaces {
  cv::Mat coordinates;   ///< two float32 a pixel, in the rows of the source from `rows.start` on
  cv::Mat is_nowhere;    ///< 255 or 0
  cv::Range rows{0, 1};  ///< of the source, that some place can see
};

/// Moves the coordinates to the rows of the source that they see, from `low` to `high` and the width of a filter
/// around.
void keep_to_rows(SamplingPlaces& places, float low, float high, int height) {
  if (!(low <= high)) return;  // all nowhere
  places.rows.start = std::clamp(static_cast<int>(low) - kWidestFilter, 0, height - 1);
  places.rows.end = std::clamp(static_cast<int>(high) + kWidestFilter, places.rows.start, height - 1) + 1;
  const auto first = static_cast<float>(places.rows.start);
  for (int y = 0; y < places.coordinates.rows; ++y)
    for (int x = 0; x < places.coordinates.cols; ++x) places.coordinates.at<cv::Vec2f>(y, x)[1] -= first;
}

SamplingPlaces places_of(const PixelMap& map, const Image& source, Border border) {
  SamplingPlaces result{cv::Mat(map.height, map.width, CV_32FC2), cv::Mat(map.height, map.width, CV_8U)};
  float low = std::numeric_limits<float>::max(), high = std::numeric_limits<float>::lowest();
  for (std::size_t i = 0; i < map.places.size(); ++i) {
    const auto [x, y] = map.places[i];
    const bool is_place = std::isfinite(x) && std::isfinite(y);
    cv::Vec2f& to = result.coordinates.ptr<cv::Vec2f>()[i];
    result.is_nowhere.data[i] = is_place ? 0 : 255;
    to = cv::Vec2f(0, 0);
    if (!is_place) continue;
    to = cv::Vec2f(near_image(x, source.width(), border), near_image(y, source.height(), border));
    low = std::min(low, to[1]);
    high = std::max(high, to[1]);
  }
  keep_to_rows(result, low, high, source.height());
  return result;
}

}  // namespace

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

Image remap(const Image& source, const PixelMap& map, const RemapOptions& options) {
  if (source.empty()) throw InputError("there is no image to be warped");
  if (map.width <= 0 || map.height <= 0 ||
      map.places.size() != static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height))
    throw InputError("warped image of " + std::to_string(map.width) + " x " + std::to_string(map.height) +
                     " pixels: there are places for " + std::to_string(map.places.size()));
  check_size(source.width(), source.height(), "the image");
  check_size(map.width, map.height, "the warped image");
  const bool is_transparent = options.border == Border::kTransparent;
  const Border border = is_transparent ? Border::kConstant : options.border;
  const std::array<double, 4> filling = is_transparent ? std::array<double, 4>{} : options.fill;
  const SamplingPlaces places = places_of(map, source, border);
  cv::Mat visible = mat_of(source).rowRange(places.rows);
  if (is_transparent && !source.has_alpha()) visible = images::with_alpha(visible);
  Image result(map.width, map.height, visible.channels(), source.depth());
  const cv::Scalar fill(filling[0], filling[1], filling[2], filling[3]);
  cv::Scalar beyond = fill;
  const bool is_mixed =
      options.interpolation != Interpolation::kNearest && options.interpolation != Interpolation::kLabel;
  const int alpha = result.channels() - 1;
  if (is_mixed && result.has_alpha())
    for (int c = 0; c < alpha; ++c) beyond[c] *= filling[static_cast<std::size_t>(alpha)] / full_value(source.depth());
  const auto filter = [&](const cv::Mat& from, cv::Mat& to) {
    cv::remap(from, to, places.coordinates, cv::noArray(), opencv_interpolation(options.interpolation),
              opencv_border(border), beyond);
  };
  cv::Mat pixels = mat_of(result);
  if (is_mixed)
    images::filter_pixels(visible, result, filter);
  else
    filter(visible, pixels);
  pixels.setTo(fill, places.is_nowhere);
  return result;
}

}  // namespace pulson::images
