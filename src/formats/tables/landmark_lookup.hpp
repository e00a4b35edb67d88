#pragma once

#include <map>
#include <optional>
#include <string>

#include "pulson/core/landmarks.hpp"

namespace pulson::formats {

/// Landmarks by their labels, or by their numbers where they have other labels.
class LandmarkLookup {
 public:
  explicit LandmarkLookup(const Landmarks& shape) {
    for (int a = 0; a < shape.count(); ++a) {
      numbers_.try_emplace(std::to_string(shape.number(a)), a);
      if (!shape.labels.empty()) labels_.try_emplace(shape.labels[static_cast<std::size_t>(a)], a);
    }
  }

  std::optional<int> find(const std::string& name) const {
    if (const auto label = labels_.find(name); label != labels_.end()) return label->second;
    const auto number = numbers_.find(name);
    return number == numbers_.end() ? std::nullopt : std::optional(number->second);
  }

 private:
  std::map<std::string, int> labels_, numbers_;
};

}  // namespace pulson::formats
