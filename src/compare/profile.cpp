#include "profile.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr int kBisections = 12;
constexpr int kMostOutward = 40;

double upper_tail(double x) { return 0.5 * std::erfc(x / std::numbers::sqrt2); }

}  // namespace

double drop_of_ninety(double from_bound) {
  const double d = std::max(from_bound, 1e-9);
  if (d * d >= 2 * kDropOfNinety) return kDropOfNinety;
  double low = 1.6;
  double high = 2 * kDropOfNinety;
  for (int i = 0; i < 40; ++i) {
    const double c = (low + high) / 2;
    const double second = d * d < c ? (c + d * d) / (2 * d) : std::sqrt(c);
    (upper_tail(std::sqrt(c)) + upper_tail(second) > 0.1 ? low : high) = c;
  }
  return low / 2;
}

ProfileEnd profile_end(const Likelihood& likelihood, Index i, int direction, double step,
                       const std::function<double(double)>& drop, const std::vector<VectorXd>& others) {
  const double greatest = likelihood.value(likelihood.maximum);
  const double bound = direction > 0 ? likelihood.box.most[i] : likelihood.box.least[i];
  // The greatest with that number, from x, which is moved there.
  const auto is_inside = [&](double t, VectorXd& x) {
    Box box = likelihood.box;
    box.least[i] = box.most[i] = t;
    const BoxMaximum found = maximise_in_box(likelihood.value, likelihood.second_order, box, x);
    x = found.x;
    return found.value >= greatest - drop(t);
  };
  const auto end_beyond = [&](const VectorXd& from) -> ProfileEnd {
    VectorXd inside = from;
    VectorXd outside = inside;
    for (int count = 1;; ++count) {
      const double t = from[i] + direction * 0.5 * step * count;
      const bool beyond = direction * (t - bound) >= 0;
      outside = inside;
      if (!is_inside(beyond ? bound : t, outside)) break;
      inside = outside;
      if (beyond || count == kMostOutward) return {inside, true};
    }
    for (int k = 0; k < kBisections; ++k) {
      VectorXd between = inside;
      const bool in = is_inside((inside[i] + outside[i]) / 2, between);
      (in ? inside : outside) = between;
    }
    return {inside, false};
  };
  ProfileEnd end = end_beyond(likelihood.maximum);
  for (const VectorXd& other : others) {
    if (end.is_beyond) return end;
    VectorXd from = likelihood.box.clipped(other);
    if (direction * (from[i] - end.place[i]) <= 0 || !is_inside(from[i], from)) continue;
    end = end_beyond(from);
  }
  return end;
}

}  // namespace pulson::compare
