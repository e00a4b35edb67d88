#include "open_noise.hpp"

#include <algorithm>

#include <fmt/core.h>

#include "core/spec_text.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;

// Parameters whose value is not in the specification and has no default, in the order in which the model has them.
bool is_open(const Spec& spec, const ParameterInfo& info) {
  return info.default_text.empty() && !spec.values.contains(info.name);
}

}  // namespace

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
    const std::string term = text_of_spec(spec);
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

}  // namespace pulson::compare
