#pragma once

#include <array>
#include <limits>

namespace pulson::matching {

/// Costs of a path and of a shot of its p0 that differ by less than this part of J are the same.
constexpr double kSettled = 1e-3;

/// Diameters, rms: a shot that ends further from the end of its path has left it. Of the problems of
/// benchmarks/matching_problems.cpp those that rounds correct end up to 0.017 away at first (spiral, β 0.03), the
/// others 0.011 (crescent, β 0.003), 0.020 (strip), 0.055 and 0.074.
constexpr double kLost = 0.03;

/// Iterations of a round that begins at the last one's path. Where rounds succeed they take up to 5, where the shot
/// amplifies errors too much 8 to hundreds (the same problems).
constexpr int kMostRoundIterations = 10;

/// Whether rounds come closer: by half in every three.
class Settling {
 public:
  bool continues_at(double apart) {
    if (!(apart < 0.5 * before_[2])) return false;
    before_ = before_[0] == kFar ? std::array{apart, apart, apart} : std::array{apart, before_[0], before_[1]};
    return true;
  }

  void restart() { before_.fill(kFar); }

 private:
  static constexpr double kFar = std::numeric_limits<double>::infinity();
  std::array<double, 3> before_{kFar, kFar, kFar};
};

}  // namespace pulson::matching
