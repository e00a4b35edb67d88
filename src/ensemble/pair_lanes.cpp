// Compiled once per vector target by foreach_target.h; the best one is chosen at run time.

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pair_lanes.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
#include "normal_lanes_body.hpp"
#include "pair_lanes.hpp"
#include "profiles_body.hpp"
// clang-format on

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::ensemble {
namespace HWY_NAMESPACE {

using namespace pulson::HWY_NAMESPACE;  // NOLINT(google-build-using-namespace): the same target's lanes

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

// n vectors of lanes at a time: their independent chains hide the latencies of one another.
template <class Profile, class Noise, int n>
class PairStepper {
  static constexpr int channels = Noise::kChannels;

 public:
  HWY_INLINE PairStepper(const PairModel& model, PairBatch& batch, std::size_t first_lane)
      : model_(model),
        batch_(batch),
        first_lane_(first_lane),
        profile_(model.kernel),
        noise_(model),
        normals_(model.seed) {
    dt_ = Constant(model.dt);
    at_zero_ = Constant(model.kernel.weight);
    steepest_ = Constant(1 / model.lipschitz);
    reach_ = Constant(model.reach);
    side_ = Constant(batch.side);
    Load();
  }

  HWY_INLINE void Run(std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t step = first; step < last;) {
      const std::uint32_t block = step / 4;
      Vector normals[channels][n][4];
      for (int i = 0; i < channels; ++i) Draw(block, static_cast<std::uint32_t>(i), normals[i]);
      if (step % 4 == 0) StopBeyondBound(step);
      for (; step < last && step / 4 == block; ++step) Step(normals, step);
    }
    Store();
  }

 private:
  static HWY_INLINE std::size_t Lanes() { return hn::Lanes(Tag()); }

  HWY_INLINE void Draw(std::uint32_t block, std::uint32_t channel, Vector (&normals)[n][4]) const {
    NormalLanes::Counter counters[n];
    for (int v = 0; v < n; ++v) {
      const auto path = hn::Iota(NormalLanes::WordTag(), batch_.first_path + first_lane_ + v * Lanes());
      counters[v] = {model_.antithetic ? hn::ShiftRight<1>(path) : path, NormalLanes::Word(block),
                     NormalLanes::Word(channel)};
    }
    normals_.Draw(counters, normals);
    if (!model_.antithetic) return;
    for (int v = 0; v < n; ++v) {
      const auto path = hn::Iota(NormalLanes::WordTag(), batch_.first_path + first_lane_ + v * Lanes());
      const auto sign = hn::ShiftLeft<63>(path);
      for (Vector& normal : normals[v])
        normal = hn::BitCast(Tag(), hn::Xor(hn::BitCast(NormalLanes::WordTag(), normal), sign));
    }
  }

  HWY_INLINE void Step(const Vector (&normals)[channels][n][4], std::uint32_t step) {
    Vector c[n], p1[n], p2[n], a[n];
    for (int v = 0; v < n; ++v) {
      Vector sum[channels];
      for (int i = 0; i < channels; ++i) {
        const Vector now = normals[i][v][step % 4];
        sum[i] = hn::Add(before_[i][v], now);
        before_[i][v] = now;
      }
      c[v] = gap_[v];
      q1_moved_[v] = q1_[v];
      p1[v] = p1_[v];
      p2[v] = p2_[v];
      const LaneMask acts = noise_.Act(sum, q1_moved_[v], c[v], p1[v], p2[v]);
      if (Noise::kMayFail && !hn::AllFalse(Tag(), hn::AndNot(acts, running_[v])))
        Stop(v, step, acts, LaneStatus::kNoRoot);
      a[v] = hn::Mul(dt_, hn::Sub(p2[v], p1[v]));
    }
    Vector gap[n], value[n], slope[n];
    LaneMask hard[n];
    SolveGaps(c, a, gap, value, slope, hard);
    for (int v = 0; v < n; ++v) {
      if (!hn::AllFalse(Tag(), hard[v])) SolveHard(v, step, hard[v], c[v], a[v], gap[v], value[v], slope[v]);
      const Vector force = hn::Mul(hn::Mul(dt_, slope[v]), hn::Mul(p1[v], p2[v]));
      const Vector velocity = hn::MulAdd(at_zero_, p1[v], hn::Mul(value[v], p2[v]));
      const LaneMask run = running_[v];
      gap_[v] = hn::IfThenElse(run, gap[v], gap_[v]);
      q1_[v] = hn::IfThenElse(run, hn::MulAdd(dt_, velocity, q1_moved_[v]), q1_[v]);
      p1_[v] = hn::IfThenElse(run, hn::Add(p1[v], force), p1_[v]);
      p2_[v] = hn::IfThenElse(run, hn::Sub(p2[v], force), p2_[v]);
      value_[v] = value[v];
      largest_[v] = hn::Max(largest_[v], hn::Max(hn::Abs(p1_[v]), hn::Abs(p2_[v])));
      smallest_side_[v] = hn::Min(smallest_side_[v], hn::Mul(gap_[v], side_));
    }
  }

  // Newton for g = c + A (K(0) − K(g)). A lane whose root is out of the kernel's reach has it at once. Else it ends
  // with the correction δ that is below 1e-8 of g, and takes K and K' at its end from their Taylor series, with errors
  // of the size δ². Lanes with κ ≥ 1, or that have not ended, are hard.
  HWY_INLINE void SolveGaps(const Vector (&c)[n], const Vector (&a)[n], Vector (&gap)[n], Vector (&value)[n],
                            Vector (&slope)[n], LaneMask (&hard)[n]) const {
    LaneMask open[n];
    bool near = false;
    for (int v = 0; v < n; ++v) {
      const Vector free = hn::MulAdd(a[v], at_zero_, c[v]);
      const LaneMask far = hn::Gt(hn::Abs(free), reach_);
      gap[v] = hn::IfThenElse(far, free, hn::NegMulAdd(a[v], value_[v], free));
      value[v] = slope[v] = hn::Zero(Tag());
      hard[v] = hn::AndNot(hn::Lt(hn::Abs(a[v]), steepest_), running_[v]);
      open[v] = hn::AndNot(hn::Or(far, hard[v]), running_[v]);
      near = near || !hn::AllFalse(Tag(), open[v]);
    }
    if (!near) return;
    for (int turn = 0; turn < kMostTurns; ++turn) {
      bool any = false;
      for (int v = 0; v < n; ++v) {
        const Vector g = gap[v];
        const Vector s = hn::Mul(g, g);
        const DroppingJet jet = profile_.Dropping(s);
        const Vector k_slope = hn::Mul(jet.first, g);
        const Vector k_curvature = hn::MulAdd(jet.second, s, jet.first);
        const Vector f = hn::NegMulAdd(a[v], jet.drop, hn::Sub(g, c[v]));
        const Vector delta = hn::Div(f, hn::MulAdd(a[v], k_slope, Constant(1.0)));
        gap[v] = hn::IfThenElse(open[v], hn::Sub(g, delta), g);
        const LaneMask ends = hn::And(open[v], hn::Le(hn::Abs(delta), hn::Mul(Constant(1e-8), hn::Abs(g))));
        value[v] = hn::IfThenElse(ends, hn::NegMulAdd(k_slope, delta, jet.value), value[v]);
        slope[v] = hn::IfThenElse(ends, hn::NegMulAdd(k_curvature, delta, k_slope), slope[v]);
        open[v] = hn::AndNot(ends, open[v]);
        any = any || !hn::AllFalse(Tag(), open[v]);
      }
      if (!any) return;
    }
    for (int v = 0; v < n; ++v) hard[v] = hn::Or(hard[v], open[v]);
  }

  // One lane after the other; those without a root stop.
  HWY_NOINLINE void SolveHard(int v, std::uint32_t step, LaneMask hard, Vector c, Vector a, Vector& gap, Vector& value,
                              Vector& slope) {
    HWY_ALIGN double is_hard[kPathBatch], lane_c[kPathBatch], lane_a[kPathBatch], lane_gap[kPathBatch],
        lane_value[kPathBatch], lane_slope[kPathBatch], found[kPathBatch];
    hn::Store(hn::IfThenElseZero(hard, Constant(1.0)), Tag(), is_hard);
    hn::Store(c, Tag(), lane_c);
    hn::Store(a, Tag(), lane_a);
    hn::Store(gap, Tag(), lane_gap);
    hn::Store(value, Tag(), lane_value);
    hn::Store(slope, Tag(), lane_slope);
    for (std::size_t lane = 0; lane < Lanes(); ++lane) {
      found[lane] = 1;
      if (is_hard[lane] == 0) continue;
      if (solve_gap(model_.kernel, lane_c[lane], lane_a[lane], lane_gap[lane]))
        pair_kernel(model_.kernel, lane_gap[lane], lane_value[lane], lane_slope[lane]);
      else
        found[lane] = 0;
    }
    gap = hn::Load(Tag(), lane_gap);
    value = hn::Load(Tag(), lane_value);
    slope = hn::Load(Tag(), lane_slope);
    Stop(v, step, hn::Gt(hn::Load(Tag(), found), hn::Zero(Tag())), LaneStatus::kNoRoot);
  }

  HWY_INLINE void StopBeyondBound(std::uint32_t step) {
    for (int v = 0; v < n; ++v) {
      const LaneMask within = hn::Le(largest_[v], Constant(model_.momentum_bound));
      if (!hn::AllFalse(Tag(), hn::AndNot(within, running_[v]))) Stop(v, step, within, LaneStatus::kBeyondBound);
    }
  }

  // The running lanes that are not to go on stop before this step.
  HWY_NOINLINE void Stop(int v, std::uint32_t step, LaneMask going_on, LaneStatus status) {
    HWY_ALIGN double stops[kPathBatch];
    hn::Store(hn::IfThenElseZero(hn::AndNot(going_on, running_[v]), Constant(1.0)), Tag(), stops);
    for (std::size_t lane = 0; lane < Lanes(); ++lane) {
      if (stops[lane] == 0) continue;
      const std::size_t place = first_lane_ + v * Lanes() + lane;
      batch_.status[place] = status;
      batch_.stopped[place] = step;
    }
    running_[v] = hn::And(going_on, running_[v]);
  }

  HWY_INLINE void Load() {
    for (int v = 0; v < n; ++v) {
      const std::size_t at = first_lane_ + v * Lanes();
      q1_[v] = hn::Load(Tag(), batch_.q1.data() + at);
      gap_[v] = hn::Load(Tag(), batch_.gap.data() + at);
      p1_[v] = hn::Load(Tag(), batch_.p1.data() + at);
      p2_[v] = hn::Load(Tag(), batch_.p2.data() + at);
      for (int i = 0; i < channels; ++i) before_[i][v] = hn::Load(Tag(), batch_.before[i].data() + at);
      largest_[v] = hn::Load(Tag(), batch_.largest_momentum.data() + at);
      smallest_side_[v] = hn::Load(Tag(), batch_.smallest_side.data() + at);
      value_[v] = hn::Load(Tag(), batch_.value.data() + at);
      HWY_ALIGN double runs[kPathBatch];
      for (std::size_t lane = 0; lane < Lanes(); ++lane)
        runs[lane] = batch_.status[at + lane] == LaneStatus::kRunning ? 1 : 0;
      running_[v] = hn::Gt(hn::Load(Tag(), runs), hn::Zero(Tag()));
    }
  }

  HWY_INLINE void Store() {
    for (int v = 0; v < n; ++v) {
      const std::size_t at = first_lane_ + v * Lanes();
      hn::Store(q1_[v], Tag(), batch_.q1.data() + at);
      hn::Store(gap_[v], Tag(), batch_.gap.data() + at);
      hn::Store(p1_[v], Tag(), batch_.p1.data() + at);
      hn::Store(p2_[v], Tag(), batch_.p2.data() + at);
      for (int i = 0; i < channels; ++i) hn::Store(before_[i][v], Tag(), batch_.before[i].data() + at);
      hn::Store(largest_[v], Tag(), batch_.largest_momentum.data() + at);
      hn::Store(smallest_side_[v], Tag(), batch_.smallest_side.data() + at);
      hn::Store(value_[v], Tag(), batch_.value.data() + at);
    }
  }

  static constexpr int kMostTurns = 12;

  const PairModel& model_;
  PairBatch& batch_;
  std::size_t first_lane_;
  Profile profile_;
  Noise noise_;
  NormalLanes normals_;
  Vector dt_, at_zero_, steepest_, reach_, side_;
  Vector q1_[n], gap_[n], p1_[n], p2_[n], before_[channels][n], largest_[n], smallest_side_[n];
  Vector value_[n];  // K at the gap, or nearly: where Newton begins
  Vector q1_moved_[n];
  LaneMask running_[n];
};

template <class Profile, class Noise>
void AdvanceWith(const PairModel& model, PairBatch& batch, std::uint32_t first, std::uint32_t last) {
  constexpr int kVectors = 2;
  for (std::size_t lane = 0; lane < kPathBatch; lane += kVectors * hn::Lanes(Tag()))
    PairStepper<Profile, Noise, kVectors>(model, batch, lane).Run(first, last);
}

template <class Profile>
void AdvanceProfile(const PairModel& model, PairBatch& batch, std::uint32_t first, std::uint32_t last) {
  if (model.noise == PairNoise::kPotential) return AdvanceWith<Profile, PotentialNoise>(model, batch, first, last);
  if (model.noise == PairNoise::kScreened) return AdvanceWith<Profile, ScreenedNoise>(model, batch, first, last);
  if (model.channels <= 1) return AdvanceWith<Profile, ConstantNoise<1>>(model, batch, first, last);
  if (model.channels == 2) return AdvanceWith<Profile, ConstantNoise<2>>(model, batch, first, last);
  AdvanceWith<Profile, ConstantNoise<kMostPairChannels>>(model, batch, first, last);
}

void AdvancePair(const PairModel& model, PairBatch& batch, std::uint32_t first, std::uint32_t last) {
  switch (model.kernel.profile) {
    case KernelProfile::kGaussian:
      return AdvanceProfile<GaussianProfile>(model, batch, first, last);
    case KernelProfile::kPeakon:
      return AdvanceProfile<PeakonProfile>(model, batch, first, last);
    case KernelProfile::kMatern32:
      return AdvanceProfile<Matern32Profile>(model, batch, first, last);
    case KernelProfile::kMatern52:
      return AdvanceProfile<Matern52Profile>(model, batch, first, last);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson::ensemble
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#if HWY_ONCE

namespace pulson::ensemble {

HWY_EXPORT(AdvancePair);

void advance_pair(const PairModel& model, PairBatch& batch, std::uint32_t first, std::uint32_t last) {
  HWY_DYNAMIC_DISPATCH(AdvancePair)(model, batch, first, last);
}

}  // namespace pulson::ensemble

#endif  // HWY_ONCE
