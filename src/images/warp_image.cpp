#include "pulson/images/warp_image.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <iterator>
#include <limits>
#include <utility>

#include "channels.hpp"
#include "images/pushed_mesh.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/warp/sampled_map.hpp"
#include "warp/split_cells.hpp"

namespace pulson::images {
namespace {

using Eigen::Index;

bool is_outside(const std::array<float, 2>& place, const Image& image) {
  return !(place[0] >= -0.5F && place[1] >= -0.5F && place[0] <= static_cast<float>(image.width()) - 0.5F &&
           place[1] <= static_cast<float>(image.height()) - 0.5F);
}

// From pixel positions of one frame, whose rows begin at `first_row`, to places in another: in landmark units.
void append_displacements(const warp::SampledMap& map, int first_row, const Frame& from, const Frame& to,
                          std::vector<float>& all) {
  const auto count = static_cast<Index>(map.places.size());
  Points pixels(2, count), places(2, count);
  for (Index i = 0; i < count; ++i) {
    const Index row = i / map.columns;
    pixels.col(i) << static_cast<double>(i - row * map.columns), static_cast<double>(first_row + row);
    const auto& [x, y] = map.places[static_cast<std::size_t>(i)];
    places.col(i) << x, y;
  }
  const Eigen::MatrixXf difference = (to.to_landmarks(places) - from.to_landmarks(pixels)).cast<float>();
  all.insert(all.end(), difference.data(), difference.data() + difference.size());
}

// The result of a pull, some rows at a time.
class PulledRows {
 public:
  PulledRows(std::span<const Image* const> pages, const ImageWarp& warp, const WarpImageOptions& options)
      : first_(*pages.front()), warp_(warp), options_(options) {
    result_.pulled = true;
    for (const Image* page : pages) {
      const bool needs_alpha = options.border == Border::kTransparent && !page->has_alpha();
      pages_.push_back(needs_alpha ? &opaque_.emplace_back(with_alpha(*page)) : page);
      results_.emplace_back(options.width, options.height, pages_.back()->format());
    }
  }

  void add(int first_row, warp::SampledMap&& rows) {
    note_jacobians(rows);
    if (options_.with_displacements) {
      const bool inverse = options_.inverse;
      append_displacements(rows, first_row, inverse ? warp_.source() : warp_.target(),
                           inverse ? warp_.target() : warp_.source(), result_.displacements);
    }
    for (const auto& place : rows.places) result_.multiplicity.push_back(is_outside(place, first_) ? 0 : 1);
    const PixelMap map{rows.columns, rows.rows, std::move(rows.places)};
    for (std::size_t i = 0; i < pages_.size(); ++i) {
      const Image pulled = remap(*pages_[i], map, {options_.interpolation, options_.border, options_.fill});
      Image& whole = results_[i];
      const std::size_t row_bytes = whole.pixel_size() * static_cast<std::size_t>(options_.width);
      std::copy(pulled.bytes().begin(), pulled.bytes().end(),
                whole.bytes().begin() + static_cast<std::ptrdiff_t>(row_bytes * static_cast<std::size_t>(first_row)));
    }
  }

  WarpedImage result() && {
    MapFigures& figures = result_.figures;
    const auto outside = std::count(result_.multiplicity.begin(), result_.multiplicity.end(), 0);
    const auto inside = std::ssize(result_.multiplicity) - outside;
    figures.uncovered_fraction = static_cast<double>(outside) / static_cast<double>(result_.multiplicity.size());
    figures.max_multiplicity = inside > 0 ? 1 : 0;
    if (inside > 0) {
      figures.folded_fraction = static_cast<double>(folded_) / static_cast<double>(inside);
      // Of the map that moves the source. Where the map is flipped its inverse has no value, which the sign shows.
      figures.min_jacobian = options_.inverse || folded_ > 0 ? least_ : 1.0 / most_;
    }
    result_.holes.resize(result_.multiplicity.size());
    result_.image = std::move(results_.front());
    result_.more.assign(std::move_iterator(results_.begin() + 1), std::move_iterator(results_.end()));
    return std::move(result_);
  }

 private:
  // Of the image's own points: of other pixels the result shows nothing.
  void note_jacobians(const warp::SampledMap& rows) {
    const auto sign = static_cast<float>(warp_.orientation());
    for (std::size_t i = 0; i < rows.places.size(); ++i) {
      if (is_outside(rows.places[i], first_)) continue;
      const float jacobian = sign * rows.jacobians[i];
      least_ = std::min(least_, jacobian);
      most_ = std::max(most_, jacobian);
      folded_ += warp::is_fold(jacobian) ? 1 : 0;
    }
    result_.figures.map_error = std::max(result_.figures.map_error, rows.error);
  }

  const Image& first_;
  std::deque<Image> opaque_;         // pages with an alpha channel that they need
  std::vector<const Image*> pages_;  // those, or as they were given
  std::vector<Image> results_;
  const ImageWarp& warp_;
  const WarpImageOptions& options_;
  WarpedImage result_;
  float least_ = std::numeric_limits<float>::infinity();
  float most_ = -std::numeric_limits<float>::infinity();
  std::int64_t folded_ = 0;
};

// The largest cells to begin with: no larger than the width of the kernel in pixels, where its fields alone move space
// and have no kinks. A lattice of 64 pixels resolves far more than a tolerance asks for in a large picture.
int coarsest_cell(const ImageWarp& warp) {
  constexpr int kDefault = 64, kLargest = 512;
  const warp::MaterialFlow& flow = warp.flow();
  const Trajectory& path = flow.path();
  if (path.increments.rows() > 0) return kDefault;
  const double in_source = diameter(warp.label_pixels()) / diameter(path.initial().q);
  const double in_target = diameter(warp.landmark_paths().back()) / diameter(path.final().q);
  if (!(std::isfinite(in_source) && std::isfinite(in_target))) return kDefault;  // of a single landmark
  double width = kLargest;
  for (const KernelTerm& term : flow.system().kernel.terms())
    width = term.profile == KernelProfile::kPeakon ? 0 : std::min(width, term.alpha * std::min(in_source, in_target));
  return width > kDefault ? static_cast<int>(width) : kDefault;
}

WarpedImage pull(std::span<const Image* const> pages, const ImageWarp& warp, const WarpImageOptions& options) {
  const warp::PlaneMap map = [&](const Points& pixels) {
    return options.inverse ? warp.forward(pixels) : warp.backward(pixels);
  };
  PulledRows rows(pages, warp, options);
  sample_map_by_rows(
      map, {options.width, options.height, 0}, options.tolerance, true,
      [&](int first_row, warp::SampledMap&& band) { rows.add(first_row, std::move(band)); }, coarsest_cell(warp));
  return std::move(rows).result();
}

WarpedImage push(std::span<const Image* const> pages, const ImageWarp& warp, const WarpImageOptions& options) {
  PushedMesh mesh = push_image(pages, warp, options);
  const Image& image = *pages.front();
  WarpedImage result;
  MapFigures& figures = result.figures;
  figures.map_error = mesh.map_error;
  figures.min_jacobian = mesh.folds.min_jacobian;
  figures.folded_fraction = mesh.folds.folded_fraction;
  figures.max_multiplicity = mesh.pushed.coverage.max_multiplicity;
  figures.uncovered_fraction = mesh.pushed.coverage.uncovered_fraction();
  result.holes = warp::enclosed(mesh.pushed.uncovered, options.width, options.height);
  figures.hole_fraction = static_cast<double>(std::count(result.holes.begin(), result.holes.end(), true)) /
                          static_cast<double>(result.holes.size());
  result.multiplicity = std::move(mesh.pushed.multiplicity);
  result.image = std::move(mesh.pushed.image);
  result.more = std::move(mesh.pushed.more);
  if (options.with_displacements) {
    const auto forward = [&](const Points& pixels) { return warp.forward(pixels); };
    warp::sample_map_by_rows(forward, {image.width(), image.height(), 0}, options.tolerance, false,
                             [&](int first_row, const warp::SampledMap& rows) {
                               append_displacements(rows, first_row, warp.source(), warp.target(),
                                                    result.displacements);
                             });
  }
  return result;
}

}  // namespace

std::vector<float> label_order(const Image& image, const Points& landmarks, const std::vector<int>& ranks) {
  if (std::ssize(ranks) != landmarks.cols())
    throw InputError(std::to_string(ranks.size()) + " ranks for " + std::to_string(landmarks.cols()) + " landmarks");
  const double reach = median_nearest_distance(landmarks);
  std::vector<float> order(image.pixel_count());
  parallel_for(image.height(), [&](int y) {
    for (int x = 0; x < image.width(); ++x) {
      Index nearest = 0;
      const double squared = (landmarks.colwise() - Eigen::Vector2d(x, y).head(landmarks.rows()))
                                 .colwise()
                                 .squaredNorm()
                                 .minCoeff(&nearest);
      const bool is_near = squared <= reach * reach;
      order[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width()) + static_cast<std::size_t>(x)] =
          is_near ? static_cast<float>(ranks[static_cast<std::size_t>(nearest)]) : -1;
    }
  });
  return order;
}

namespace {

// The rows of the Jacobian at the pixels of an image, one band after the other.
template <class Use>
void for_jacobian_rows(const Image& image, const ImageWarp& warp, bool inverse, double tolerance, const Use& use) {
  const warp::PlaneMap map = [&](const Points& pixels) {
    return inverse ? warp.backward(pixels) : warp.forward(pixels);
  };
  const auto use_band = [&](int, warp::SampledMap&& band) {
    if (warp.orientation() < 0)
      for (float& jacobian : band.jacobians) jacobian = -jacobian;
    use(band.jacobians);
  };
  sample_map_by_rows(map, {image.width(), image.height(), 0}, tolerance, true, use_band, coarsest_cell(warp));
}

ImageFolds folds_of(const Image& image, const ImageWarp& warp, double tolerance) {
  ImageFolds folds;
  folds.folded.reserve(image.pixel_count());
  folds.min_jacobian = std::numeric_limits<double>::infinity();
  for_jacobian_rows(image, warp, false, tolerance, [&](const std::vector<float>& jacobians) {
    for (const float jacobian : jacobians) {
      folds.folded.push_back(warp::is_fold(jacobian));
      folds.min_jacobian = std::min<double>(folds.min_jacobian, jacobian);
    }
  });
  folds.folded_fraction = static_cast<double>(std::count(folds.folded.begin(), folds.folded.end(), true)) /
                          static_cast<double>(folds.folded.size());
  return folds;
}

// The corners of the image's pixels, and of cells that are split.
warp::DeformedMesh mesh_of(const Image& image, const ImageWarp& warp, const ImageFolds& folds, double tolerance,
                           double& error) {
  const warp::PlaneMap map = [&](const Points& pixels) { return warp.forward(pixels); };
  warp::DeformedMesh mesh{image.width() + 1, image.height() + 1, {}};
  mesh.vertices.reserve(static_cast<std::size_t>(mesh.columns) * static_cast<std::size_t>(mesh.rows));
  sample_map_by_rows(map, {mesh.columns, mesh.rows, -0.5}, tolerance, false, [&](int, const warp::SampledMap& rows) {
    mesh.vertices.insert(mesh.vertices.end(), rows.places.begin(), rows.places.end());
    error = std::max(error, rows.error);
  });
  std::vector<bool> reversed = folds.folded;
  if (warp.orientation() < 0) reversed.flip();
  split_cells(map, reversed, mesh);
  return mesh;
}

}  // namespace

PushedMesh push_image(std::span<const Image* const> pages, const ImageWarp& warp, const WarpImageOptions& options) {
  const Image& image = *pages.front();
  PushedMesh result;
  result.folds = folds_of(image, warp, options.tolerance);
  warp::DeformedMesh mesh = mesh_of(image, warp, result.folds, options.tolerance, result.map_error);
  const warp::RasterOptions raster{
      .width = options.width, .height = options.height, .supersampling = options.supersampling, .over = options.over};
  PushOptions push{options.interpolation, std::nullopt};
  if (options.border != Border::kTransparent) push.fill = options.fill;
  std::vector<float> priority;
  if (raster.over == warp::SheetOrder::kPriority)
    priority = label_order(image, warp.label_pixels().topRows(warp.flow().dimension()), options.label_ranks);
  result.pushed = push_forward(pages, std::move(mesh), raster, push, std::move(priority));
  return result;
}

std::vector<float> jacobians_on_image(const Image& image, const ImageWarp& warp, const WarpImageOptions& options) {
  std::vector<float> all;
  all.reserve(image.pixel_count());
  for_jacobian_rows(image, warp, options.inverse, options.tolerance, [&](const std::vector<float>& jacobians) {
    all.insert(all.end(), jacobians.begin(), jacobians.end());
  });
  return all;
}

std::vector<float> displacements_on_image(const Image& image, const ImageWarp& warp, const WarpImageOptions& options) {
  const warp::PlaneMap map = [&](const Points& pixels) {
    return options.inverse ? warp.backward(pixels) : warp.forward(pixels);
  };
  const warp::SampledMap sampled =
      sample_map(map, {image.width(), image.height(), 0}, options.tolerance, false, coarsest_cell(warp));
  std::vector<float> lengths(sampled.places.size());
  parallel_for(image.height(), [&](int y) {
    Points here(2, image.width()), there(2, image.width());
    const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width());
    for (int x = 0; x < image.width(); ++x) {
      const auto& place = sampled.places[first + static_cast<std::size_t>(x)];
      here.col(x) << x, y;
      there.col(x) << place[0], place[1];
    }
    const Points moved = options.inverse ? Points(here - warp.aligned(there)) : Points(there - warp.aligned(here));
    const Eigen::VectorXf all = (warp.target().scale().asDiagonal() * moved).colwise().norm().cast<float>();
    std::copy(all.begin(), all.end(), lengths.begin() + static_cast<std::ptrdiff_t>(first));
  });
  return lengths;
}

WarpedImage warp_image(const Image& image, const ImageWarp& warp, const WarpImageOptions& options) {
  const Image* const page = &image;
  return warp_image({&page, 1}, warp, options);
}

WarpedImage warp_image(std::span<const Image* const> pages, const ImageWarp& warp, const WarpImageOptions& options) {
  for (const Image* page : pages)
    if (page->width() != pages.front()->width() || page->height() != pages.front()->height())
      throw InputError("pages of " + std::to_string(page->width()) + " x " + std::to_string(page->height()) + " and " +
                       std::to_string(pages.front()->width()) + " x " + std::to_string(pages.front()->height()) +
                       " pixels cannot be warped by one map");
  check_pixel_count(options.width, options.height, options.max_pixels, "the warped image");
  const bool may_push = options.method != WarpMethod::kPull, may_pull = options.method != WarpMethod::kPush;
  if (options.inverse) {
    if (!may_pull) throw InputError("`inverse` always pulls the image; it cannot be combined with `method = push`");
    WarpedImage result = pull(pages, warp, options);
    result.reason = "each pixel of the source looks up its image under the map";
    return result;
  }
  const bool is_invertible = warp.flow().is_diffeomorphic();
  if (!may_push && !is_invertible)
    throw InputError("`method = pull` needs a map that has an inverse; here the noise moves landmarks individually");
  if (may_pull && is_invertible) {
    WarpedImage result = pull(pages, warp, options);
    if (result.figures.folded_fraction == 0) {
      result.reason = "the map is a diffeomorphism";
      return result;
    }
    if (!may_push)
      throw InputError("`method = pull`: the time steps are too long for an inverse; register with more `grid.steps`");
  }
  WarpedImage result = push(pages, warp, options);
  result.reason = !may_pull                            ? "as requested"
                  : is_invertible                      ? "the time steps are too long for an inverse"
                  : result.figures.folded_fraction > 0 ? "the map folds"
                                                       : "the noise moves landmarks individually, but nothing folds";
  return result;
}

}  // namespace pulson::images
