#include "pulson/images/pages.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "channels.hpp"
#include "rounding.hpp"

namespace pulson::images {
namespace {

/// The numbers of a palette as the colours that they name, of 16 bits or, where these are enough, 8.
template <class Value>
void set_colours(const Page& page, unsigned divisor, Image& result) {
  const auto channels = static_cast<std::size_t>(result.channels());
  const auto to = result.values<Value>();
  with_number_type(page.image.type(), [&]<class Number>() {
    const auto numbers = page.image.values<Number>();
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const auto number = static_cast<double>(numbers[i]);
      if (!(number >= 0 && number < static_cast<double>(page.about.palette.size()))) continue;  // no colour: black
      for (std::size_t c = 0; c < channels; ++c)
        to[i * channels + c] = static_cast<Value>(page.about.palette[static_cast<std::size_t>(number)][c] / divisor);
    }
  });
}

Image coloured(const Page& page) {
  constexpr unsigned kTo16Bits = 257;
  const auto& palette = page.about.palette;
  const bool is_opaque = std::all_of(palette.begin(), palette.end(), [](auto& colour) { return colour[3] == 0xFFFF; });
  const bool has_8_bits = std::all_of(palette.begin(), palette.end(), [](auto& colour) {
    return std::all_of(colour.begin(), colour.end(), [](unsigned part) { return part % kTo16Bits == 0; });
  });
  Image result(page.image.width(), page.image.height(), is_opaque ? 3 : 4,
               has_8_bits ? PixelType::kUint8 : PixelType::kUint16);
  if (has_8_bits)
    set_colours<std::uint8_t>(page, kTo16Bits, result);
  else
    set_colours<std::uint16_t>(page, 1, result);
  return result;
}

/// White as the highest value.
void invert_grey(Image& image) {
  const auto channels = static_cast<std::size_t>(image.channels());
  with_number_type(image.type(), [&]<class Value>() {
    const auto values = image.values<Value>();
    const auto full = rounded<Value>(image.full(), image.full());
    for (std::size_t i = 0; i < values.size(); i += channels) values[i] = static_cast<Value>(full - values[i]);
  });
}

/// The highest value as that of the type.
Image with_full_range(const Image& image) {
  PixelFormat format = image.format();
  format.full = full_value(image.type());
  if (format.full == image.full()) return image;
  Image result(image.width(), image.height(), format);
  with_number_type(image.type(), [&]<class Value>() {
    const auto from = image.values<Value>();
    std::transform(from.begin(), from.end(), result.values<Value>().begin(), [&](Value value) {
      return rounded<Value>(static_cast<double>(value) * format.full / image.full(), format.full);
    });
  });
  return result;
}

Image without_inks(const Image& inks) {
  PixelFormat format = inks.format();
  format.channels = format.has_alpha() ? 4 : 3;
  Image result(inks.width(), inks.height(), format);
  with_number_type(inks.type(), [&]<class Value>() {
    const auto from = inks.values<Value>();
    const auto to = result.values<Value>();
    const auto before = static_cast<std::size_t>(inks.channels()), after = static_cast<std::size_t>(format.channels);
    for (std::size_t i = 0; i < inks.pixel_count(); ++i) {
      const double black = static_cast<double>(from[i * before + 3]) / format.full;
      for (std::size_t c = 0; c < 3; ++c)
        to[i * after + c] =
            rounded<Value>((format.full - static_cast<double>(from[i * before + c])) * (1 - black), format.full);
      if (format.has_alpha()) to[i * after + 3] = from[i * before + before - 1];
    }
  });
  return result;
}

/// The colours of more channels: red, green and blue where that is what the first are.
Image with_colours_alone(const Page& page) {
  const auto more = static_cast<int>(page.about.extra_samples.size());
  const PixelFormat& format = page.image.format();
  if (format.channels - more != 3 || format.colours() == 3) return first_channels(page.image);
  PixelFormat kept = format;
  kept.channels = 3;
  kept.alpha = Alpha::kNone;
  Image result(page.image.width(), page.image.height(), kept);
  const std::size_t from = page.image.pixel_size(), to = result.pixel_size();
  for (std::size_t i = 0; i < result.pixel_count(); ++i)
    std::copy_n(page.image.bytes().begin() + static_cast<std::ptrdiff_t>(i * from), to,
                result.bytes().begin() + static_cast<std::ptrdiff_t>(i * to));
  return result;
}

}  // namespace

Image shown(const Page& page) {
  if (page.about.has_palette()) return coloured(page);
  Image image = with_full_range(page.image);
  if (page.about.is_cmyk) return without_inks(image);
  image = with_straight_alpha(with_colours_alone({std::move(image), {.extra_samples = page.about.extra_samples}}));
  if (page.about.white_is_zero) invert_grey(image);
  return image;
}

Page with_black_as_zero(Page page) {
  invert_grey(page.image);
  page.about.white_is_zero = false;
  return page;
}

Page oriented(const Page& stored) {
  Page page{oriented(stored.image, stored.about.orientation), stored.about};
  page.about.orientation = 1;
  if (stored.about.orientation > 4 && page.about.resolution)
    std::swap(page.about.resolution->x, page.about.resolution->y);
  return page;
}

}  // namespace pulson::images
