#include "slips.hpp"

#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace pulson::audit {

using Eigen::Index;

std::vector<Slip> slips_of(const Eigen::VectorXd& here) {
  std::vector<Slip> slips;
  for (Index axis = 0; axis < here.size(); ++axis) {
    const char name = "xyz"[axis];
    const auto add = [&](double factor, const std::string& text) {
      Slip slip{here, -std::log(std::abs(factor)), fmt::format("{} {}", name, text)};
      slip.meant[axis] *= factor;
      slips.push_back(std::move(slip));
    };
    add(0.1, "is 10 times too large");
    add(10, "is 10 times too small");
    add(-1, "has the wrong sign");
    for (Index other = 0; other < axis; ++other) {
      Slip slip{here, 0, fmt::format("{} and {} are exchanged", "xyz"[other], name)};
      std::swap(slip.meant[axis], slip.meant[other]);
      slips.push_back(std::move(slip));
    }
  }
  return slips;
}

}  // namespace pulson::audit
