// Compiled once per vector target by foreach_target.h; the best one is chosen at run time.

#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "landmark_lanes.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
#include "landmark_group_body.hpp"
#include "landmark_lanes.hpp"
#include "landmark_sums_body.hpp"
// clang-format on

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::ensemble {
namespace HWY_NAMESPACE {

using namespace pulson::HWY_NAMESPACE;  // NOLINT(google-build-using-namespace): the same target's lanes

// Solves x = c + F(x), F = Δt K(x)p, in each lane, in the model's units, where Δt is part of K:
//
//   Guess     y = F(c + y) in single precision, until corrections are small;
//   Evaluate  the residual δ = c + F(x) − x at x = c + y, forces and jets of K in double precision; x ← c + F(x) until
//             δ is so small that δ² is round-off;
//   Correct   e = δ + F'δ + F'F'δ + …, the root x + e to second order in δ, and forces to second order. e is small, so
//             single precision does.
//
// A lane whose corrections do not halve is hard, and so are those that have turned a pair of landmarks too far.
template <int d, class Kernel>
class LaneStepper : public LaneState {
 public:
  LaneStepper(const LandmarkModel& model, LandmarkBatch& batch, std::size_t first_lane)
      : LaneState(model, batch, first_lane), kernel_(model.terms) {}

  HWY_INLINE void Solve() {
    Guess();
    Evaluate();
    Correct();
    if (!hn::AllFalse(FloatTag(), FlagMask(risky_))) CheckTurns();
  }

 private:
  HWY_NOINLINE void Guess() {
    const Floats at_zero = FloatConstant(model_.at_zero);
    for (std::size_t i = 0; i < coordinates_; ++i) {
      for (int v = 0; v < kVectors; ++v) {
        StoreHalf(hn::Sub(LoadWide(c_, v, i), LoadWide(c_, v, i % d)), rough_c_, v, i);
        StoreHalf(LoadWide(m_, v, i), rough_p_, v, i);
        StoreHalf(LoadWide(moved_, v, i), rough_y_, v, i);
      }
    }
    FloatMask open = hn::Not(FlagMask(idle_));
    Floats previous = FloatConstant(std::numeric_limits<float>::infinity());
    for (int turn = 0; turn < kMostGuesses && !hn::AllFalse(FloatTag(), open); ++turn) {
      for (std::size_t i = 0; i < coordinates_; ++i) {
        StoreNarrow(hn::Add(LoadNarrow(rough_c_, i), LoadNarrow(rough_y_, i)), rough_x_, i);
        StoreNarrow(hn::Mul(at_zero, LoadNarrow(rough_p_, i)), rough_u_, i);
      }
      RoughSum<d, Kernel> sum{kernel_, rough_x_, rough_p_, rough_u_};
      AddPairs(sum, model_.count);
      Largest<FloatTag> change, size;
      for (std::size_t i = 0; i < coordinates_; ++i) {
        const Floats u = LoadNarrow(rough_u_, i);
        const Floats y = LoadNarrow(rough_y_, i);
        change.See(hn::Sub(u, y));
        size.See(u);
        StoreNarrow(hn::IfThenElse(open, u, y), rough_y_, i);
      }
      const Floats correction = change.Get();
      const FloatMask stalls = hn::Not(hn::Lt(correction, hn::Mul(FloatConstant(0.5), previous)));
      const FloatMask beyond_rounding = hn::Gt(correction, hn::Mul(FloatConstant(1e-4), size.Get()));
      Flag(hn::And(open, hn::And(stalls, beyond_rounding)), hard_);
      open = hn::AndNot(hn::Or(stalls, hn::Le(correction, FloatConstant(kGuessed))), open);
      previous = correction;
    }
    for (std::size_t i = 0; i < coordinates_; ++i)
      for (int v = 0; v < kVectors; ++v) StoreWide(hn::Add(LoadWide(c_, v, i), LoadHalf(rough_y_, v, i)), x_, v, i);
  }

  HWY_NOINLINE void Evaluate() {
    LaneMask open[kVectors];
    Vector previous[kVectors];
    for (int v = 0; v < kVectors; ++v) {
      open[v] = hn::Not(hn::Or(HalfMask(idle_, v), HalfMask(hard_, v)));
      previous[v] = Constant(std::numeric_limits<double>::infinity());
    }
    bool any = true;
    for (int turn = 0; any; ++turn) {
      any = false;
      for (int v = 0; v < kVectors; ++v) {
        if (turn > 0 && hn::AllFalse(Tag(), open[v])) continue;
        const Vector near = AddExactly(v);
        Largest<Tag> change, size;
        for (std::size_t i = 0; i < coordinates_; ++i) {
          const Vector x = LoadWide(x_, v, i);
          const Vector next = hn::Add(LoadWide(c_, v, i), LoadWide(u_, v, i));
          change.See(hn::Sub(next, x));
          size.See(x);
          StoreHalf(hn::Mul(hn::Sub(next, x), Constant(kTiny)), rough_t_, v, i);
        }
        const Vector correction = change.Get();
        const Vector rounding = hn::Mul(size.Get(), Constant(0x1p-52));
        const Vector length =
            kernel_.Kinked() ? hn::Min(Constant(1.0), hn::Mul(Constant(0.2), hn::Sqrt(near))) : Constant(1.0);
        const LaneMask ends = hn::Le(correction, hn::Max(rounding, hn::Mul(length, Constant(kEvaluated))));
        const LaneMask stalls =
            turn == kMostTurns ? hn::Not(ends) : hn::Not(hn::Lt(correction, hn::Mul(Constant(0.5), previous[v])));
        FlagHalf(hn::And(open[v], hn::AndNot(ends, stalls)), hard_, v);
        StoreHalf(hn::Mul(rounding, Constant(0.5 * kTiny)), tolerance_, v, 0);
        open[v] = hn::AndNot(hn::Or(ends, stalls), open[v]);
        previous[v] = correction;
        if (hn::AllFalse(Tag(), open[v])) continue;
        any = true;
        for (std::size_t i = 0; i < coordinates_; ++i) {
          const Vector next = hn::Add(LoadWide(c_, v, i), LoadWide(u_, v, i));
          StoreWide(hn::IfThenElse(open[v], next, LoadWide(x_, v, i)), x_, v, i);
        }
      }
    }
  }

  // u and f at x. @return the smallest squared distance
  HWY_INLINE Vector AddExactly(int v) {
    for (std::size_t i = 0; i < coordinates_; ++i) {
      StoreWide(hn::Mul(Constant(model_.at_zero), LoadWide(m_, v, i)), u_, v, i);
      StoreWide(hn::Zero(Tag()), f_, v, i);
    }
    const std::size_t at = v * hn::Lanes(Tag());
    const std::size_t from = at * coordinates_;
    ExactSum<d, Kernel> sum{kernel_,
                            x_ + from,
                            m_ + from,
                            u_ + from,
                            f_ + from,
                            {jets_.first + at, jets_.second + at, jets_.stride},
                            Constant(std::numeric_limits<double>::infinity())};
    AddPairs(sum, model_.count);
    return sum.nearest;
  }

  HWY_NOINLINE void Correct() {
    for (std::size_t i = 0; i < coordinates_; ++i) {
      for (int v = 0; v < kVectors; ++v) StoreHalf(hn::Sub(LoadWide(x_, v, i), LoadWide(x_, v, i % d)), rough_x_, v, i);
      StoreNarrow(LoadNarrow(rough_t_, i), rough_e_, i);
    }
    const Floats tolerance = LoadNarrow(tolerance_, 0);
    FloatMask open = hn::Not(hn::Or(FlagMask(idle_), FlagMask(hard_)));
    Largest<FloatTag> start;
    for (std::size_t i = 0; i < coordinates_; ++i) start.See(LoadNarrow(rough_t_, i));
    Floats previous = start.Get();
    open = hn::And(open, hn::Gt(hn::Mul(FloatConstant(0.5), previous), tolerance));
    while (!hn::AllFalse(FloatTag(), open)) {
      for (std::size_t i = 0; i < coordinates_; ++i) StoreNarrow(hn::Zero(FloatTag()), rough_u_, i);
      TangentSum<d> sum{rough_x_, rough_p_, rough_t_, rough_u_, jets_};
      AddPairs(sum, model_.count);
      Largest<FloatTag> size;
      for (std::size_t i = 0; i < coordinates_; ++i) {
        const Floats t = hn::IfThenElseZero(open, LoadNarrow(rough_u_, i));
        size.See(t);
        StoreNarrow(t, rough_t_, i);
        StoreNarrow(hn::Add(LoadNarrow(rough_e_, i), t), rough_e_, i);
      }
      // The terms still to come are about the square of this one beside the one before.
      const Floats term = size.Get();
      const FloatMask ends = hn::Le(hn::Mul(term, term), hn::Mul(tolerance, previous));
      const FloatMask stalls = hn::Not(hn::Lt(term, hn::Mul(FloatConstant(0.5), previous)));
      Flag(hn::And(open, hn::AndNot(ends, stalls)), hard_);
      open = hn::AndNot(hn::Or(ends, stalls), open);
      previous = term;
    }
    for (std::size_t i = 0; i < coordinates_; ++i) StoreNarrow(hn::Zero(FloatTag()), rough_u_, i);
    ForceTangentSum<d, Kernel> sum{kernel_, rough_x_, rough_p_, rough_e_, rough_u_, jets_};
    AddPairs(sum, model_.count);
    for (std::size_t i = 0; i < coordinates_; ++i) {
      for (int v = 0; v < kVectors; ++v) {
        const Vector tiny = Constant(1 / kTiny);
        StoreWide(hn::MulAdd(LoadHalf(rough_e_, v, i), tiny, LoadWide(x_, v, i)), x_, v, i);
        StoreWide(hn::MulAdd(LoadHalf(rough_u_, v, i), tiny, LoadWide(f_, v, i)), f_, v, i);
      }
    }
  }

  // As the integrator: where there may be several roots, one that has turned two landmarks too far is not taken.
  HWY_NOINLINE void CheckTurns() {
    for (int v = 0; v < kVectors; ++v) {
      TurnSum<d> sum{c_ + WideAt(v, 0), x_ + WideAt(v, 0), hn::Zero(Tag())};
      AddPairs(sum, model_.count);
      FlagHalf(hn::And(HalfMask(risky_, v), hn::Lt(sum.lowest, hn::Zero(Tag()))), hard_, v);
    }
  }

  static constexpr int kMostGuesses = 12;
  static constexpr int kMostTurns = 30;
  static constexpr double kGuessed = 1e-6;    // where single precision stops: the next correction would be its rounding
  static constexpr double kEvaluated = 3e-8;  // its square is round-off
  static constexpr double kTiny = 0x1p60;     // corrections are kept so many times as large, clear of denormal numbers

  Kernel kernel_;
};

template <int d, class Kernel>
void AdvanceWith(const LandmarkModel& model, LandmarkBatch& batch, std::uint32_t first, std::uint32_t last) {
  for (std::size_t lane = 0; lane < kPathBatch; lane += hn::Lanes(FloatTag())) {
    LaneStepper<d, Kernel> solver(model, batch, lane);
    if (solver.IsIdle()) continue;
    for (std::uint32_t step = first; step < last; ++step) {
      if (step == first || step % 4 == 0) solver.DrawBlock(step / 4);
      solver.Begin(step);
      solver.Solve();
      solver.End(step);
    }
    solver.Save();
  }
}

template <class Kernel>
void AdvanceKernel(const LandmarkModel& model, LandmarkBatch& batch, std::uint32_t first, std::uint32_t last) {
  if (model.dimension == 1) return AdvanceWith<1, Kernel>(model, batch, first, last);
  if (model.dimension == 2) return AdvanceWith<2, Kernel>(model, batch, first, last);
  AdvanceWith<3, Kernel>(model, batch, first, last);
}

void AdvanceLandmarks(const LandmarkModel& model, LandmarkBatch& batch, std::uint32_t first, std::uint32_t last) {
  if (model.terms.size() > 1) return AdvanceKernel<ManyTerms>(model, batch, first, last);
  switch (model.terms.front().profile) {
    case KernelProfile::kGaussian:
      return AdvanceKernel<OneTerm<GaussianProfile>>(model, batch, first, last);
    case KernelProfile::kPeakon:
      return AdvanceKernel<OneTerm<PeakonProfile>>(model, batch, first, last);
    case KernelProfile::kMatern32:
      return AdvanceKernel<OneTerm<Matern32Profile>>(model, batch, first, last);
    case KernelProfile::kMatern52:
      return AdvanceKernel<OneTerm<Matern52Profile>>(model, batch, first, last);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson::ensemble
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#if HWY_ONCE

namespace pulson::ensemble {

HWY_EXPORT(AdvanceLandmarks);

void advance_landmarks(const LandmarkModel& model, LandmarkBatch& batch, std::uint32_t first, std::uint32_t last) {
  HWY_DYNAMIC_DISPATCH(AdvanceLandmarks)(model, batch, first, last);
}

}  // namespace pulson::ensemble

#endif  // HWY_ONCE
