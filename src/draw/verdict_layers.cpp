#include "verdict_layers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace pulson::draw {
namespace {

constexpr int kShades = 8;  // of triangles, and sizes of discs: steps that nobody tells apart
constexpr double kLargestDisc = 26, kDarkestTriangle = 0.5, kDiscOpacity = 0.28;
constexpr double kDoubtRadius = 6.5;
const SeriesLook kDoubt{colour::kMomentum, 2};  // a triangle

bool is_mapped(const Eigen::VectorXd& shares) { return shares.size() > 0 && shares.sum() > 0; }

// So large that as many discs of this size would cover the shape once, at most.
double largest_disc(const Points& pixels) {
  const Eigen::Vector2d extent = pixels.rowwise().maxCoeff() - pixels.rowwise().minCoeff();
  return std::min(kLargestDisc, std::sqrt(extent.prod() / (std::numbers::pi * static_cast<double>(pixels.cols()))));
}

// 0 to kShades.
int shade_of(double part) { return static_cast<int>(std::lround(part * kShades)); }

// What each landmark has of a cost, and the colour in which that is drawn.
struct CostMap {
  const Eigen::VectorXd& shares;
  Colour colour;
};

CostMap action_map(const RegistrationPicture& picture) { return {picture.action, colour::kMomentum}; }
CostMap energy_map(const RegistrationPicture& picture) { return {picture.energy, colour::kSource}; }

void draw_triangles(Canvas& canvas, const Points& pixels, const std::vector<std::array<int, 3>>& triangles,
                    const CostMap& map) {
  const double most = map.shares.maxCoeff();
  std::array<std::vector<Points>, kShades + 1> shades;
  for (const std::array<int, 3>& corners : triangles)
    shades[static_cast<std::size_t>(shade_of(map.shares(corners).mean() / most))].emplace_back(
        pixels(Eigen::all, corners));
  for (int shade = 1; shade <= kShades; ++shade)
    if (auto& outlines = shades[static_cast<std::size_t>(shade)]; !outlines.empty())
      canvas.areas(std::move(outlines), {map.colour.rgb, kDarkestTriangle * shade / kShades});
}

void draw_map(Canvas& canvas, const Points& pixels, const std::vector<std::array<int, 3>>& triangles,
              const CostMap& map) {
  if (!is_mapped(map.shares)) return;
  draw_triangles(canvas, pixels, triangles, map);
  const double most = map.shares.maxCoeff(), largest = largest_disc(pixels);
  for (int size = 1; size <= kShades; ++size) {
    std::vector<int> same;
    for (int a = 0; a < map.shares.size(); ++a)
      if (shade_of(std::sqrt(map.shares[a] / most)) == size) same.push_back(a);
    if (!same.empty()) canvas.dots(pixels(Eigen::all, same), largest * size / kShades, {map.colour.rgb, kDiscOpacity});
  }
}

LegendEntry entry_of(const std::string& name, const CostMap& map) {
  return dot_entry(name, {{map.colour.rgb, kDiscOpacity + kDarkestTriangle / 4}});
}

}  // namespace

void draw_energy(Canvas& canvas, const Points& pixels, const RegistrationPicture& picture) {
  draw_map(canvas, pixels, picture.map_triangles, energy_map(picture));
}

void draw_action(Canvas& canvas, const Points& pixels, const RegistrationPicture& picture) {
  draw_map(canvas, pixels, picture.map_triangles, action_map(picture));
}

void draw_doubts(Canvas& canvas, const Points& pixels, const std::vector<int>& doubted, double gap) {
  if (doubted.empty()) return;
  Points places = pixels(Eigen::all, doubted);
  places.row(1).array() += gap + kDoubtRadius + 2;
  draw_marks(canvas, places, kDoubtRadius, kDoubt, 1.5);
}

std::vector<LegendEntry> legend_of_verdicts(const RegistrationPicture& picture) {
  std::vector<LegendEntry> entries;
  if (is_mapped(picture.energy)) entries.push_back(entry_of("energy of the flow", energy_map(picture)));
  if (is_mapped(picture.action)) entries.push_back(entry_of("action of the noise", action_map(picture)));
  if (!picture.doubted.empty()) entries.push_back(dot_entry("doubted by prediction", kDoubt));
  return entries;
}

}  // namespace pulson::draw
