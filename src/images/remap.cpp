// Images looked up at places between their pixels, for every type of number.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <string>
#include <type_traits>
#include <vector>

#include "channels.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/images/image_warp.hpp"
#include "rounding.hpp"

namespace pulson::images {
namespace {

/// Pixels that the value between is made of, along each axis.
int filter_width(Interpolation interpolation) {
  switch (interpolation) {
    case Interpolation::kLinear:
      return 2;
    case Interpolation::kCubic:
      return 4;
    case Interpolation::kLanczos:
      return 8;
    case Interpolation::kNearest:
    case Interpolation::kLabel:
      break;
  }
  return 1;
}

/// The weights of `kWidth` pixels for a place `t` from 0 to 1 after the middle ones' first.
template <int kWidth, class Sum>
void set_weights(Sum t, std::array<Sum, kWidth>& weights) {
  if constexpr (kWidth == 2) {
    weights = {1 - t, t};
  } else if constexpr (kWidth == 4) {
    constexpr Sum a = Sum(-0.75);  // Keys (1981), with the slope that OpenCV and Photoshop have
    const Sum u = 1 - t;
    weights[0] = a * t * u * u;
    weights[3] = a * u * t * t;
    weights[1] = ((a + 2) * t - (a + 3)) * t * t + 1;
    weights[2] = 1 - weights[0] - weights[1] - weights[3];
  } else {
    // sinc(x) sinc(x/4) at x = t + 3 − k up to a common factor: sin(πx) only changes its sign with k.
    constexpr Sum kQuarter = std::numbers::pi_v<Sum> / 4, kHalfRoot = std::numbers::sqrt2_v<Sum> / 2;
    constexpr std::array<Sum, 8> kSines{0, -kHalfRoot, -1, -kHalfRoot, 0, kHalfRoot, 1, kHalfRoot};
    constexpr std::array<Sum, 8> kCosines{1, kHalfRoot, 0, -kHalfRoot, -1, -kHalfRoot, 0, kHalfRoot};
    const Sum angle = kQuarter * (t + 3), sine = std::sin(angle), cosine = std::cos(angle);
    Sum sum = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      const Sum x = t + Sum(3) - static_cast<Sum>(k);
      weights[k] = (k % 2 == 0 ? 1 : -1) * (sine * kCosines[k] + cosine * kSines[k]) / (x * x);
      sum += weights[k];
    }
    for (Sum& weight : weights) weight /= sum;
  }
}

/// The pixel at which the border rule finds the value of one outside; -1: none.
int inside(int at, int size, Border border) {
  if (at >= 0 && at < size) return at;
  if (border == Border::kReplicate) return std::clamp(at, 0, size - 1);
  if (border != Border::kReflect) return -1;
  const int period = 2 * size, folded = ((at % period) + period) % period;
  return std::min(folded, period - 1 - folded);
}

/// A coordinate near the image at which the border rule gives the same value, so that it fits into an int.
double near_image(double x, int size, Border border) {
  constexpr double kBeyondFilters = 16;
  if (border != Border::kReflect) return std::clamp(x, -kBeyondFilters, size + kBeyondFilters);
  return x - 2.0 * size * std::floor((x + 0.5) / (2.0 * size));
}

/// A coordinate as a pixel and what is over.
template <class Sum>
struct Position {
  int first;
  Sum over;  ///< 0: a whole pixel
};

template <class Value, int kChannels>  // 0: any number
class Sampler {
 public:
  using Sum = images::Sum<Value>;

  Sampler(const Image& source, const PixelMap& map, const RemapOptions& options, Image& result)
      : source_(source),
        map_(map),
        border_(options.border == Border::kTransparent ? Border::kConstant : options.border),
        from_(source.values<Value>().data()),
        to_(result.values<Value>().data()),
        channels_(kChannels > 0 ? kChannels : source.channels()),
        // Places are float32: at the far edge they are apart by that, and a few operations were made on them.
        rounding_(4.0 * std::numeric_limits<float>::epsilon() * std::max(source.width(), source.height())),
        full_(source.full()),
        fill_(static_cast<std::size_t>(channels_)) {
    if (options.border == Border::kTransparent) return;
    for (std::size_t c = 0; c < std::min(fill_.size(), options.fill.size()); ++c)
      fill_[c] = rounded<Value>(static_cast<Sum>(options.fill[c]), full_);
  }

  void run(Interpolation interpolation) {
    constexpr int kRows = 16;
    parallel_for((map_.height + kRows - 1) / kRows, [&](int band) {
      const int end = std::min(map_.height, (band + 1) * kRows);
      switch (filter_width(interpolation)) {
        case 2:
          return sample_rows<2>(band * kRows, end);
        case 4:
          return sample_rows<4>(band * kRows, end);
        case 8:
          return sample_rows<8>(band * kRows, end);
        default:
          return sample_rows<1>(band * kRows, end);
      }
    });
  }

 private:
  template <int kWidth>
  void sample_rows(int first, int end) const {
    std::vector<Value> patch(static_cast<std::size_t>(kWidth * kWidth) * static_cast<std::size_t>(channels_));
    const auto width = static_cast<std::size_t>(map_.width);
    for (std::size_t i = static_cast<std::size_t>(first) * width; i < static_cast<std::size_t>(end) * width; ++i) {
      Value* const to = to_ + i * static_cast<std::size_t>(channels_);
      const auto [x, y] = map_.places[i];
      if (!std::isfinite(x) || !std::isfinite(y)) {
        std::copy_n(fill_.data(), channels_, to);
        continue;
      }
      const Position<Sum> column = position(x, source_.width(), kWidth == 1);
      const Position<Sum> row = position(y, source_.height(), kWidth == 1);
      if constexpr (kWidth > 1) {
        if (column.over != 0 || row.over != 0) {
          mix<kWidth>(column, row, patch.data(), to);
          continue;
        }
      }
      copy(column.first, row.first, to);
    }
  }

  Position<Sum> position(float place, int size, bool is_nearest) const {
    double x = place;
    if (!(x >= -16 && x <= size + 16.0)) x = near_image(x, size, border_);
    const double nearest = std::floor(x + 0.5);
    if (is_nearest || std::abs(x - nearest) <= rounding_) return {static_cast<int>(nearest), 0};
    const double first = std::floor(x);
    return {static_cast<int>(first), static_cast<Sum>(x - first)};
  }

  const Value* pixel(int x, int y) const {
    return from_ +
           (static_cast<std::size_t>(y) * static_cast<std::size_t>(source_.width()) + static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(channels_);
  }

  const Value* pixel_or_fill(int x, int y) const {
    x = inside(x, source_.width(), border_);
    y = inside(y, source_.height(), border_);
    return x < 0 || y < 0 ? fill_.data() : pixel(x, y);
  }

  void copy(int x, int y, Value* to) const {
    const Value* const from = pixel_or_fill(x, y);
    for (int c = 0; c < channels_; ++c) to[c] = from[c];
  }

  /// From the pixels around, or where some are outside, from a patch of copies.
  template <int kWidth>
  void mix(const Position<Sum>& column, const Position<Sum>& row, Value* patch, Value* to) const {
    constexpr int kBefore = kWidth / 2 - 1;
    const int x = column.first - kBefore, y = row.first - kBefore;
    const Value* from = patch;
    std::ptrdiff_t stride = std::ptrdiff_t{kWidth} * channels_;
    if (x >= 0 && y >= 0 && x + kWidth <= source_.width() && y + kWidth <= source_.height()) {
      from = pixel(x, y);
      stride = std::ptrdiff_t{source_.width()} * channels_;
    } else {
      for (int j = 0; j < kWidth; ++j)
        for (int i = 0; i < kWidth; ++i)
          std::copy_n(pixel_or_fill(x + i, y + j), channels_, patch + j * stride + i * channels_);
    }
    std::array<Sum, kWidth> across{}, down{};
    // Along an axis on which the place is whole one pixel has all the weight, and others may be NaN.
    const auto along = [&](const Position<Sum>& position, std::array<Sum, kWidth>& weights, std::ptrdiff_t step) {
      if (position.over != 0) return set_weights<kWidth, Sum>(position.over, weights), kWidth;
      weights[0] = 1;
      from += kBefore * step;
      return 1;
    };
    const int columns = along(column, across, channels_), rows = along(row, down, stride);
    if (source_.format().alpha == Alpha::kStraight)
      return mean_of_opaque<kWidth>(from, stride, across, columns, down, rows, to);
    if (columns == kWidth && rows == kWidth)
      mean<kWidth, kWidth>(from, stride, across.data(), down.data(), to);
    else if (columns == kWidth)
      mean<kWidth, 1>(from, stride, across.data(), down.data(), to);
    else
      mean<1, kWidth>(from, stride, across.data(), down.data(), to);
  }

  /// Rows first, so that a run of numbers is added at once.
  template <int kColumns, int kRows>
  void mean(const Value* from, std::ptrdiff_t stride, const Sum* across, const Sum* down, Value* to) const {
    if constexpr (kChannels > 0) {
      constexpr int kRun = kColumns * kChannels;
      std::array<Sum, kRun> sums{};
      for (int i = 0; i < kRun; ++i) sums[i] = down[0] * static_cast<Sum>(from[i]);
      for (int j = 1; j < kRows; ++j) {
        const Value* const line = from + j * stride;
        for (int i = 0; i < kRun; ++i) sums[i] += down[j] * static_cast<Sum>(line[i]);
      }
      for (int c = 0; c < kChannels; ++c) {
        Sum sum = 0;
        for (int i = 0; i < kColumns; ++i) sum += across[i] * sums[i * kChannels + c];
        to[c] = rounded<Value>(sum, full_);
      }
    } else {
      for (int c = 0; c < channels_; ++c) {
        Sum sum = 0;
        for (int j = 0; j < kRows; ++j)
          for (int i = 0; i < kColumns; ++i)
            sum += down[j] * across[i] * static_cast<Sum>(from[j * stride + i * channels_ + c]);
        to[c] = rounded<Value>(sum, full_);
      }
    }
  }

  template <int kWidth>
  void mean_of_opaque(const Value* from, std::ptrdiff_t stride, const std::array<Sum, kWidth>& across, int columns,
                      const std::array<Sum, kWidth>& down, int rows, Value* to) const {
    const int alpha = channels_ - 1;
    const auto add_opacity = [&](int c) {
      Sum sum = 0;
      for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i) {
          const Value* const at = from + j * stride + i * channels_;
          const Sum weight =
              down[static_cast<std::size_t>(j)] * across[static_cast<std::size_t>(i)] * static_cast<Sum>(at[alpha]);
          // What is clear has no colour to be mixed in, be it NaN.
          if (weight != 0) sum += c == alpha ? weight : weight * static_cast<Sum>(at[c]);
        }
      return sum;
    };
    const Sum opacity = add_opacity(alpha), full = static_cast<Sum>(full_);
    // Less than this is round-off of a filter that overshoots, and its colour is of no meaning.
    const bool is_clear = !(opacity > Sum(1e-5) * full);
    for (int c = 0; c < alpha; ++c) to[c] = is_clear ? Value{0} : rounded<Value>(add_opacity(c) / opacity, full_);
    to[alpha] = rounded<Value>(std::clamp(opacity, Sum(0), full), full_);
  }

  const Image& source_;
  const PixelMap& map_;
  Border border_;
  const Value* from_;
  Value* to_;
  int channels_;
  double rounding_;
  double full_;
  std::vector<Value> fill_;
};

template <class Value>
void sample(const Image& source, const PixelMap& map, const RemapOptions& options, Image& result) {
  switch (source.channels()) {
    case 1:
      return Sampler<Value, 1>(source, map, options, result).run(options.interpolation);
    case 3:
      return Sampler<Value, 3>(source, map, options, result).run(options.interpolation);
    case 4:
      return Sampler<Value, 4>(source, map, options, result).run(options.interpolation);
    default:
      return Sampler<Value, 0>(source, map, options, result).run(options.interpolation);
  }
}

}  // namespace

Image remap(const Image& source, const PixelMap& map, const RemapOptions& options) {
  if (source.empty()) throw InputError("there is no image to be warped");
  if (map.width <= 0 || map.height <= 0 ||
      map.places.size() != static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height))
    throw InputError("warped image of " + std::to_string(map.width) + " x " + std::to_string(map.height) +
                     " pixels: there are places for " + std::to_string(map.places.size()));
  if (options.border == Border::kTransparent && !source.has_alpha()) return remap(with_alpha(source), map, options);
  Image result(map.width, map.height, source.format());
  with_number_type(source.type(), [&]<class Value>() { sample<Value>(source, map, options, result); });
  return result;
}

}  // namespace pulson::images
