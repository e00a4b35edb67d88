#include <string>

#include "fuzz_targets.hpp"
#include "fuzzing.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::fuzz {
namespace {

constexpr int kLandmarks = 3;
constexpr int kMostChannels = 1000;  // for which derivatives take a moment only

Landmarks shape_in(int d) {
  Landmarks shape;
  shape.points = Points::Identity(d, kLandmarks);
  shape.points.row(0) += Eigen::RowVector3d(0, 0.5, 2);
  shape.groups = {"a", "a", "b"};
  return shape;
}

void use_kernel(const KernelOperator& kernel, const Landmarks& shape) {
  const std::string spec = kernel.spec();
  require(demand("a kernel's own specification", [&] { return make_kernel(spec, shape.points); }).spec() == spec,
          "a kernel is not made again by its specification " + spec);
  kernel.apply(shape.points, shape.points, shape.points);
  kernel.gradient(shape.points, shape.points, shape.points);
}

void use_noise(const NoiseModel& noise, const Landmarks& shape) {
  const std::string spec = noise.spec();
  require(demand("a noise's own specification", [&] { return make_noise(spec, shape); })->spec() == spec,
          "a noise is not made again by its specification " + spec);
  const int d = shape.dimension();
  const auto fits = attempt([&] {
    noise.check(d, kLandmarks);
    return true;
  });
  if (!fits) return;
  const int channels = noise.channels(d, kLandmarks);
  require(channels >= 0, "a noise has " + std::to_string(channels) + " channels: " + spec);
  if (channels > kMostChannels) return;
  const PhaseState state{shape.points, shape.points};
  const Eigen::VectorXd w = Eigen::VectorXd::Constant(channels, 0.1);
  require(noise.potentials(state).size() == channels, "a noise has other potentials than channels: " + spec);
  require(noise.contract(state, noise.gradient(state, w)).size() == channels, "gradients of " + spec);
  noise.compensation_gradient(state);
  noise.spatial_noise(shape.points, state, w);
  noise.spatial_compensation(shape.points, state);
  const auto same = demand("a noise's own parameters", [&] { return noise.with_parameters(noise.parameters()); });
  require(same->spec() == spec, "a noise changes with its own parameters: " + spec);
}

}  // namespace

bool specs(std::string_view input) {
  attempt([&] { return parse_number_list(input, "list"); });
  attempt([&] { return make_integrator(input); });
  shortened_spec(input);
  for (int d = 1; d <= 3; ++d) {
    const Landmarks shape = shape_in(d);
    if (const auto kernel = attempt([&] { return make_kernel(input, shape.points); })) use_kernel(*kernel, shape);
    if (const auto noise = attempt([&] { return make_noise(input, shape); })) use_noise(**noise, shape);
  }
  return true;
}

}  // namespace pulson::fuzz
