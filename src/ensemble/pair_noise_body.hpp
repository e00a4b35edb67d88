// The noises of a pair in vector lanes. Included once per vector target, so its guard toggles with the target.
#if defined(PULSON_PAIR_NOISE_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_PAIR_NOISE_BODY
#undef PULSON_PAIR_NOISE_BODY
#else
#define PULSON_PAIR_NOISE_BODY
#endif

#include <cmath>

#include <hwy/highway.h>

#include "pair_lanes.hpp"
#include "profiles_body.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson {
namespace HWY_NAMESPACE {

using LaneMask = hn::Mask<Tag>;

// Each has Act(sum, …): the noise of one step with w_i = ½√Δt sum_i turns the adapted momenta into those of the step
// and moves the positions, gap = q₂ − q₁. It returns the lanes where that can be done.

template <int channels>
struct ConstantNoise {
  static constexpr int kChannels = channels;
  static constexpr bool kMayFail = false;

  explicit ConstantNoise(const PairModel& model) {
    const double half_root_dt = 0.5 * std::sqrt(model.dt);
    for (int i = 0; i < channels; ++i) {
      q1_load[i] = Constant(half_root_dt * model.position[i][0]);
      gap_load[i] = Constant(half_root_dt * (model.position[i][1] - model.position[i][0]));
      p1_load[i] = Constant(half_root_dt * model.momentum[i][0]);
      p2_load[i] = Constant(half_root_dt * model.momentum[i][1]);
    }
  }

  HWY_INLINE LaneMask Act(const Vector (&sum)[channels], Vector& q1, Vector& gap, Vector& p1, Vector& p2) const {
    for (int i = 0; i < channels; ++i) {
      gap = hn::MulAdd(gap_load[i], sum[i], gap);
      q1 = hn::MulAdd(q1_load[i], sum[i], q1);
      p1 = hn::NegMulAdd(p1_load[i], sum[i], p1);
      p2 = hn::NegMulAdd(p2_load[i], sum[i], p2);
    }
    return hn::Eq(Constant(0.0), Constant(0.0));
  }

  Vector q1_load[channels], gap_load[channels], p1_load[channels], p2_load[channels];
};

// β exp(−z²/γ) and its derivative by z.
struct Bump {
  Bump(const PairModel& model, double factor)
      : beta(Constant(factor * model.beta)), exponent(Constant(-1 / model.gamma)), twice(hn::Add(exponent, exponent)) {}
  HWY_INLINE Vector Value(Vector z) const {
    return hn::Mul(beta, Exp(ClampExponent(hn::Mul(exponent, hn::Mul(z, z)))));
  }
  HWY_INLINE Vector Slope(Vector z, Vector value) const { return hn::Mul(hn::Mul(twice, z), value); }
  Vector beta, exponent, twice;
};

struct PotentialNoise {
  static constexpr int kChannels = 1;
  static constexpr bool kMayFail = false;

  explicit PotentialNoise(const PairModel& model) : bump(model, 0.5 * std::sqrt(model.dt)) {}

  HWY_INLINE LaneMask Act(const Vector (&sum)[1], Vector& /*q1*/, Vector& gap, Vector& p1, Vector& p2) const {
    const Vector slope = bump.Slope(gap, bump.Value(gap));
    p1 = hn::MulAdd(slope, sum[0], p1);
    p2 = hn::NegMulAdd(slope, sum[0], p2);
    return hn::Eq(gap, gap);
  }

  Bump bump;
};

// With s the bump, w_a the sum of the increments that move landmark a and u = w₁p₁ + w₂p₂: p₁ = p̂₁ + s'u,
// p₂ = p̂₂ − s'u, so u (1 − s'(w₁ − w₂)) = w₁p̂₁ + w₂p̂₂. The branch from Δt = 0 ends where that bracket vanishes.
struct ScreenedNoise {
  static constexpr int kChannels = 2;
  static constexpr bool kMayFail = true;

  explicit ScreenedNoise(const PairModel& model) : bump(model, 0.5 * std::sqrt(model.dt)) {
    for (int i = 0; i < kChannels; ++i)
      for (int a = 0; a < 2; ++a) moves[i][a] = Constant(model.position[i][a]);
  }

  HWY_INLINE LaneMask Act(const Vector (&sum)[2], Vector& q1, Vector& gap, Vector& p1, Vector& p2) const {
    const Vector w1 = hn::MulAdd(moves[0][0], sum[0], hn::Mul(moves[1][0], sum[1]));
    const Vector w2 = hn::MulAdd(moves[0][1], sum[0], hn::Mul(moves[1][1], sum[1]));
    const Vector value = bump.Value(gap);
    const Vector slope = bump.Slope(gap, value);
    const Vector bracket = hn::NegMulAdd(slope, hn::Sub(w1, w2), Constant(1.0));
    const Vector u = hn::Div(hn::MulAdd(w1, p1, hn::Mul(w2, p2)), bracket);
    p1 = hn::MulAdd(slope, u, p1);
    p2 = hn::NegMulAdd(slope, u, p2);
    q1 = hn::MulAdd(value, w1, q1);
    gap = hn::MulAdd(value, hn::Sub(w2, w1), gap);
    return hn::Gt(bracket, hn::Zero(Tag()));
  }

  Bump bump;
  Vector moves[2][2];
};

}  // namespace HWY_NAMESPACE
}  // namespace pulson
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_PAIR_NOISE_BODY
