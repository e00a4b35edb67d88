// Pictures are data: the identity gives a file back bit for bit, for every type of number, format, interpolation and
// way of warping, and a shift by whole pixels the same numbers elsewhere.

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "image_examples.hpp"
#include "plain_options.hpp"
#include "pulson/images/pages.hpp"
#include "pulson/images/warp_image.hpp"
#include "pulson/matching/registration.hpp"
#include "temporary_folder.hpp"

namespace pulson::images {
namespace {

using enum PixelType;

// Numbers over all of the range of the type, with its ends, and of floating-point ones with NaN and infinity.
Image hard_image(int width, int height, const PixelFormat& format) {
  Image image(width, height, format);
  with_number_type(format.type, [&]<class Value>() {
    using Limits = std::numeric_limits<Value>;
    std::uint64_t state = 11;
    const auto values = image.values<Value>();
    for (Value& value : values) {
      state = 6364136223846793005U * state + 1442695040888963407U;
      if constexpr (std::is_floating_point_v<Value>) {
        value = static_cast<Value>(std::ldexp(static_cast<double>(state >> 11) - std::ldexp(1.0, 52), -50));
      } else {
        value = static_cast<Value>(state >> 7);
        if (format.full < full_value(format.type))
          value = static_cast<Value>(static_cast<std::uint64_t>(value) % (static_cast<std::uint64_t>(format.full) + 1));
      }
    }
    if (format.full < full_value(format.type)) return;
    values[0] = Limits::lowest();
    values[1] = Limits::max();
    if constexpr (std::is_floating_point_v<Value>) {
      values[5] = Limits::quiet_NaN();
      values[10] = Limits::infinity();
      values[values.size() - 1] = Limits::denorm_min();
      values[values.size() - 2] = Value{-0.0};
    }
  });
  return image;
}

// Equal bytes, so that NaN equals NaN.
bool has_same_bits(const Image& a, const Image& b) {
  return a.width() == b.width() && a.height() == b.height() && a.format() == b.format() &&
         std::memcmp(a.bytes().data(), b.bytes().data(), a.bytes().size()) == 0;
}

std::string name_of_kind(const Page& page) {
  const PixelFormat& format = page.image.format();
  return describe(format.type) + ", " + std::to_string(format.channels) + " channels, alpha " +
         std::to_string(static_cast<int>(format.alpha)) + ", highest " + std::to_string(format.full) +
         (page.about.has_palette() ? ", palette" : "");
}

std::vector<std::array<std::uint16_t, 4>> palette(std::size_t colours, bool is_opaque) {
  std::vector<std::array<std::uint16_t, 4>> result;
  for (std::size_t i = 0; i < colours; ++i) {
    const auto part = [&](std::size_t factor) { return static_cast<std::uint16_t>(257 * (i * factor % 256)); };
    result.push_back({part(7), part(31), part(101), is_opaque ? std::uint16_t{0xFFFF} : part(13)});
  }
  return result;
}

struct Kind {
  std::string file;
  Page page;
};

void add_tifs(std::vector<Kind>& kinds, int width, int height) {
  const auto add = [&](PixelFormat format, const PageMetadata& about = {}) {
    kinds.push_back({"a.tif", {hard_image(width, height, format), about}});
  };
  for (const PixelType type : kNumberTypes) {
    const double full = full_value(type);
    for (const int channels : {1, 3}) add({channels, type, Alpha::kNone, full});
    for (const int channels : {2, 4})
      for (const Alpha alpha : {Alpha::kStraight, Alpha::kAssociated}) add({channels, type, alpha, full});
    add({2, type, Alpha::kNone, full}, {.extra_samples = {0}});
    add({3, type, Alpha::kNone, full}, {.extra_samples = {0, 0}});
    add({5, type, Alpha::kNone, full}, {.extra_samples = {0, 0}});
    add({5, type, Alpha::kNone, full}, {.extra_samples = {0, 0, 0, 0}});
    add({5, type, Alpha::kStraight, full}, {.extra_samples = {0, 2}});
    add({4, type, Alpha::kNone, full}, {.is_cmyk = true});
    add({1, type, Alpha::kNone, full}, {.white_is_zero = true});
  }
  for (const int bits : {1, 2, 4, 7, 8}) {
    add({1, kUint8, Alpha::kNone, std::exp2(bits) - 1});
    add({1, kUint8, Alpha::kNone, std::exp2(bits) - 1}, {.palette = palette(std::size_t{1} << bits, true)});
  }
  for (const int bits : {9, 10, 12, 14, 16})
    for (const int channels : {1, 3}) add({channels, kUint16, Alpha::kNone, std::exp2(bits) - 1});
  add({1, kUint16, Alpha::kNone, 65535}, {.palette = palette(65536, true)});
}

std::vector<Kind> kinds_of(int width, int height) {
  std::vector<Kind> kinds;
  const auto add = [&](const char* file, PixelFormat format, const PageMetadata& about = {}) {
    kinds.push_back({file, {hard_image(width, height, format), about}});
  };
  add_tifs(kinds, width, height);
  for (const PixelType type : {kUint8, kUint16}) {
    for (const int channels : {1, 2, 3, 4}) add("a.png", PixelFormat::usual(channels, type));
  }
  for (const int bits : {1, 2, 4, 8}) {
    const PixelFormat format{1, kUint8, Alpha::kNone, std::exp2(bits) - 1};
    add("a.png", format);
    for (const bool is_opaque : {true, false})
      add("a.png", format, {.palette = palette(std::size_t{1} << bits, is_opaque)});
  }
  add("a.png", {1, kUint8, Alpha::kNone, 255}, {.palette = palette(200, true)});
  return kinds;
}

class PictureIdentity : public InTemporaryFolder {
 protected:
  static warp::MaterialFlow flow_at_rest() {
    Landmarks shape;
    shape.points = (Points(2, 4) << 2, 9, 8, 1, 1, 2, 7, 6).finished();
    const matching::Registration found = register_shapes(shape, shape, plain_options());
    return {registration_system(found), replay(found)};
  }

  static Alignment shift(double x, double y) {
    return {AlignmentKind::kNone, 1, Eigen::Matrix2d::Identity(), Eigen::Vector2d(x, y)};
  }

  static constexpr int kWidth = 13, kHeight = 9;
  const warp::MaterialFlow flow_ = flow_at_rest();
};

TEST_F(PictureIdentity, FilesBringBackEveryBit) {
  for (const Kind& kind : kinds_of(kWidth, kHeight)) {
    SCOPED_TRACE(kind.file + ": " + name_of_kind(kind.page));
    write_pages(kind.file, {&kind.page, 1});
    const PictureFile read = read_pages(kind.file);
    ASSERT_EQ(read.pages.size(), 1U);
    EXPECT_TRUE(has_same_bits(read.pages[0].image, kind.page.image));
    if (!kind.page.about.extra_samples.empty()) {
      EXPECT_EQ(read.pages[0].about.extra_samples, kind.page.about.extra_samples);
    }
    EXPECT_EQ(read.pages[0].about.is_cmyk, kind.page.about.is_cmyk);
    EXPECT_EQ(read.pages[0].about.white_is_zero, kind.page.about.white_is_zero);
    const auto& colours = read.pages[0].about.palette;
    ASSERT_GE(colours.size(), kind.page.about.palette.size());
    EXPECT_TRUE(std::equal(kind.page.about.palette.begin(), kind.page.about.palette.end(), colours.begin()));
  }
}

TEST_F(PictureIdentity, IdentityIsExactForEveryKindInterpolationAndMethod) {
  const ImageWarp identity(flow_, shift(0, 0), {}, {});
  for (const Kind& kind : kinds_of(kWidth, kHeight))
    for (const auto& interpolation : interpolation_table().rows())
      for (const WarpMethod method : {WarpMethod::kPull, WarpMethod::kPush})
        for (const Border border : {Border::kConstant, Border::kReplicate, Border::kReflect}) {
          if (method == WarpMethod::kPush && border != Border::kConstant) continue;
          const WarpedImage result = warp_image(kind.page.image, identity,
                                                {.width = kWidth,
                                                 .height = kHeight,
                                                 .method = method,
                                                 .interpolation = interpolation.make,
                                                 .border = border});
          ASSERT_TRUE(has_same_bits(result.image, kind.page.image))
              << name_of_kind(kind.page) << ", " << interpolation.name << (result.pulled ? ", pulled" : ", pushed");
        }
}

// Frames of any unit and origin round, and so do alignments.
TEST_F(PictureIdentity, IdentityIsExactInEveryFrame) {
  const Image image = hard_image(301, 97, {1, kInt64, Alpha::kNone, full_value(kInt64)});
  for (const double unit : {0.0066666667, 0.1, 3.7, 1234.5}) {
    const Frame frame{{-1.7 * unit, 0.3}, {unit, unit}};
    const ImageWarp identity(flow_, shift(0, 0), frame, frame);
    for (const auto& interpolation : interpolation_table().rows())
      for (const WarpMethod method : {WarpMethod::kPull, WarpMethod::kPush}) {
        const WarpedImage result = warp_image(image, identity,
                                              {.width = 301,
                                               .height = 97,
                                               .method = method,
                                               .interpolation = interpolation.make,
                                               .border = Border::kConstant});
        ASSERT_TRUE(has_same_bits(result.image, image)) << unit << ' ' << interpolation.name;
      }
  }
}

TEST_F(PictureIdentity, ShiftsByWholePixelsAreExact) {
  constexpr int kRight = 3, kUp = 2;
  const ImageWarp shifted(flow_, shift(kRight, -kUp), {}, {});
  for (const Kind& kind : kinds_of(kWidth, kHeight))
    for (const auto& interpolation : interpolation_table().rows())
      for (const WarpMethod method : {WarpMethod::kPull, WarpMethod::kPush}) {
        const Image& image = kind.page.image;
        const std::vector<double> fill(static_cast<std::size_t>(image.channels()), 1);
        const Image result = warp_image(image, shifted,
                                        {.width = kWidth,
                                         .height = kHeight,
                                         .method = method,
                                         .interpolation = interpolation.make,
                                         .border = Border::kConstant,
                                         .fill = fill})
                                 .image;
        ASSERT_EQ(result.format(), image.format());
        const std::size_t size = image.pixel_size();
        Image filled(1, 1, image.format());
        with_number_type(image.type(), [&]<class Value>() {
          std::fill(filled.values<Value>().begin(), filled.values<Value>().end(), Value{1});
        });
        for (int y = 0; y < kHeight; ++y)
          for (int x = 0; x < kWidth; ++x) {
            const bool is_there = x >= kRight && y + kUp < kHeight;
            const std::byte* const from =
                is_there ? image.bytes().data() + static_cast<std::size_t>((y + kUp) * kWidth + x - kRight) * size
                         : filled.bytes().data();
            ASSERT_EQ(std::memcmp(result.bytes().data() + static_cast<std::size_t>(y * kWidth + x) * size, from, size),
                      0)
                << name_of_kind(kind.page) << ", " << interpolation.name << " at " << x << ", " << y;
          }
      }
}

// ---- NaN, and numbers of many digits

TEST_F(PictureIdentity, NanStaysWhereItIsAndHasAWeight) {
  Image image(9, 9, {1, kFloat64, Alpha::kNone, 1});
  image.values<double>()[4 * 9 + 4] = std::nan("");
  const auto count = [&](double x, double y, Interpolation interpolation) {
    const ImageWarp warp(flow_, shift(x, y), {}, {});
    const Image result =
        warp_image(image, warp, {.width = 9, .height = 9, .interpolation = interpolation, .border = Border::kReplicate})
            .image;
    int nan = 0;
    for (const double value : result.values<double>()) nan += std::isnan(value) ? 1 : 0;
    return nan;
  };
  for (const auto& interpolation : interpolation_table().rows()) EXPECT_EQ(count(1, 2, interpolation.make), 1);
  EXPECT_EQ(count(0.5, 0.5, Interpolation::kNearest), 1);
  EXPECT_EQ(count(0.5, 0.5, Interpolation::kLinear), 4);
  EXPECT_EQ(count(0.5, 0, Interpolation::kLinear), 2) << "one row has all the weight";
  EXPECT_EQ(count(0.5, 1, Interpolation::kCubic), 4);
}

TEST_F(PictureIdentity, MeansHaveTheDigitsOfTheType) {
  const std::vector<std::uint32_t> labels{614454276, 614454278, 4294967290, 4294967294};
  const Image image(4, 1, 1, std::span<const std::uint32_t>(labels));
  const Image halfway = remap(image, {2, 1, {{0.5F, 0}, {2.5F, 0}}});
  EXPECT_EQ(halfway.values<std::uint32_t>()[0], 614454277U);
  EXPECT_EQ(halfway.values<std::uint32_t>()[1], 4294967292U);
  const std::vector<double> numbers{1, 1 + 1e-12};
  const Image doubles(2, 1, 1, std::span<const double>(numbers));
  EXPECT_EQ(remap(doubles, {1, 1, {{0.5F, 0}}}).values<double>()[0], 1 + 0.5e-12);
}

// An overshoot stops at the ends of the type, or at the highest value of the picture.
TEST_F(PictureIdentity, OvershootsStopAtTheHighestValue) {
  for (const PixelFormat& format : {PixelFormat{1, kUint16, Alpha::kNone, 1023},
                                    {1, kUint8, Alpha::kNone, 1},
                                    {1, kInt8, Alpha::kNone, 127},
                                    {1, kUint64, Alpha::kNone, full_value(kUint64)},
                                    {1, kInt64, Alpha::kNone, full_value(kInt64)}}) {
    Image image(8, 1, format);
    with_number_type(format.type, [&]<class Value>() {
      if constexpr (!std::is_integral_v<Value>) return;
      const auto values = image.values<Value>();
      std::fill(values.begin(), values.begin() + 4, std::numeric_limits<Value>::lowest());
      const bool is_whole = format.full < full_value(format.type);
      std::fill(values.begin() + 4, values.end(),
                is_whole ? static_cast<Value>(format.full) : std::numeric_limits<Value>::max());
      const Image result =
          remap(image, {2, 1, {{2.5F, 0}, {4.5F, 0}}}, {Interpolation::kLanczos, Border::kReplicate, {}});
      EXPECT_EQ(result.values<Value>()[0], values[0]) << describe(format.type);
      EXPECT_EQ(result.values<Value>()[1], values[7]) << describe(format.type);
    });
  }
}

// ---- pages

TEST_F(PictureIdentity, AllPagesAreWarpedByOneMap) {
  std::vector<Image> pages;
  for (int i = 0; i < 5; ++i) pages.push_back(uneven_image(kWidth, kHeight, i == 2 ? 3 : 1, i == 3 ? kInt32 : kUint8));
  pages[1].values<std::uint8_t>()[0] = 77;
  std::vector<const Image*> pointers;
  for (const Image& page : pages) pointers.push_back(&page);
  for (const WarpMethod method : {WarpMethod::kPull, WarpMethod::kPush}) {
    const WarpImageOptions options{.width = kWidth, .height = kHeight, .method = method, .border = Border::kConstant};
    const ImageWarp warp(flow_, shift(0.3, 1), {}, {});
    const WarpedImage all = warp_image(pointers, warp, options);
    ASSERT_EQ(all.more.size(), 4U);
    EXPECT_EQ(all.image, warp_image(pages[0], warp, options).image);
    for (std::size_t i = 1; i < 5; ++i) EXPECT_EQ(all.more[i - 1], warp_image(pages[i], warp, options).image) << i;
  }
  pages[4] = uneven_image(kWidth + 1, kHeight, 1, kUint8);
  EXPECT_THROW(warp_image(pointers, ImageWarp(flow_, shift(0, 0), {}, {}), {.width = 3, .height = 3}), InputError);
}

}  // namespace
}  // namespace pulson::images
