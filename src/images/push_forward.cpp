#include "images/push_forward.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "channels.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

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

class Pusher {
 public:
  Pusher(const Image& source, warp::DeformedMesh mesh, const warp::RasterOptions& raster, const PushOptions& options,
         std::vector<float> priority)
      : opaque_(options.fill || source.has_alpha() ? Image() : images::with_alpha(source)),
        source_(opaque_.empty() ? source : opaque_),
        over_(raster.over),
        look_up_{options.interpolation, Border::kReplicate, options.fill.value_or(std::array<double, 4>{})},
        raster_(std::move(mesh), raster, std::move(priority)),
        result_{Image(raster.width, raster.height, source_.channels(), source_.depth()),
                std::vector<std::uint8_t>(result_pixels(raster)),
                std::vector<bool>(result_pixels(raster)),
                {}} {}

  PushedImage run() {
    parallel_for(raster_.bands(), [&](int i) { push_band(i); });
    return std::move(result_);
  }

 private:
  static std::size_t result_pixels(const warp::RasterOptions& raster) {
    return static_cast<std::size_t>(std::max(raster.width, 0)) * static_cast<std::size_t>(std::max(raster.height, 0));
  }

  void push_band(int index) {
    const warp::RasterBand band = raster_.band(index);
    const std::size_t first = static_cast<std::size_t>(band.first_row) * static_cast<std::size_t>(band.width);
    Places places = find_places(band, index);
    Image pixels = remap(source_, places.single, look_up_);
    if (!places.mixed.empty()) mix(places, pixels);
    const std::size_t bytes = byte_count(source_.depth()) * static_cast<std::size_t>(source_.channels());
    std::copy(pixels.bytes().begin(), pixels.bytes().end(),
              result_.image.bytes().begin() + static_cast<std::ptrdiff_t>(first * bytes));
    note_coverage(band, first);
  }

  void note_coverage(const warp::RasterBand& band, std::size_t first) {
    const warp::Coverage of_band = coverage(band);
    const std::vector<bool> holes = uncovered_pixels(band);
    for (int y = 0; y < band.rows; ++y)
      for (int x = 0; x < band.width; ++x) {
        std::uint8_t most = 0;
        PixelSamples(band).visit(x, y, [&](std::size_t sample) { most = std::max(most, band.counts[sample]); });
        result_.multiplicity[first + static_cast<std::size_t>(y) * band.width + x] = most;
      }
    const std::lock_guard lock(mutex_);
    result_.coverage += of_band;
    std::copy(holes.begin(), holes.end(), result_.uncovered.begin() + static_cast<std::ptrdiff_t>(first));
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

  void mix(const Places& places, Image& pixels) const {
    const auto rows = static_cast<int>((places.list.size() + kListWidth - 1) / kListWidth);
    PixelMap map{kListWidth, rows, places.list};
    map.places.resize(static_cast<std::size_t>(kListWidth) * static_cast<std::size_t>(rows), Place{kNowhere, kNowhere});
    const Image looked_up = remap(source_, map, look_up_);
    switch (source_.depth()) {
      case PixelDepth::kUint8:
        return mix<std::uint8_t>(places, looked_up, pixels);
      case PixelDepth::kUint16:
        return mix<std::uint16_t>(places, looked_up, pixels);
      case PixelDepth::kFloat32:
        return mix<float>(places, looked_up, pixels);
    }
  }

  template <class Value>
  void mix(const Places& places, const Image& looked_up, Image& pixels) const {
    if (look_up_.interpolation == Interpolation::kLabel)
      elect<Value>(places, looked_up, pixels);
    else
      average<Value>(places, looked_up, pixels);
  }

  // The value of the largest part of the pixel; the first of equal ones.
  template <class Value>
  void elect(const Places& places, const Image& looked_up, Image& pixels) const {
    using Candidate = std::array<Value, 4>;
    const auto channels = static_cast<std::size_t>(source_.channels());
    const auto from = looked_up.values<Value>();
    const auto to = pixels.values<Value>();
    std::vector<std::pair<Candidate, double>> parts;
    const auto add = [&](double part, const Candidate& candidate) {
      const auto same =
          std::find_if(parts.begin(), parts.end(), [&](const auto& known) { return known.first == candidate; });
      if (same == parts.end())
        parts.emplace_back(candidate, part);
      else
        same->second += part;
    };
    Candidate fill{};
    for (std::size_t c = 0; c < channels; ++c) fill[c] = rounded<Value>(look_up_.fill[c]);
    for (const MixedPixel& mixed : places.mixed) {
      parts.clear();
      for (std::size_t i = mixed.first; i < mixed.first + mixed.count; ++i) {
        Candidate candidate{};
        std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(i * channels), channels, candidate.begin());
        add(places.shares[i], candidate);
      }
      add(1 - mixed.covered, fill);
      const auto most = std::max_element(parts.begin(), parts.end(),
                                         [](const auto& a, const auto& b) { return a.second < b.second; });
      std::copy_n(most->first.begin(), channels, to.begin() + static_cast<std::ptrdiff_t>(mixed.pixel * channels));
    }
  }

  // With alpha the mean of colours is one in proportion to opacity.
  template <class Value>
  void average(const Places& places, const Image& looked_up, Image& pixels) const {
    const auto channels = static_cast<std::size_t>(source_.channels());
    const std::size_t colours = source_.has_alpha() ? channels - 1 : channels;
    const auto from = looked_up.values<Value>();
    const auto to = pixels.values<Value>();
    for (const MixedPixel& mixed : places.mixed) {
      std::array<double, 4> sum{};
      double opacity = 0;
      const auto add = [&](double weight, const auto& value) {
        const double alpha = weight * (colours < channels ? static_cast<double>(value[colours]) : 1);
        opacity += alpha;
        for (std::size_t c = 0; c < colours; ++c) sum[c] += alpha * static_cast<double>(value[c]);
      };
      for (std::size_t i = mixed.first; i < mixed.first + mixed.count; ++i)
        add(places.shares[i], from.subspan(i * channels, channels));
      add(1 - mixed.covered, look_up_.fill);
      for (std::size_t c = 0; c < colours; ++c)
        to[mixed.pixel * channels + c] = rounded<Value>(opacity > 0 ? sum[c] / opacity : 0);
      if (colours < channels) to[mixed.pixel * channels + colours] = rounded<Value>(opacity);
    }
  }

  template <class Value>
  static Value rounded(double value) {
    if constexpr (std::is_floating_point_v<Value>) return static_cast<Value>(value);
    return static_cast<Value>(std::lround(value));
  }

  Image opaque_;         // the source with an alpha channel, where it has none and what is not covered is transparent
  const Image& source_;  // that or the source
  warp::SheetOrder over_;
  RemapOptions look_up_;  // where nothing is, the fill
  warp::MeshRaster raster_;
  PushedImage result_;
  std::mutex mutex_;
};

}  // namespace

PushedImage push_forward(const Image& source, warp::DeformedMesh mesh, const warp::RasterOptions& raster,
                         const PushOptions& options, std::vector<float> priority) {
  if (mesh.cell_columns() != source.width() || mesh.cell_rows() != source.height())
    throw InputError("the mesh has " + std::to_string(mesh.cell_columns()) + " x " + std::to_string(mesh.cell_rows()) +
                     " cells, and the image " + std::to_string(source.width()) + " x " +
                     std::to_string(source.height()) + " pixels");
  return Pusher(source, std::move(mesh), raster, options, std::move(priority)).run();
}

}  // namespace pulson::images
