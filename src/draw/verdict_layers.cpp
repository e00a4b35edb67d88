#include "verdict_layers.hpp"

#include <array>
#include <cmath>

namespace pulson::draw {
namespace {

constexpr int kShades = 8;  // of triangles, and sizes of discs: steps that nobody tells apart
constexpr double kLargestDisc = 26, kDarkestTriangle = 0.5, kDiscOpacity = 0.28;
constexpr double kDoubtRadius = 6.5;
const SeriesLook kDoubt{colour::kMomentum, 2};  // a triangle

bool has_action(const RegistrationPicture& picture) { return picture.action.size() > 0 && picture.action.sum() > 0; }

// 0 to kShades.
int shade_of(double part) { return static_cast<int>(std::lround(part * kShades)); }

void draw_triangles(Canvas& canvas, const Points& pixels, const RegistrationPicture& picture, double most) {
  std::array<std::vector<Points>, kShades + 1> shades;
  for (const std::array<int, 3>& corners : picture.action_triangles)
    shades[static_cast<std::size_t>(shade_of(picture.action(corners).mean() / most))].emplace_back(
        pixels(Eigen::all, corners));
  for (int shade = 1; shade <= kShades; ++shade)
    if (auto& outlines = shades[static_cast<std::size_t>(shade)]; !outlines.empty())
      canvas.areas(std::move(outlines), {colour::kMomentum.rgb, kDarkestTriangle * shade / kShades});
}

}  // namespace

void draw_action(Canvas& canvas, const Points& pixels, const RegistrationPicture& picture, bool with_triangles) {
  if (!has_action(picture)) return;
  const double most = picture.action.maxCoeff();
  if (with_triangles) draw_triangles(canvas, pixels, picture, most);
  for (int size = 1; size <= kShades; ++size) {
    std::vector<int> same;
    for (int a = 0; a < picture.action.size(); ++a)
      if (shade_of(std::sqrt(picture.action[a] / most)) == size) same.push_back(a);
    if (!same.empty())
      canvas.dots(pixels(Eigen::all, same), kLargestDisc * size / kShades, {colour::kMomentum.rgb, kDiscOpacity});
  }
}

void draw_doubts(Canvas& canvas, const Points& pixels, const std::vector<int>& doubted, double gap) {
  if (doubted.empty()) return;
  Points places = pixels(Eigen::all, doubted);
  places.row(1).array() += gap + kDoubtRadius + 2;
  draw_marks(canvas, places, kDoubtRadius, kDoubt, 1.5);
}

std::vector<LegendEntry> legend_of_verdicts(const RegistrationPicture& picture) {
  std::vector<LegendEntry> entries;
  if (has_action(picture))
    entries.push_back(dot_entry("action of the noise", {{colour::kMomentum.rgb, kDiscOpacity + kDarkestTriangle / 4}}));
  if (!picture.doubted.empty()) entries.push_back(dot_entry("doubted by prediction", kDoubt));
  return entries;
}

}  // namespace pulson::draw
