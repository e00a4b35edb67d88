#include "underlay.hpp"

#include <algorithm>
#include <cmath>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "draw/child_process.hpp"
#include "picture.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/records/records.hpp"
#include "shell/path_options.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;

constexpr double kLongestSide = 900;  // pixels

// A box in whole pixels.
struct PixelBox {
  Vector2d low;
  double pixel;
  int width, height;

  PixelBox(const Vector2d& from, const Vector2d& to) : low(from), pixel((to - from).maxCoeff() / kLongestSide) {
    width = std::max(1, static_cast<int>(std::lround((to - from).x() / pixel)));
    height = std::max(1, static_cast<int>(std::lround((to - from).y() / pixel)));
  }

  Vector2d high() const { return low + pixel * Vector2d(width, height); }

  // The options of `warp` for a picture of this box; where y points up, its origin is that of the lower edge.
  std::vector<std::string> frame(const std::string& prefix, bool y_down) const {
    const Vector2d origin = low + pixel / 2 * Vector2d(1, y_down ? 1 : -1);
    return {fmt::format("--{}pixel-size={}", prefix, pixel),
            fmt::format("--{}origin={},{}", prefix, origin.x(), origin.y())};
  }
  std::string size() const { return fmt::format("--size={}x{}", width, height); }
};

// The same landmarks, which stay where they are.
matching::Registration at_rest(matching::Registration registration) {
  registration.noise = "none";
  registration.own_noise = nullptr;
  registration.mode = matching::MatchingMode::kDeterministic;
  registration.integrator = "rk4";
  registration.grid.steps = 1;
  registration.samples = 1;
  registration.momenta.setZero();
  registration.increments.resize(0, 1);
  registration.states.clear();
  registration.result = registration.source.points;
  registration.uncertainty.reset();
  return registration;
}

// The same flow of a source that needs no alignment.
matching::Registration of_aligned(matching::Registration registration) {
  registration.original = registration.source;
  registration.alignment = {AlignmentKind::kNone, 1, Eigen::MatrixXd::Identity(2, 2), Eigen::VectorXd::Zero(2)};
  return registration;
}

// What a program said of the image, without its name.
std::string reason_of(std::string printed) {
  printed = printed.substr(0, printed.find('\n'));
  constexpr std::string_view kName = "pulson: ";
  return printed.starts_with(kName) ? printed.substr(kName.size()) : printed;
}

}  // namespace

SourceImage named_image(const Landmarks& shape, bool scale_was_applied) {
  if (shape.image.empty() || shape.dimension() != 2) return {};
  std::string name = shape.image;
  std::replace(name.begin(), name.end(), '\\', '/');
  const fs::path folder = fs::path(shape.source.substr(0, shape.source.find('#'))).parent_path();
  for (const fs::path& file : {folder / name, folder / fs::path(name).filename()}) {
    if (!is_file(file)) continue;
    run_paths().reads(file, "the image of " + shape.source);
    return {file, scale_was_applied ? shape.scale.value_or(1) : 1, {0, 0}};
  }
  return {};
}

Underlay::Underlay(const SourceImage& image, const matching::Registration& registration,
                   draw::RegistrationPicture& picture, StagedFiles& staged, std::vector<std::string>& notes)
    : staged_(staged) {
  if (image.file.empty() || picture.grid_after.empty()) return;
  const bool y_down = picture.source.y_down || picture.target.y_down;
  orientation_ = y_down ? "--no-flip-y" : "--flip-y";
  const auto [low, high] = drawn_box(registration);
  const PixelBox before(low, high);
  const auto [moved_low, moved_high] = bounding_box(joined_lines(picture.grid_after));
  const PixelBox after(low.cwiseMin(moved_low), high.cwiseMax(moved_high));
  const fs::path rest = scratch("rest.json"), flow = scratch("flow.json");
  staged_.write(rest.filename(), records::registration_json(at_rest(registration), {}));
  staged_.write(flow.filename(), records::registration_json(of_aligned(registration), {}));
  const fs::path aligned = scratch("aligned.png"), carried = scratch("carried.png"), page = scratch("aligned.jpg");

  std::vector<std::string> of_image = {image.file.string(), before.size(),
                                       fmt::format("--pixel-size={}", image.pixel_size),
                                       fmt::format("--origin={},{}", image.origin[0], image.origin[1])};
  const std::vector<std::string> to_before = before.frame("target-", y_down);
  of_image.insert(of_image.end(), to_before.begin(), to_before.end());
  if (!warp(rest, of_image, aligned) || !warp(rest, of_image, page)) {
    notes.push_back(
        fmt::format("{}: it is not drawn below the landmarks: {}", image.file.string(), reason_of(printed_)));
    return;
  }
  constexpr std::string_view kOutside = "warning: ";
  if (printed_.starts_with(kOutside) && printed_.find("lie outside") < printed_.find('\n'))
    notes.push_back(reason_of(printed_.substr(kOutside.size())));
  picture.image_before = {aligned, before.low, before.high()};
  aligned_ = {page, before.low, before.high()};
  std::vector<std::string> of_aligned = {aligned.string(), after.size()};
  for (const auto& options : {before.frame("", y_down), after.frame("target-", y_down)})
    of_aligned.insert(of_aligned.end(), options.begin(), options.end());
  if (warp(flow, of_aligned, carried)) picture.image_after = {carried, after.low, after.high()};
}

void Underlay::remove() const {
  std::error_code ignored;
  for (const fs::path& file : files_) fs::remove(file, ignored);
}

fs::path Underlay::scratch(const std::string& name) { return files_.emplace_back(staged_.file(".underlay-" + name)); }

bool Underlay::warp(const fs::path& record, const std::vector<std::string>& options, const fs::path& out) {
  // This program, as its user would call it.
  std::vector<std::string> arguments = {"warp", record.string()};
  arguments.insert(arguments.end(), options.begin(), options.end());
  arguments.insert(arguments.end(), {orientation_, "--border=transparent", "--quiet", "--out", out.string()});
  draw::ChildProcess child(fs::read_symlink("/proc/self/exe"), arguments);
  printed_ = child.wait();
  return printed_.empty();
}

}  // namespace pulson
