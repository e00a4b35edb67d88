#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "draw/animation.hpp"
#include "images/compose.hpp"
#include "images/pushed_mesh.hpp"
#include "pictures.hpp"
#include "shell/messages.hpp"

namespace pulson {
namespace {

using Eigen::Index;

constexpr double kLongestFrame = 640;
constexpr int kSpacing = 4;  // vertices between two that are moved exactly

// The pixel corners of a small picture: some moved exactly, the others by bilinear interpolation.
class Corners {
 public:
  explicit Corners(const images::Image& small)
      : columns_(small.width() + 1), rows_(small.height() + 1), across_(count(columns_)), down_(count(rows_)) {}

  // Of the exact ones, in pixels of the small picture.
  Points exact() const {
    Points corners(2, static_cast<Index>(across_) * down_);
    for (int j = 0; j < down_; ++j)
      for (int i = 0; i < across_; ++i)
        corners.col(static_cast<Index>(j) * across_ + i) << i * kSpacing - 0.5, j * kSpacing - 0.5;
    return corners;
  }

  warp::DeformedMesh mesh(const Points& places) const {
    warp::DeformedMesh mesh{columns_, rows_, {}};
    mesh.vertices.reserve(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
    for (int y = 0; y < rows_; ++y)
      for (int x = 0; x < columns_; ++x) {
        const Index at = static_cast<Index>(y / kSpacing) * across_ + x / kSpacing;
        const double u = x % kSpacing / static_cast<double>(kSpacing);
        const double v = y % kSpacing / static_cast<double>(kSpacing);
        const Eigen::Vector2f place = ((1 - v) * ((1 - u) * places.col(at) + u * places.col(at + 1)) +
                                       v * ((1 - u) * places.col(at + across_) + u * places.col(at + across_ + 1)))
                                          .cast<float>();
        mesh.vertices.push_back({place.x(), place.y()});
      }
    return mesh;
  }

 private:
  static int count(int vertices) { return (vertices - 1) / kSpacing + 2; }

  int columns_, rows_;
  int across_, down_;
};

// Between the pixels of a picture and those of one smaller by a factor, see scaled_down.
Points enlarged(const Points& pixels, double factor) { return ((pixels.array() + 0.5) * factor - 0.5).matrix(); }
Points reduced(const Points& pixels, double factor) { return ((pixels.array() + 0.5) / factor - 0.5).matrix(); }

}  // namespace

void write_animation(const images::Image& image, const images::ImageWarp& warp, const WarpFrames& frames,
                     const WarpArguments& arguments) {
  const int longest = std::max({image.width(), image.height(), frames.width, frames.height});
  const double factor = std::max(1.0, longest / kLongestFrame);
  const images::Image small = scaled_down(images::to_rgba8(for_show(image)), factor);
  const int width = std::max(1, static_cast<int>(std::lround(frames.width / factor)));
  const int height = std::max(1, static_cast<int>(std::lround(frames.height / factor)));
  const Corners corners(small);
  const std::vector<Points> places = warp.paths(enlarged(corners.exact(), factor));
  std::vector<Points> landmarks = warp.landmark_paths();
  for (Points& each : landmarks) each = reduced(each, factor);

  const warp::SheetOrder over = warp::parse_over(arguments.over);
  std::vector<float> priority;
  if (over == warp::SheetOrder::kPriority)
    priority = images::label_order(small, reduced(warp.label_pixels(), factor).topRows(warp.flow().dimension()),
                                   frames.label_ranks);
  Progress progress;
  draw::Animation animation(arguments.animate, width, height, draw::kFramesPerSecond);
  for (std::size_t k = 0; k < places.size(); ++k) {
    progress.show(static_cast<double>(k) / static_cast<double>(places.size()), "animation");
    if (Interrupt::came()) throw InputError("interrupted");
    const warp::RasterOptions raster{.width = width, .height = height, .supersampling = 2, .over = over};
    const images::PushedImage pushed =
        push_forward(small, corners.mesh(reduced(places[k], factor)), raster, {.fill = std::nullopt}, priority);
    const std::vector<std::uint8_t> frame = images::rgb_on_white(with_landmarks(pushed.image, landmarks, k, 1));
    const bool at_end = k == 0 || k + 1 == places.size();
    for (int repeat = 0; repeat < (at_end ? draw::kRestingFrames : 1); ++repeat) animation.add(frame);
  }
  animation.finish();
}

}  // namespace pulson
