#include <algorithm>
#include <cstddef>
#include <string>

#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "warp/mesh_raster.hpp"

namespace pulson::warp {

namespace {

constexpr EnumNames<SheetOrder, 4> kRules = {"rule for what is on top",
                                             {{{"least-stretched", SheetOrder::kLeastStretched},
                                               {"average", SheetOrder::kAverage},
                                               {"first", SheetOrder::kFirst},
                                               {"label-order", SheetOrder::kPriority}}}};

}  // namespace

SheetOrder parse_over(std::string_view name) { return kRules.parse(name); }

std::string over_name(SheetOrder over) { return kRules.name(over); }

namespace {

// Takes the pixels off a mask that are reached from where it is started.
class Eraser {
 public:
  Eraser(std::vector<bool>& mask, int width, int height) : mask_(mask), width_(width), height_(height) {}

  void erase_from(int x, int y) {
    visit(x, y);
    while (!reached_.empty()) {
      const Pixel pixel = reached_.back();
      reached_.pop_back();
      visit(pixel.x - 1, pixel.y);
      visit(pixel.x + 1, pixel.y);
      visit(pixel.x, pixel.y - 1);
      visit(pixel.x, pixel.y + 1);
    }
  }

 private:
  struct Pixel {
    int x, y;
  };

  void visit(int x, int y) {
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
    const std::size_t index =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    if (!mask_[index]) return;
    mask_[index] = false;
    reached_.push_back({x, y});
  }

  std::vector<bool>& mask_;
  int width_;
  int height_;
  std::vector<Pixel> reached_;  ///< whose neighbours are still to be visited
};

}  // namespace

double Coverage::uncovered_fraction() const {
  return samples > 0 ? static_cast<double>(uncovered) / static_cast<double>(samples) : 0;
}

Coverage& Coverage::operator+=(const Coverage& other) {
  max_multiplicity = std::max(max_multiplicity, other.max_multiplicity);
  samples += other.samples;
  uncovered += other.uncovered;
  return *this;
}

Coverage coverage(const RasterBand& band) {
  Coverage result;
  result.samples = static_cast<std::int64_t>(band.counts.size());
  result.uncovered = std::count(band.counts.begin(), band.counts.end(), 0);
  for (const std::uint8_t count : band.counts) result.max_multiplicity = std::max<int>(result.max_multiplicity, count);
  return result;
}

std::vector<bool> uncovered_pixels(const RasterBand& band) {
  const auto s = static_cast<std::size_t>(band.supersampling);
  const auto width = static_cast<std::size_t>(band.width);
  std::vector<bool> mask(width * static_cast<std::size_t>(band.rows), true);
  for (std::size_t sample = 0; sample < band.counts.size(); ++sample) {
    if (band.counts[sample] == 0) continue;
    const std::size_t row = sample / (width * s);
    const std::size_t column = sample % (width * s);
    mask[row / s * width + column / s] = false;
  }
  return mask;
}

std::vector<bool> enclosed(const std::vector<bool>& mask, int width, int height) {
  if (width < 1 || height < 1 || mask.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw InputError("mask of " + std::to_string(mask.size()) + " pixels is not of size " + std::to_string(width) +
                     " x " + std::to_string(height));
  std::vector<bool> holes = mask;
  Eraser eraser(holes, width, height);
  for (int x = 0; x < width; ++x) {
    eraser.erase_from(x, 0);
    eraser.erase_from(x, height - 1);
  }
  for (int y = 0; y < height; ++y) {
    eraser.erase_from(0, y);
    eraser.erase_from(width - 1, y);
  }
  return holes;
}

}  // namespace pulson::warp
