#include "images/push_forward.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <span>
#include <utility>

#include "channels.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "rounding.hpp"

namespace pulson::images {
namespace {

using Place = std::array<float, 2>;

constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();
// Labels of one pixel's samples closer than this, in pixels of the source, are shown by their mean.
constexpr float kOnePixel = 1.01F;
// The width of the image in which samples are looked up.
constexpr int kListWidth = 4096;

// The places of several samples of a pixel, whose colours are to be averaged, and what part of it they cover.
struct MixedPixel {
  std::size_t pixel = 0;  // in the band
  std::size_t first = 0;  // in the list of places
  std::size_t count = 0;
  double covered = 0;
};

// What a band's pixels show.
struct Places {
  PixelMap single;
  std::vector<MixedPixel> mixed;
  std::vector<Place> list;
  std::vector<double> shares;  // of the pixel, for each of the list
};

// The samples of one pixel of a band.
class PixelSamples {
 public:
  explicit PixelSamples(const warp::RasterBand& band) : band_(band) {}

  template <class Visit>
  void visit(int x, int y, const Visit& visit) const {
    const int s = band_.supersampling;
    for (int j = 0; j < s; ++j)
      for (int i = 0; i < s; ++i)
        visit((static_cast<std::size_t>(y) * s + j) * static_cast<std::size_t>(band_.width) * s +
              static_cast<std::size_t>(x) * s + i);
  }

 private:
  const warp::RasterBand& band_;
};

// The mean of a pixel's labels where all samples see nearly the same place on one sheet; else NaN.
Place single_place(const warp::RasterBand& band, int x, int y) {
  Place low{std::numeric_limits<float>::max(), std::numeric_limits<float>::max()};
  Place high{-low[0], -low[1]};
  Place sum{};
  bool whole = true;
  int reversed = 0, samples = 0;
  PixelSamples(band).visit(x, y, [&](std::size_t sample) {
    whole = whole && band.counts[sample] > 0;
    reversed += band.reversed[sample];
    ++samples;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      low[axis] = std::min(low[axis], band.labels[sample][axis]);
      high[axis] = std::max(high[axis], band.labels[sample][axis]);
      sum[axis] += band.labels[sample][axis];
    }
  });
  const bool near = high[0] - low[0] <= kOnePixel && high[1] - low[1] <= kOnePixel;
  if (!whole || !near || (reversed != 0 && reversed != samples)) return {kNowhere, kNowhere};
  return {sum[0] / static_cast<float>(samples), sum[1] / static_cast<float>(samples)};
}

/// One page of the picture as it is pushed: its pixels, and the result's.
class PushedPage {
 public:
  PushedPage(const Image& source, const warp::RasterOptions& raster, const PushOptions& options)
      : opaque_(options.fill || source.has_alpha() ? Image() : with_alpha(source)),
        source_(opaque_.empty() ? source : opaque_),
        look_up_{options.interpolation, Border::kReplicate, options.fill.value_or(std::vector<double>())},
        result_(raster.width, raster.height, source_.format()) {
    look_up_.fill.resize(static_cast<std::size_t>(source_.channels()));
  }
  // It refers to itself.
  PushedPage(const PushedPage&) = delete;
  PushedPage& operator=(const PushedPage&) = delete;

  /// The rows from pixel `first` on.
  void show(const Places& places, std::size_t first) {
    Image pixels = remap(source_, places.single, look_up_);
    if (!places.mixed.empty()) mix(places, pixels);
    std::copy(pixels.bytes().begin(), pixels.bytes().end(),
              result_.bytes().begin() + static_cast<std::ptrdiff_t>(first * source_.pixel_size()));
  }

  Image result() && { return std::move(result_); }

 private:
  void mix(const Places& places, Image& pixels) const {
    const auto rows = static_cast<int>((places.list.size() + kListWidth - 1) / kListWidth);
    PixelMap map{kListWidth, rows, places.list};
    map.places.resize(static_cast<std::size_t>(kListWidth) * static_cast<std::size_t>(rows), Place{kNowhere, kNowhere});
    const Image looked_up = remap(source_, map, look_up_);
    with_number_type(source_.type(), [&]<class Value>() {
      if (look_up_.interpolation == Interpolation::kLabel)
        elect<Value>(places, looked_up, pixels);
      else
        average<Value>(places, looked_up, pixels);
    });
  }

  // The value of the largest part of the pixel; the first of equal ones.
  template <class Value>
  void elect(const Places& places, const Image& looked_up, Image& pixels) const {
    const auto channels = static_cast<std::size_t>(source_.channels());
    const auto from = looked_up.values<Value>();
    const auto to = pixels.values<Value>();
    std::vector<Value> fill;
    for (const double value : look_up_.fill) fill.push_back(rounded<Value>(value, source_.full()));
    std::vector<std::pair<std::span<const Value>, double>> parts;
    const auto add = [&](double part, std::span<const Value> value) {
      const auto same = std::find_if(parts.begin(), parts.end(), [&](const auto& known) {
        return std::equal(value.begin(), value.end(), known.first.begin());
      });
      if (same == parts.end())
        parts.emplace_back(value, part);
      else
        same->second += part;
    };
    for (const MixedPixel& mixed : places.mixed) {
      parts.clear();
      for (std::size_t i = mixed.first; i < mixed.first + mixed.count; ++i)
        add(places.shares[i], from.subspan(i * channels, channels));
      add(1 - mixed.covered, fill);
      const auto most = std::max_element(parts.begin(), parts.end(),
                                         [](const auto& a, const auto& b) { return a.second < b.second; });
      std::copy_n(most->first.begin(), channels, to.begin() + static_cast<std::ptrdiff_t>(mixed.pixel * channels));
    }
  }

  // With straight alpha the mean of colours is one in proportion to opacity.
  template <class Value>
  void average(const Places& places, const Image& looked_up, Image& pixels) const {
    const auto channels = static_cast<std::size_t>(source_.channels());
    const std::size_t colours = source_.format().alpha == Alpha::kStraight ? channels - 1 : channels;
    const auto from = looked_up.values<Value>();
    const auto to = pixels.values<Value>();
    std::vector<double> sum(colours);
    for (const MixedPixel& mixed : places.mixed) {
      std::fill(sum.begin(), sum.end(), 0.0);
      double opacity = 0;
      const auto add = [&](double weight, const auto& value) {
        const double alpha = weight * (colours < channels ? static_cast<double>(value[colours]) : 1);
        if (alpha == 0) return;
        opacity += alpha;
        for (std::size_t c = 0; c < colours; ++c) sum[c] += alpha * static_cast<double>(value[c]);
      };
      for (std::size_t i = mixed.first; i < mixed.first + mixed.count; ++i)
        add(places.shares[i], from.subspan(i * channels, channels));
      add(1 - mixed.covered, look_up_.fill);
      for (std::size_t c = 0; c < colours; ++c)
        to[mixed.pixel * channels + c] = rounded<Value>(opacity > 0 ? sum[c] / opacity : 0.0, source_.full());
      if (colours < channels) to[mixed.pixel * channels + colours] = rounded<Value>(opacity, source_.full());
    }
  }

  Image opaque_;          // the source with an alpha channel, where it has none and what is not covered is transparent
  const Image& source_;   // that or the source
  RemapOptions look_up_;  // where nothing is, the fill
  Image result_;
};

class Pusher {
 public:
  Pusher(std::span<const Image* const> sources, warp::DeformedMesh mesh, const warp::RasterOptions& raster,
         const PushOptions& options, std::vector<float> priority)
      : over_(raster.over),
        raster_(std::move(mesh), raster, std::move(priority)),
        counting_(raster_.for_counts()),
        multiplicity_(result_pixels(raster)),
        uncovered_(result_pixels(raster)) {
    for (const Image* source : sources) pages_.push_back(std::make_unique<PushedPage>(*source, raster, options));
  }

  PushedImage run() {
    parallel_for(raster_.bands(), [&](int i) { push_band(i); });
    PushedImage result{
        std::move(*pages_.front()).result(), {}, std::move(multiplicity_), std::move(uncovered_), coverage_};
    for (std::size_t i = 1; i < pages_.size(); ++i) result.more.push_back(std::move(*pages_[i]).result());
    return result;
  }

 private:
  static std::size_t result_pixels(const warp::RasterOptions& raster) {
    return static_cast<std::size_t>(std::max(raster.width, 0)) * static_cast<std::size_t>(std::max(raster.height, 0));
  }

  void push_band(int index) {
    const warp::RasterBand band = raster_.band(index);
    const std::size_t first = static_cast<std::size_t>(band.first_row) * static_cast<std::size_t>(band.width);
    const Places places = find_places(band, index);
    for (const auto& page : pages_) page->show(places, first);
    if (raster_.options().supersampling == counting_.options().supersampling)
      note_coverage(band, band, first);
    else
      note_coverage(band, counting_.band(index), first);
  }

  // Samples give the part of the area that is covered. The most sheets over a pixel would grow with their number, so
  // these are counted at the same points for any supersampling.
  void note_coverage(const warp::RasterBand& band, const warp::RasterBand& counted, std::size_t first) {
    warp::Coverage of_band = coverage(band);
    of_band.max_multiplicity = coverage(counted).max_multiplicity;
    const std::vector<bool> holes = uncovered_pixels(band);
    for (int y = 0; y < band.rows; ++y)
      for (int x = 0; x < band.width; ++x)
        multiplicity_[first + static_cast<std::size_t>(y) * band.width + x] =
            static_cast<std::uint8_t>(most_sheets(counted, x, y));
    const std::lock_guard lock(mutex_);
    coverage_ += of_band;
    std::copy(holes.begin(), holes.end(), uncovered_.begin() + static_cast<std::ptrdiff_t>(first));
  }

  Places find_places(const warp::RasterBand& band, int index) const {
    Places places;
    places.single = {band.width, band.rows, {}};
    places.single.places.reserve(static_cast<std::size_t>(band.width) * static_cast<std::size_t>(band.rows));
    std::vector<warp::RasterBand> sheets;
    if (over_ == warp::SheetOrder::kAverage)
      for (int n = 0; n < coverage(band).max_multiplicity; ++n) sheets.push_back(raster_.sheet(index, n));
    for (int y = 0; y < band.rows; ++y)
      for (int x = 0; x < band.width; ++x) {
        const bool one_sheet = sheets.size() < 2 || most_sheets(band, x, y) < 2;
        const Place place = one_sheet ? single_place(band, x, y) : Place{kNowhere, kNowhere};
        places.single.places.push_back(place);
        if (std::isnan(place[0])) add_mixed(band, sheets, x, y, places);
      }
    return places;
  }

  static int most_sheets(const warp::RasterBand& band, int x, int y) {
    int most = 0;
    PixelSamples(band).visit(x, y, [&](std::size_t sample) { most = std::max<int>(most, band.counts[sample]); });
    return most;
  }

  static void add_mixed(const warp::RasterBand& band, const std::vector<warp::RasterBand>& sheets, int x, int y,
                        Places& places) {
    MixedPixel mixed{places.single.places.size() - 1, places.list.size(), 0, 0};
    const int samples = band.supersampling * band.supersampling;
    int covered = 0;
    PixelSamples(band).visit(x, y, [&](std::size_t sample) {
      if (band.counts[sample] == 0) return;
      ++covered;
      const std::size_t shown = sheets.empty() ? 1 : std::min<std::size_t>(sheets.size(), band.counts[sample]);
      for (std::size_t n = 0; n < shown; ++n)
        places.list.push_back(sheets.empty() ? band.labels[sample] : sheets[n].labels[sample]);
      places.shares.resize(places.list.size(), 1.0 / samples / static_cast<double>(shown));
    });
    if (covered == 0) return;
    mixed.count = places.list.size() - mixed.first;
    mixed.covered = static_cast<double>(covered) / samples;
    places.mixed.push_back(mixed);
  }

  std::vector<std::unique_ptr<PushedPage>> pages_;
  warp::SheetOrder over_;
  warp::MeshRaster raster_;
  warp::MeshRaster counting_;
  std::vector<std::uint8_t> multiplicity_;
  std::vector<bool> uncovered_;
  warp::Coverage coverage_;
  std::mutex mutex_;
};

}  // namespace

PushedImage push_forward(std::span<const Image* const> pages, warp::DeformedMesh mesh,
                         const warp::RasterOptions& raster, const PushOptions& options, std::vector<float> priority) {
  for (const Image* page : pages)
    if (mesh.cell_columns() != page->width() || mesh.cell_rows() != page->height())
      throw InputError("the mesh has " + std::to_string(mesh.cell_columns()) + " x " +
                       std::to_string(mesh.cell_rows()) + " cells, and the image " + std::to_string(page->width()) +
                       " x " + std::to_string(page->height()) + " pixels");
  return Pusher(pages, std::move(mesh), raster, options, std::move(priority)).run();
}

PushedImage push_forward(const Image& source, warp::DeformedMesh mesh, const warp::RasterOptions& raster,
                         const PushOptions& options, std::vector<float> priority) {
  const Image* const page = &source;
  return push_forward({&page, 1}, std::move(mesh), raster, options, std::move(priority));
}

}  // namespace pulson::images
