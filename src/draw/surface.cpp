#include "surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

namespace pulson::draw {
namespace {

using Eigen::Vector3d;

constexpr double kDarkest = 0.56, kLightest = 0.97;  // grey of what is turned away from the light, and towards it

// Of the vertices: the sum of the triangles', each as large as its area; of length 1, or 0.
Eigen::Matrix3Xd normals_of(const SurfaceParts& surface) {
  const Points& vertices = surface.vertices;
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, vertices.cols());
  for (const auto& [a, b, c] : surface.triangles) {
    const Vector3d first = vertices.col(b) - vertices.col(a), second = vertices.col(c) - vertices.col(a);
    const Vector3d normal = first.cross(second);
    for (const int corner : {a, b, c}) {
      auto sum = normals.col(corner);
      sum += sum.dot(normal) < 0 ? Vector3d(-normal) : normal;  // triangles may be the other way round
    }
  }
  for (auto normal : normals.colwise())
    if (const double length = normal.norm(); length > 0) normal /= length;
  return normals;
}

// Triangles in pixels; of what overlaps, the nearest is kept.
class Shading {
 public:
  Shading(int width, int height)
      : raster_{width, height, std::vector<std::uint8_t>(4 * pixels(width, height), 0)},
        nearness_(pixels(width, height), -std::numeric_limits<double>::infinity()) {}

  // Columns: place in pixels from the upper left corner, and towards the viewer; normals towards right, up, viewer.
  void draw(const Eigen::Matrix3d& corners, const Eigen::Matrix3d& normals) {
    const auto x = corners.row(0), y = corners.row(1);
    const double area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
    if (area == 0) return;
    const int left = first_pixel(x.minCoeff(), raster_.width), right = first_pixel(x.maxCoeff(), raster_.width);
    const int top = first_pixel(y.minCoeff(), raster_.height), bottom = first_pixel(y.maxCoeff(), raster_.height);
    for (int row = top; row < bottom; ++row)
      for (int column = left; column < right; ++column) {
        const double px = column + 0.5, py = row + 0.5;
        Vector3d part;
        for (int k = 0; k < 3; ++k) {
          const int i = (k + 1) % 3, j = (k + 2) % 3;
          part[k] = ((x[i] - px) * (y[j] - py) - (x[j] - px) * (y[i] - py)) / area;
        }
        if (part.minCoeff() >= 0) put(row, column, corners.row(2).dot(part), normals * part);
      }
  }

  Raster take() && { return std::move(raster_); }

  // Of the surface at a place in pixels; −∞ where there is none.
  double nearness_at(double x, double y) const {
    if (!(x >= 0 && y >= 0 && x < raster_.width && y < raster_.height)) return -std::numeric_limits<double>::infinity();
    return nearness_[pixels(raster_.width, static_cast<int>(y)) + static_cast<std::size_t>(x)];
  }

 private:
  static std::size_t pixels(int width, int height) {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }

  // The first whose centre is not before the place.
  static int first_pixel(double place, int count) {
    return static_cast<int>(std::clamp(std::ceil(place - 0.5), 0.0, static_cast<double>(count)));
  }

  void put(int row, int column, double nearness, const Vector3d& normal) {
    const std::size_t pixel = pixels(raster_.width, row) + static_cast<std::size_t>(column);
    if (nearness <= nearness_[pixel]) return;
    nearness_[pixel] = nearness;
    static const Vector3d kLight = Vector3d(-0.4, 0.55, 0.75).normalized();
    const double lit = std::max(0.0, normal.dot(kLight)) / std::max(normal.norm(), 1e-9);
    const double grey = 255 * (kDarkest + (kLightest - kDarkest) * std::min(lit, 1.0));
    const auto byte = [](double value) { return static_cast<std::uint8_t>(std::lround(std::min(value, 255.0))); };
    const std::array<std::uint8_t, 4> colour = {byte(grey - 2), byte(grey), byte(grey + 3), 255};
    std::copy(colour.begin(), colour.end(), raster_.rgba.begin() + static_cast<std::ptrdiff_t>(4 * pixel));
  }

  Raster raster_;
  std::vector<double> nearness_;
};

}  // namespace

namespace {

// From space to pixels of a window, the third row towards the viewer.
class Projection {
 public:
  Projection(const Screen& screen, const Window& window)
      : window_(window), scale_(window.width / (window.high - window.low).x()) {
    view_ << screen, Vector3d(screen.row(0)).cross(Vector3d(screen.row(1))).transpose();
  }

  int height() const { return std::max(1, static_cast<int>(std::lround(scale_ * (window_.high - window_.low).y()))); }
  const Eigen::Matrix3d& view() const { return view_; }

  Eigen::Matrix3Xd places(const Points& points) const {
    Eigen::Matrix3Xd places = view_ * points;
    places.row(0) = scale_ * (places.row(0).array() - window_.low.x());
    places.row(1) = scale_ * (window_.high.y() - places.row(1).array());
    return places;
  }

 private:
  Window window_;
  double scale_;
  Eigen::Matrix3d view_;
};

Shading shading_of(const SurfaceParts& surface, const Projection& projection, const Window& window) {
  const Eigen::Matrix3Xd places = projection.places(surface.vertices);
  Eigen::Matrix3Xd normals = projection.view() * normals_of(surface);
  for (auto normal : normals.colwise())
    if (normal.z() < 0) normal = -normal.eval();  // of either side, that which is seen
  Shading shading(window.width, projection.height());
  for (const auto& triangle : surface.triangles)
    shading.draw(places(Eigen::all, triangle), normals(Eigen::all, triangle));
  return shading;
}

}  // namespace

Raster shaded(const SurfaceParts& surface, const Screen& screen, const Window& window) {
  return shading_of(surface, Projection(screen, window), window).take();
}

std::vector<int> points_behind(const SurfaceParts& surface, const Screen& screen, const Window& window,
                               const Points& points) {
  constexpr double kBelow = 0.02;  // of the diagonal
  const Projection projection(screen, window);
  const Shading shading = shading_of(surface, projection, window);
  const Eigen::Matrix3Xd places = projection.places(points);
  const double least = kBelow * (window.high - window.low).norm();
  std::vector<int> behind;
  for (int a = 0; a < points.cols(); ++a)
    if (shading.nearness_at(places(0, a), places(1, a)) > places(2, a) + least) behind.push_back(a);
  return behind;
}

}  // namespace pulson::draw
