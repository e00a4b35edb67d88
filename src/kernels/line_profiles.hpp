#pragma once

#include <array>
#include <cstddef>

namespace pulson {

/// The factors of a profile k = P(t)e^{−t}: P, P' − P and P'' − 2P' + P, whose products with e^{−t} are k and its
/// derivatives by t, of the moments of weights on one side.
struct PeakonOnLine {
  static constexpr int kMoments = 1;
  template <class Moments>
  static auto value(const Moments& s) {
    return s[0];
  }
  template <class Moments>
  static auto slope(const Moments& s) {
    return -s[0];
  }
  template <class Moments>
  static auto second(const Moments& s) {
    return s[0];
  }
  static constexpr double kSecondAtZero = 0;  ///< by convention
};

struct Matern32OnLine {
  static constexpr int kMoments = 2;
  template <class Moments>
  static auto value(const Moments& s) {
    return s[0] + s[1];
  }
  template <class Moments>
  static auto slope(const Moments& s) {
    return -s[1];
  }
  template <class Moments>
  static auto second(const Moments& s) {
    return s[1] - s[0];
  }
  static constexpr double kSecondAtZero = -1;
};

struct Matern52OnLine {
  static constexpr int kMoments = 3;
  template <class Moments>
  static auto value(const Moments& s) {
    return s[0] + s[1] + s[2] / 3;
  }
  template <class Moments>
  static auto slope(const Moments& s) {
    return -(s[1] + s[2]) / 3;
  }
  template <class Moments>
  static auto second(const Moments& s) {
    return (s[2] - s[1] - s[0]) / 3;
  }
  static constexpr double kSecondAtZero = -1.0 / 3;
};

/// s_k = Σ w_j t_j^k e^{−t_j} of the weights on one side of a place: see line_sums().
/// @tparam Weights numbers, such as those of one place in several columns or steps
template <class Profile, class Weights>
class LineMoments {
 public:
  explicit LineMoments(const Weights& zero) { s_.fill(zero); }

  const Weights& operator[](int k) const { return s_[static_cast<std::size_t>(k)]; }

  /// To the next place, at a distance h with decay = e^{−h}, with the weights of this one.
  template <class Distance>
  void advance(const Weights& here, const Distance& h, const Distance& decay) {
    s_[0] += here;
    if constexpr (Profile::kMoments == 3) s_[2] = decay * (s_[2] + h * (2 * s_[1] + h * s_[0]));
    if constexpr (Profile::kMoments > 1) s_[1] = decay * (s_[1] + h * s_[0]);
    s_[0] *= decay;
  }

 private:
  std::array<Weights, Profile::kMoments> s_;
};

}  // namespace pulson
