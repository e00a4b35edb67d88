#include "amplitudes.hpp"

#include <algorithm>

#include <fmt/core.h>

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kProportional = 1e-9;  // largest difference from that, of the field

// Parameters whose value is not in the specification and has no default, in the order in which the model has them.
bool is_open(const Spec& spec, const ParameterInfo& info) {
  return info.default_text.empty() && !spec.values.contains(info.name);
}

}  // namespace

std::string spec_text(const Spec& spec) {
  std::string text = spec.name;
  for (const auto& [key, value] : spec.values)
    text += fmt::format("{}{}={}", text.size() == spec.name.size() ? ":" : ",", key, value);
  return text;
}

OpenNoise make_open_noise(const NoiseChoice& choice, const Landmarks& shape) {
  if (choice.model()) return {choice.model(), {}, true};
  OpenNoise noise;
  noise.is_own = choice.is_own();
  std::string complete;
  Index before = 0;  // parameters of the terms before
  for (Spec spec : parse_spec_sum(choice.spec(), "noise")) {
    std::vector<std::string> open;
    for (const ParameterInfo& info : choice.table().find(spec.name).parameters)
      if (is_open(spec, info)) {
        open.push_back(info.name);
        spec.values[info.name] = "1";
      }
    const std::string term = spec_text(spec);
    complete += (complete.empty() ? "" : "+") + term;
    const std::vector<std::string> names = make_noise(term, shape, choice.table())->parameter_names();
    for (const std::string& name : open) {
      const auto place = std::find(names.begin(), names.end(), name);
      if (place == names.end())
        throw InputError(fmt::format("noise '{}' needs {}, which cannot be fitted; give it", spec.name, name));
      noise.open.push_back(before + (place - names.begin()));
    }
    before += std::ssize(names);
  }
  noise.model = make_noise(complete, shape, choice.table());
  return noise;
}

std::vector<int> channel_amplitudes(const NoiseModel& noise, const Points& shape) {
  const int channels = noise.channels(static_cast<int>(shape.rows()), static_cast<int>(shape.cols()));
  const VectorXd values = noise.parameters();
  // Momenta that are all different, so that no field vanishes by chance.
  const PhaseState state{shape, Points::NullaryExpr(shape.rows(), shape.cols(), [](Index i, Index j) {
                           return 1 + 0.37 * static_cast<double>(i) + 0.11 * static_cast<double>(j);
                         })};
  std::vector<int> amplitudes(static_cast<std::size_t>(channels), -1);
  for (int c = 0; c < channels; ++c) {
    const VectorXd unit = VectorXd::Unit(channels, c);
    const PhaseState field = noise.gradient(state, unit);
    const double size = field.q.norm() + field.p.norm();
    for (Index i = 0; i < values.size(); ++i) {
      const PhaseState change = noise.gradient_by_parameters(state, unit, VectorXd::Unit(values.size(), i));
      const double off = (values[i] * change.q - field.q).norm() + (values[i] * change.p - field.p).norm();
      if (size > 0 && off <= kProportional * size) amplitudes[static_cast<std::size_t>(c)] = static_cast<int>(i);
    }
  }
  return amplitudes;
}

}  // namespace pulson::compare
