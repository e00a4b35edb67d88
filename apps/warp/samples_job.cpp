#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "images/pushed_mesh.hpp"
#include "images/rounding.hpp"
#include "jobs.hpp"
#include "pulson/random/brownian.hpp"
#include "shell/messages.hpp"

namespace pulson {
namespace {

// Mean and variance of every number of an image by Welford's updates, of colours in proportion to opacity.
class ImageMoments {
 public:
  explicit ImageMoments(const images::Image& like)
      : channels_(static_cast<std::size_t>(like.channels())),
        colours_(like.format().alpha == images::Alpha::kStraight ? channels_ - 1 : channels_),
        full_(like.full()),
        mean_(like.pixel_count() * channels_),
        squares_(mean_.size()) {}

  void add(const images::Image& image) {
    with_number_type(image.type(), [&]<class Value>() { add(image.values<Value>()); });
  }

  void mean_to(images::Image& image) const {
    with_number_type(image.type(), [&]<class Value>() { mean_to(image.values<Value>()); });
  }

  // Of each pixel, the root mean variance of its colours.
  std::vector<float> deviations() const {
    std::vector<float> deviations;
    for (std::size_t i = 0; i < mean_.size(); i += channels_) {
      const auto first = squares_.begin() + static_cast<std::ptrdiff_t>(i);
      const double sum = std::accumulate(first, first + static_cast<std::ptrdiff_t>(colours_), 0.0);
      deviations.push_back(static_cast<float>(std::sqrt(sum / static_cast<double>(colours_) / count_)));
    }
    return deviations;
  }

 private:
  template <class Value>
  void add(std::span<const Value> values) {
    ++count_;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::size_t channel = i % channels_;
      const double opacity =
          channel < colours_ && colours_ < channels_ ? static_cast<double>(values[i - channel + colours_]) / full_ : 1;
      const double value = opacity * static_cast<double>(values[i]);
      const double change = value - mean_[i];
      mean_[i] += change / count_;
      squares_[i] += change * (value - mean_[i]);
    }
  }

  template <class Value>
  void mean_to(std::span<Value> values) const {
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::size_t channel = i % channels_;
      double value = mean_[i];
      if (channel < colours_ && colours_ < channels_) {
        const double opacity = mean_[i - channel + colours_] / full_;
        value = opacity > 0 ? value / opacity : 0;
      }
      values[i] = images::rounded<Value>(value, full_);
    }
  }

  std::size_t channels_;
  std::size_t colours_;
  double full_;
  std::vector<double> mean_;
  std::vector<double> squares_;
  double count_ = 0;
};

}  // namespace

WarpResult warp_samples(const Picture& picture, const matching::Registration& registration, const WarpFrames& frames,
                        const WarpArguments& arguments) {
  if (arguments.inverse)
    throw InputError("--samples maps the source to the target; it cannot be combined with --inverse");
  const StochasticSystem system{registration_system(registration).kernel, registration_noise(registration)};
  const Points& q0 = registration.source.points;
  const int channels = system.noise->channels(static_cast<int>(q0.rows()), static_cast<int>(q0.cols()));
  if (channels == 0) throw InputError("--samples needs noise, and the registration has none");
  // Increments of Brownian motion need the scheme that compensates for their roughness.
  const std::string name = registration.integrator == "variational-paper" ? "variational" : registration.integrator;
  const auto integrator = make_integrator(name);

  if (picture.pages.front().about.has_palette())
    throw InputError("--samples makes the mean of pictures, which the colours of a palette do not have");
  const images::WarpImageOptions options = warp_options(arguments, frames, picture.pages.front());
  const std::vector<const images::Image*> pages = pages_of(picture);
  const images::Image& image = *pages.front();
  WarpResult result;
  std::vector<ImageMoments> moments;
  std::vector<float> folded(image.pixel_count());
  int done = 0;
  Progress progress;
  for (int s = 0; s < arguments.samples; ++s) {
    progress.show(static_cast<double>(s) / arguments.samples, fmt::format("sample {} of {}", s + 1, arguments.samples));
    const Eigen::MatrixXd increments =
        brownian_increments(arguments.seed, static_cast<std::uint64_t>(s), channels, registration.grid);
    images::PushedMesh pushed;
    try {
      const warp::MaterialFlow flow(
          system, integrator->integrate(system, {q0, registration.momenta}, registration.grid, increments),
          warp::parse_label_kernel(arguments.labels));
      const images::ImageWarp warp(flow, registration.alignment, frames.input, frames.result);
      pushed = push_image(pages, warp, options);
      result.landmark_error = std::max(result.landmark_error, warp.landmark_error());
    } catch (const StepError&) {
      continue;  // a path without a root, or space that it leaves without a place
    }
    ++done;
    const images::Image& one = pushed.pushed.image;
    if (moments.empty()) {
      result.image = one;
      result.more = pushed.pushed.more;
      result.multiplicity.resize(one.pixel_count());
      for (std::size_t i = 0; i < pages.size(); ++i) moments.emplace_back(one);
    }
    moments.front().add(one);
    for (std::size_t i = 1; i < pages.size(); ++i) moments[i].add(pushed.pushed.more[i - 1]);
    for (std::size_t i = 0; i < folded.size(); ++i) folded[i] += pushed.folds.folded[i] ? 1.0F : 0.0F;
    for (std::size_t i = 0; i < result.multiplicity.size(); ++i)
      result.multiplicity[i] = std::max(result.multiplicity[i], pushed.pushed.multiplicity[i]);
    images::MapFigures& figures = result.figures;
    figures.folded_fraction += pushed.folds.folded_fraction;
    figures.min_jacobian = std::min(figures.min_jacobian, pushed.folds.min_jacobian);
    figures.max_multiplicity = std::max(figures.max_multiplicity, pushed.pushed.coverage.max_multiplicity);
    figures.uncovered_fraction += pushed.pushed.coverage.uncovered_fraction();
    figures.map_error = std::max(figures.map_error, pushed.map_error);
  }
  if (moments.empty())
    throw InputError("no sample could be computed; use more --steps when registering, or less noise");
  moments.front().mean_to(result.image);
  for (std::size_t i = 1; i < pages.size(); ++i) moments[i].mean_to(result.more[i - 1]);
  result.holes.resize(result.multiplicity.size());
  result.figures.folded_fraction /= done;
  result.figures.uncovered_fraction /= done;
  result.reason = fmt::format(
      "mean over {} samples{}", done,
      done < arguments.samples ? fmt::format("; {} could not be computed", arguments.samples - done) : std::string());
  result.deviations = moments.front().deviations();
  for (float& each : folded) each /= static_cast<float>(done);
  result.fold_probabilities = std::move(folded);
  return result;
}

}  // namespace pulson
