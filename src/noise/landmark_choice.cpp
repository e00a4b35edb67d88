#include "noise/landmark_choice.hpp"

#include <fmt/core.h>

#include "pulson/core/errors.hpp"

namespace pulson {

ParameterInfo LandmarkChoice::info() { return {"on", "all", "landmarks that it acts on, counted from 1, as in 1/3/5"}; }

std::string LandmarkChoice::spec() const {
  std::string text;
  for (const int landmark : on_) text += fmt::format("{}{}", text.empty() ? ",on=" : "/", landmark + 1);
  return text;
}

void LandmarkChoice::check(int landmarks, const std::string& spec) const {
  if (!on_.empty() && on_.back() >= landmarks)
    throw InputError(fmt::format("noise '{}': on={} names a landmark beyond the last; the shape has {}", spec,
                                 on_.back() + 1, landmarks));
}

}  // namespace pulson
