#include "drawings.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "images/compose.hpp"
#include "pulson/images/image.hpp"
#include "shell/outputs.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;

constexpr double kLongestDrawnSide = 1800;  // pixels of an image in a drawing at 96 dpi
constexpr int kBarColours = 96;
constexpr int kSquares = 8;  // of a checkerboard, along the longer side

/// −2, −1.5, … without digits that say nothing.
std::string bar_number(double value) {
  std::string text = fmt::format("{:.3g}", value);
  if (text.starts_with('-')) text.replace(0, 1, "−");
  return text;
}

std::vector<std::string> colours_of(const images::Image& strip) {
  std::vector<std::string> colours;
  const auto values = strip.values<std::uint8_t>();
  for (std::size_t i = 0; i < strip.pixel_count(); ++i)
    colours.push_back(fmt::format("#{:02X}{:02X}{:02X}", values[4 * i], values[4 * i + 1], values[4 * i + 2]));
  return colours;
}

std::vector<float> even(double low, double high) {
  const Eigen::VectorXf values = Eigen::VectorXd::LinSpaced(kBarColours, low, high).cast<float>();
  return {values.begin(), values.end()};
}

/// Mean difference of the colours of two pictures where both are opaque, 0 to 255.
double mean_difference(const images::Image& a, const images::Image& b) {
  const images::Image left = to_rgba8(a), right = to_rgba8(b);
  const auto first = left.values<std::uint8_t>(), second = right.values<std::uint8_t>();
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < std::min(first.size(), second.size()); i += 4) {
    if (first[i + 3] == 0 || second[i + 3] == 0) continue;
    for (std::size_t c = 0; c < 3; ++c) sum += std::abs(int{first[i + c]} - int{second[i + c]});
    count += 3;
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace

std::string file_name(const std::string& file) { return fs::path(file).filename().string(); }

draw::ColourBar bar_of(const images::DivergingScale& scale, const std::vector<float>& values) {
  draw::ColourBar bar{
      .colours = colours_of(images::diverging(even(scale.centre - scale.reach, scale.centre + scale.reach), kBarColours,
                                              1, {.centre = scale.centre, .reach = scale.reach})),
      .labels = {}};
  const bool ends_at_mark = scale.marked_below == scale.centre - scale.reach;
  for (const double part : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const std::string sign = part == 1 ? "≥ " : part == 0 && !ends_at_mark ? "≤ " : "";
    bar.labels.emplace_back(part, sign + bar_number(scale.centre + (2 * part - 1) * scale.reach));
  }
  const auto is_marked = [&](float value) { return value < *scale.marked_below; };
  if (scale.marked_below && std::any_of(values.begin(), values.end(), is_marked)) {
    constexpr float kBelowAll = -std::numeric_limits<float>::infinity();
    bar.mark = colours_of(diverging({kBelowAll}, 1, 1, scale)).front();
    bar.mark_label = ends_at_mark ? fmt::format("folds, below {}", bar_number(*scale.marked_below)) : "folds";
  }
  return bar;
}

// A field for each count that occurs; of many, some have a number.
draw::ColourBar bar_of_counts(double most, const std::vector<float>& counts) {
  constexpr double kMostTicks = 16;
  std::vector<float> occurring = counts;
  std::sort(occurring.begin(), occurring.end());
  occurring.erase(std::unique(occurring.begin(), occurring.end()), occurring.end());
  const auto fields = static_cast<double>(occurring.size());
  const auto step = static_cast<std::size_t>(std::ceil(fields / kMostTicks));
  draw::ColourBar bar{.colours = colours_of(images::viridis(occurring, static_cast<int>(occurring.size()), 1, 0, most)),
                      .labels = {}};
  for (std::size_t i = 0; i < occurring.size(); i += step)
    bar.labels.emplace_back((static_cast<double>(i) + 0.5) / fields, bar_number(occurring[i]));
  return bar;
}

namespace {

// The picture with a grey of its own where it is transparent.
images::Image on_grey(images::Image picture) {
  constexpr std::uint8_t kGrey = 222;
  const auto values = picture.values<std::uint8_t>();
  for (std::size_t i = 0; i < values.size(); i += 4)
    if (values[i + 3] == 0) std::fill_n(values.begin() + static_cast<std::ptrdiff_t>(i), 3, kGrey), values[i + 3] = 255;
  return picture;
}

}  // namespace

draw::ColourBar bar_of(double most) {
  draw::ColourBar bar{.colours = colours_of(images::viridis(even(0, most), kBarColours, 1, 0, most)), .labels = {}};
  const double power = std::pow(10, std::floor(std::log10(most / 5)));
  double step = 10 * power;
  for (const double factor : {5.0, 2.0, 1.0})
    if (factor * power >= most / 5) step = factor * power;
  for (double value = 0; value <= most * (1 + 1e-9); value += step)
    bar.labels.emplace_back(value / most, bar_number(value));
  return bar;
}

draw::ImagePanel Drawings::panel_of(std::string heading, const images::Image& image, int width, int height) const {
  const double longest = kLongestDrawnSide * std::max(1.0, arguments_.dpi / 96);
  const double factor = std::max(image.width(), image.height()) / longest;
  const images::Image shown = to_rgba8(for_show(image));
  return {.heading = std::move(heading),
          .pixels = raster_of(factor > 1 ? scaled_down(shown, factor) : shown),
          .width = width,
          .height = height};
}

void Drawings::write(const draw::ImagePicture& picture, const fs::path& file) const {
  write_image_picture(picture, drawing_as(file, arguments_.width, arguments_.dpi));
  note_missing_font();
}

std::string Drawings::png_of(const draw::ImagePicture& picture, std::string& narrow) const {
  return image_picture_png(picture, {.width = arguments_.width, .dpi = arguments_.dpi, .narrow = &narrow});
}

draw::ImagePicture Drawings::side_by_side(const images::Image& image, const images::WarpedImage& result,
                                          const images::ImageWarp& warp, const WarpFrames& frames) const {
  const std::vector<Points> paths = warp.landmark_paths();
  const bool inverse = arguments_.inverse;
  draw::ImagePanel before = panel_of(file_name(arguments_.input), image, image.width(), image.height());
  before.grid = grid_lines(image.width(), image.height());
  before.landmarks = inverse ? paths.back() : warp.label_pixels();
  draw::ImagePanel after =
      panel_of(inverse ? "Warped to the source" : "Warped to the target", result.image, frames.width, frames.height);
  after.grid = moved_grid(image, warp, inverse);
  after.landmarks = inverse ? warp.label_pixels() : paths.back();
  if (!inverse) after.paths = paths;
  draw::ImagePicture picture{.panels = {std::move(before), std::move(after)}, .title = frames.title, .subtitle = {}};
  if (frames.like) {
    draw::ImagePanel& like = picture.panels.emplace_back(
        panel_of(file_name(arguments_.like), frames.like->image, frames.width, frames.height));
    like.landmarks = frames.landmarks_there;
    like.is_target = !inverse;
  }
  if (arguments_.numbers)
    for (draw::ImagePanel& panel : picture.panels) panel.names = frames.names;
  return picture;
}

draw::ImagePicture Drawings::overlay(const images::WarpedImage& result, const WarpFrames& frames) const {
  images::Image shown = to_rgba8(for_show(result.image));
  const images::Image there = for_show(frames.like->image);
  for (std::size_t i = 0; i < result.multiplicity.size(); ++i)  // where nothing of the source arrives
    if (result.multiplicity[i] == 0) shown.values<std::uint8_t>()[4 * i + 3] = 0;
  const auto panel = [&](const char* heading, const images::Image& image) {
    return panel_of(heading, image, frames.width, frames.height);
  };
  return {.panels = {panel("Checkerboard of both", checkerboard(shown, there, kSquares)),
                     panel("Half of each", blend(shown, there)),
                     panel("Difference, white where none", on_grey(difference(shown, there)))},
          .title = fmt::format("{} over {}", file_name(arguments_.out), file_name(arguments_.like)),
          .subtitle =
              fmt::format("Mean difference of the colours, where both are: {:.1f} of 255  ·  grey: only one is there",
                          mean_difference(shown, there))};
}

draw::ImagePicture Drawings::jacobian(const images::Image& image, const images::ImageWarp& warp,
                                      const std::vector<float>& jacobians) const {
  return numbers({kJacobianHeading, diverging(jacobians, image.width(), image.height(), kJacobianScale),
                  bar_of(kJacobianScale, jacobians), image.width(), image.height(),
                  landmarks_on_image(warp, arguments_)});
}

draw::ImagePicture Drawings::numbers(const Numbers& numbers) const {
  draw::ImagePanel panel = panel_of(numbers.heading, numbers.colours, numbers.width, numbers.height);
  panel.bars = {numbers.bar};
  panel.landmarks = numbers.landmarks;
  return {.panels = {std::move(panel)}, .title = {}, .subtitle = {}};
}

}  // namespace pulson
