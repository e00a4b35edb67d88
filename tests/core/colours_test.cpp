// The colours of groups and series: seen on their paper, and told apart by eyes of every kind.

#include "core/colours.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

namespace pulson {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;

// Red, green and blue in proportion to light.
Vector3d linear(std::string_view colour) {
  Vector3d rgb;
  for (Eigen::Index c = 0; c < 3; ++c) {
    const double value =
        std::stoi(std::string(colour.substr(1 + 2 * static_cast<std::size_t>(c), 2)), nullptr, 16) / 255.0;
    rgb[c] = value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
  }
  return rgb;
}

double luminance(std::string_view colour) { return Vector3d(0.2126, 0.7152, 0.0722).dot(linear(colour)); }

// Of WCAG 2.
double contrast(std::string_view a, std::string_view b) {
  const double one = luminance(a), other = luminance(b);
  return (std::max(one, other) + 0.05) / (std::min(one, other) + 0.05);
}

// CIE L*a*b* of linear RGB, under D65.
Vector3d lab(const Vector3d& rgb) {
  const Matrix3d to_xyz =
      (Matrix3d() << 0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505).finished();
  const Vector3d xyz = (to_xyz * rgb).cwiseQuotient(Vector3d(0.95047, 1, 1.08883));
  const Vector3d f =
      xyz.unaryExpr([](double t) { return t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116; });
  return {116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])};
}

double hue(double a, double b) {
  const double degrees = std::atan2(b, a) / kDegree;
  return a == 0 && b == 0 ? 0 : degrees < 0 ? degrees + 360 : degrees;
}

// CIEDE2000 (Sharma, Wu and Dalal, 2005).
double difference(const Vector3d& one, const Vector3d& other) {
  const auto seventh = [](double c) { return std::sqrt(std::pow(c, 7) / (std::pow(c, 7) + std::pow(25.0, 7))); };
  const double stretch = 1.5 - 0.5 * seventh((std::hypot(one[1], one[2]) + std::hypot(other[1], other[2])) / 2);
  const double a1 = stretch * one[1], a2 = stretch * other[1];
  const double c1 = std::hypot(a1, one[2]), c2 = std::hypot(a2, other[2]), c = (c1 + c2) / 2;
  const double h1 = hue(a1, one[2]), h2 = hue(a2, other[2]);
  const bool is_grey = c1 * c2 == 0;
  double dh = is_grey ? 0 : h2 - h1, h = is_grey ? h1 + h2 : (h1 + h2) / 2;
  if (!is_grey && std::abs(h1 - h2) > 180) {
    dh += dh > 0 ? -360 : 360;
    h += h < 180 ? 180 : -180;
  }
  const double l = (one[0] + other[0]) / 2;
  const double t = 1 - 0.17 * std::cos((h - 30) * kDegree) + 0.24 * std::cos(2 * h * kDegree) +
                   0.32 * std::cos((3 * h + 6) * kDegree) - 0.2 * std::cos((4 * h - 63) * kDegree);
  const double turn = 2 * seventh(c) * std::sin(60 * kDegree * std::exp(-std::pow((h - 275) / 25, 2)));
  const double light = (other[0] - one[0]) / (1 + 0.015 * std::pow(l - 50, 2) / std::sqrt(20 + std::pow(l - 50, 2)));
  const double chroma = (c2 - c1) / (1 + 0.045 * c);
  const double tone = 2 * std::sqrt(c1 * c2) * std::sin(dh / 2 * kDegree) / (1 + 0.015 * c * t);
  return std::sqrt(light * light + chroma * chroma + tone * tone - turn * chroma * tone);
}

// How colours are seen (Machado, Oliveira and Fernandes, 2009; severity 1).
struct Eyes {
  std::string name;
  Matrix3d seen;
};

std::vector<Eyes> all_eyes() {
  std::vector<Eyes> eyes(3);
  eyes[0] = {"all colours", Matrix3d::Identity()};
  eyes[1].name = "deuteranopia";
  eyes[1].seen << 0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881;
  eyes[2].name = "protanopia";
  eyes[2].seen << 0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998;
  return eyes;
}

double seen_difference(const Eyes& eyes, std::string_view a, std::string_view b) {
  const auto seen = [&](std::string_view colour) -> Vector3d {
    return lab((eyes.seen * linear(colour)).cwiseMax(0).cwiseMin(1));
  };
  return difference(seen(a), seen(b));
}

TEST(Colours, DifferencesAreThoseOfCiede2000) {
  // Pairs 1, 7, 14 and 25 of the published test data.
  EXPECT_NEAR(difference({50, 2.6772, -79.7751}, {50, 0, -82.7485}), 2.0425, 1e-4);
  EXPECT_NEAR(difference({50, 0, 0}, {50, -1, 2}), 2.3669, 1e-4);
  EXPECT_NEAR(difference({50, -0.001, 2.49}, {50, 0.0011, -2.49}), 4.7461, 1e-4);
  EXPECT_NEAR(difference({60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}), 1.2644, 1e-4);
  EXPECT_NEAR(contrast("#000000", "#FFFFFF"), 21, 1e-9);
  EXPECT_NEAR(contrast("#777777", "#FFFFFF"), 4.48, 0.01);
}

TEST(Colours, StandOutFromTheirPaper) {
  for (const Palette& palette : {kLightPalette, kDarkPalette}) {
    for (const std::string_view colour : palette.groups) EXPECT_GE(contrast(colour, palette.paper), 3) << colour;
    EXPECT_GE(contrast(palette.target, palette.paper), 3);
    EXPECT_GE(contrast(palette.ink, palette.paper), 7);
  }
}

TEST(Colours, AreToldApartByEveryKindOfEyes) {
  constexpr double kLeast = 15;
  for (const Palette& palette : {kLightPalette, kDarkPalette}) {
    std::vector<std::string_view> colours(palette.groups.begin(), palette.groups.end());
    colours.insert(colours.end(), {palette.target, palette.ink});
    for (const Eyes& eyes : all_eyes())
      for (std::size_t i = 0; i < colours.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
          EXPECT_GE(seen_difference(eyes, colours[i], colours[j]), kLeast)
              << eyes.name << ": " << colours[i] << " and " << colours[j];
  }
  EXPECT_LT(seen_difference(all_eyes()[1], "#1D7A56", "#A82B55"), kLeast) << "the test finds what is too near";
}

}  // namespace
}  // namespace pulson
