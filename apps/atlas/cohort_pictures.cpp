#include "cohort_pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>

#include <Eigen/LU>
#include <fmt/format.h>

#include "images/compose.hpp"
#include "pulson/core/alignment.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/warp/material_flow.hpp"
#include "shell/messages.hpp"
#include "shell/picture_sizes.hpp"
#include "warp/placed_picture.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using images::Image;

constexpr double kBoxMargin = 0.12;  // about the template, of its longer side, as pictures of registrations have it
constexpr int kLongestMean = 480;    // pixels of the longer side
constexpr double kOwnFactor = 2;     // by which the specimens' own pictures are smaller, as a page holds many
constexpr int kNodes = 48;           // of the grid that the flow moves, along the longer side; bilinear between
constexpr std::size_t kMostPictures = 150;

warp::MaterialFlow flow_of(const cohort::Atlas& atlas, const Trajectory& path) {
  return {{atlas.kernel, make_noise("none", {})}, path};
}

/// A picture over a box of the plane.
class Sheet {
 public:
  Sheet(const Vector2d& low, const Vector2d& high, bool y_down) : low_(low), high_(high), y_down_(y_down) {
    const Vector2d size = (high - low) / (high - low).maxCoeff();
    width_ = std::max(2, static_cast<int>(std::lround(kLongestMean * size.x())));
    height_ = std::max(2, static_cast<int>(std::lround(kLongestMean * size.y())));
    columns_ = std::max(2, static_cast<int>(std::lround(kNodes * size.x())));
    rows_ = std::max(2, static_cast<int>(std::lround(kNodes * size.y())));
  }

  int width() const { return width_; }
  int height() const { return height_; }
  double pixel() const { return (high_ - low_).x() / width_; }

  /// The nodes of the grid, row by row from the top of the picture, at its edges too.
  Points nodes() const {
    Points nodes(2, static_cast<Index>(columns_) * rows_);
    for (int r = 0, k = 0; r < rows_; ++r)
      for (int c = 0; c < columns_; ++c, ++k)
        nodes.col(k) = place(static_cast<double>(c) / (columns_ - 1), static_cast<double>(r) / (rows_ - 1));
    return nodes;
  }

  /// From places of the nodes in another picture's pixels to what that has there.
  Image pulled(const Image& picture, const Points& nodes) const {
    Image result(width_, height_, 4, images::PixelType::kUint8);
    const auto values = result.values<std::uint8_t>();
    std::size_t at = 0;
    for (int r = 0; r < height_; ++r)
      for (int c = 0; c < width_; ++c, at += 4) {
        const Vector2d from = between(nodes, (c + 0.5) / width_ * (columns_ - 1), (r + 0.5) / height_ * (rows_ - 1));
        const std::array<double, 4> colour = colour_at(picture, from);
        for (std::size_t i = 0; i < 4; ++i) values[at + i] = static_cast<std::uint8_t>(std::lround(colour.at(i)));
      }
    return result;
  }

  /// Pixels of this picture at places of the plane, 2×M.
  Points pixels(const Points& places) const {
    Points pixels(2, places.cols());
    const Vector2d size = high_ - low_;
    pixels.row(0) = (places.row(0).array() - low_.x()) * (width_ / size.x()) - 0.5;
    if (y_down_)
      pixels.row(1) = (places.row(1).array() - low_.y()) * (height_ / size.y()) - 0.5;
    else
      pixels.row(1) = (high_.y() - places.row(1).array()) * (height_ / size.y()) - 0.5;
    return pixels;
  }

 private:
  // Parts of the width and, from the top, of the height.
  Vector2d place(double right, double down) const {
    const Vector2d part(right, y_down_ ? down : 1 - down);
    return low_ + part.cwiseProduct(high_ - low_);
  }

  Vector2d between(const Points& nodes, double column, double row) const {
    const int c = std::min(static_cast<int>(column), columns_ - 2), r = std::min(static_cast<int>(row), rows_ - 2);
    const double s = column - c, t = row - r;
    const Index k = static_cast<Index>(r) * columns_ + c;
    return (1 - t) * ((1 - s) * nodes.col(k) + s * nodes.col(k + 1)) +
           t * ((1 - s) * nodes.col(k + columns_) + s * nodes.col(k + columns_ + 1));
  }

  // Bilinear, transparent outside. @param picture RGBA of 8 bits
  static std::array<double, 4> colour_at(const Image& picture, const Vector2d& pixel) {
    const double x = pixel.x(), y = pixel.y();
    if (!(x > -0.5 && y > -0.5 && x < picture.width() - 0.5 && y < picture.height() - 0.5)) return {};
    const auto values = picture.values<std::uint8_t>();
    const double cx = std::clamp(x, 0.0, picture.width() - 1.0), cy = std::clamp(y, 0.0, picture.height() - 1.0);
    const int c = static_cast<int>(cx), r = static_cast<int>(cy);
    const int right = std::min(c + 1, picture.width() - 1), below = std::min(r + 1, picture.height() - 1);
    const double s = cx - c, t = cy - r;
    std::array<double, 4> colour{};
    for (std::size_t i = 0; i < 4; ++i) {
      const auto value = [&](int column, int row) {
        return static_cast<double>(values[4 * (static_cast<std::size_t>(row) * picture.width() + column) + i]);
      };
      colour.at(i) = (1 - t) * ((1 - s) * value(c, r) + s * value(right, r)) +
                     t * ((1 - s) * value(c, below) + s * value(right, below));
    }
    return colour;
  }

  Vector2d low_, high_;
  bool y_down_;
  int width_, height_, columns_, rows_;
};

Sheet sheet_of(const CohortPictures& pictures, const cohort::Atlas& atlas) {
  return {pictures.low, pictures.high, atlas.template_shape.frame.y_down};
}

/// A specimen's picture on the template.
Image on_template(const cohort::Atlas& atlas, const cohort::AtlasSpecimen& specimen, const Landmarks& shape,
                  const std::filesystem::path& file, const Sheet& sheet) {
  const PlacedPicture placed = place_picture(read_picture(file, images::kMaxPixels), file.string(), shape, {});
  const Alignment pose = align(shape.points, specimen.shape.points, AlignmentKind::kSimilarity);
  const Points ends = flow_of(atlas, atlas.geodesic(specimen.momenta)).end(sheet.nodes());
  const Eigen::MatrixXd back = (pose.scale * pose.linear).inverse();
  const Points nodes = placed.frame.to_pixels(back * (ends.colwise() - pose.translation));
  // Reduced to about the resolution of the sheet, so that no detail is skipped.
  const double factor = std::max(1.0, sheet.pixel() / pose.scale / std::abs(placed.frame.unit_per_pixel[0]));
  Image picture = to_rgba8(for_show(placed.picture.image));
  Points places = nodes;
  if (factor > 1) {
    const double width = picture.width(), height = picture.height();
    picture = scaled_down(picture, factor);
    places.row(0) = (nodes.row(0).array() + 0.5) * (picture.width() / width) - 0.5;
    places.row(1) = (nodes.row(1).array() + 0.5) * (picture.height() / height) - 0.5;
  }
  return sheet.pulled(picture, places);
}

/// Sums of colours by their opacity.
class MeanPicture {
 public:
  explicit MeanPicture(const Sheet& sheet)
      : width_(sheet.width()), height_(sheet.height()), sums_(4 * static_cast<std::size_t>(width_) * height_, 0) {}

  void add(const Image& image) {
    const auto values = image.values<std::uint8_t>();
    for (std::size_t i = 0; i < sums_.size(); i += 4) {
      for (std::size_t c = 0; c < 3; ++c) sums_[i + c] += static_cast<double>(values[i + c]) * values[i + 3];
      sums_[i + 3] += values[i + 3];
    }
    ++count_;
  }

  Image mean() const {
    Image image(width_, height_, 4, images::PixelType::kUint8);
    const auto values = image.values<std::uint8_t>();
    for (std::size_t i = 0; i < sums_.size(); i += 4) {
      for (std::size_t c = 0; c < 3; ++c)
        values[i + c] = static_cast<std::uint8_t>(sums_[i + 3] > 0 ? std::lround(sums_[i + c] / sums_[i + 3]) : 0);
      values[i + 3] = static_cast<std::uint8_t>(std::lround(sums_[i + 3] / count_));
    }
    return image;
  }

 private:
  int width_, height_;
  std::vector<double> sums_;
  int count_ = 0;
};

}  // namespace

std::optional<CohortPictures> cohort_pictures(const cohort::Atlas& atlas, const std::vector<Landmarks>& shapes,
                                              std::vector<std::string>& notes) {
  if (atlas.template_shape.dimension() != 2) return std::nullopt;
  std::vector<std::optional<std::filesystem::path>> files;
  std::size_t known = 0;
  for (const Landmarks& shape : shapes) {
    files.push_back(known < kMostPictures ? picture_beside(shape) : std::nullopt);
    known += files.back() ? 1 : 0;
  }
  if (known == 0) return std::nullopt;
  CohortPictures pictures;
  const auto [low, high] = bounding_box(atlas.template_shape.points);
  const double margin = kBoxMargin * (high - low).maxCoeff();
  pictures.low = low.array() - margin;
  pictures.high = high.array() + margin;
  const Sheet sheet = sheet_of(pictures, atlas);
  MeanPicture mean(sheet);
  Progress progress;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    pictures.each.emplace_back();
    if (!files[i]) continue;
    progress.show(static_cast<double>(i) / static_cast<double>(shapes.size()), "pictures of the cohort");
    try {
      const Image own = on_template(atlas, atlas.specimens[i], shapes[i], *files[i], sheet);
      mean.add(own);
      pictures.each.back() = scaled_down(own, kOwnFactor);
      ++pictures.count;
    } catch (const std::exception& error) {  // whatever it is: numbers do not depend on a picture
      notes.push_back(fmt::format("{}: it is not in the mean picture: {}", files[i]->string(), error.what()));
    }
  }
  if (pictures.count == 0) return std::nullopt;
  pictures.mean = mean.mean();
  return pictures;
}

std::optional<images::Image> carried_picture(const CohortPictures& pictures, const cohort::Atlas& atlas,
                                             const Trajectory& path) try {
  const Sheet sheet = sheet_of(pictures, atlas);
  return sheet.pulled(pictures.mean, sheet.pixels(flow_of(atlas, path).inverse(sheet.nodes()).places));
} catch (const NumericalError&) {
  return std::nullopt;
}

}  // namespace pulson
