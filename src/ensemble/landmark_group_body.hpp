// A few paths of N landmarks in vector lanes: their memory, noise, units and hard steps. Included once per vector
// target, so its guard toggles with the target.
#if defined(PULSON_LANDMARK_GROUP_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_LANDMARK_GROUP_BODY
#undef PULSON_LANDMARK_GROUP_BODY
#else
#define PULSON_LANDMARK_GROUP_BODY
#endif

#include <cmath>
#include <limits>

#include <hwy/highway.h>

#include "landmark_lanes.hpp"
#include "landmark_sums_body.hpp"
#include "normal_lanes_body.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::ensemble {
namespace HWY_NAMESPACE {

using namespace pulson::HWY_NAMESPACE;  // NOLINT(google-build-using-namespace): the same target's lanes

using HalfTag = hn::Rebind<float, Tag>;

// As many paths as a vector has floats, in kVectors vectors of doubles. Arrays of doubles hold all coordinates of the
// first vector, then those of the next, so that sums stream through them; arrays of floats hold the lanes of the first
// coordinate, then those of the next. Both are in the units of the model.
class LaneStorage {
 protected:
  LaneStorage(const LandmarkModel& model, LandmarkBatch& batch)
      : model_(model), coordinates_(model.dimension * model.count) {
    const std::size_t array = coordinates_ * Lanes();
    const std::size_t channels = model_.channels * Lanes();
    double* wide = batch.wide.reserve(8 * array + 5 * channels);
    for (double** pointer : {&q_, &p_, &c_, &m_, &x_, &u_, &f_, &moved_}) {
      *pointer = wide;
      wide += array;
    }
    normals_ = wide;
    sums_ = wide + 4 * channels;
    const std::size_t jets = model_.count * (model_.count - 1) / 2 * Lanes();
    float* narrow = batch.narrow.reserve(7 * array + 2 * jets);
    for (float** pointer : {&rough_c_, &rough_x_, &rough_p_, &rough_u_, &rough_y_, &rough_t_, &rough_e_}) {
      *pointer = narrow;
      narrow += array;
    }
    jets_ = {narrow, narrow + jets, Lanes()};
  }

  static constexpr int kVectors = static_cast<int>(hn::MaxLanes(FloatTag()) / hn::MaxLanes(Tag()));

  static HWY_INLINE std::size_t Lanes() { return hn::Lanes(FloatTag()); }

  HWY_INLINE std::size_t WideAt(int v, std::size_t i) const { return (v * coordinates_ + i) * hn::Lanes(Tag()); }
  HWY_INLINE Vector LoadWide(const double* from, int v, std::size_t i) const {
    return hn::Load(Tag(), from + WideAt(v, i));
  }
  HWY_INLINE void StoreWide(Vector x, double* to, int v, std::size_t i) const {
    hn::Store(x, Tag(), to + WideAt(v, i));
  }
  static HWY_INLINE Floats LoadNarrow(const float* from, std::size_t i) {
    return hn::Load(FloatTag(), from + i * Lanes());
  }
  static HWY_INLINE void StoreNarrow(Floats x, float* to, std::size_t i) { hn::Store(x, FloatTag(), to + i * Lanes()); }
  // The lanes of vector v among floats.
  static HWY_INLINE Vector LoadHalf(const float* from, int v, std::size_t i) {
    return hn::PromoteTo(Tag(), hn::Load(HalfTag(), from + i * Lanes() + v * hn::Lanes(Tag())));
  }
  static HWY_INLINE void StoreHalf(Vector x, float* to, int v, std::size_t i) {
    hn::Store(hn::DemoteTo(HalfTag(), x), HalfTag(), to + i * Lanes() + v * hn::Lanes(Tag()));
  }

  // Flags are 1 or 0 in each lane.
  static HWY_INLINE FloatMask FlagMask(const float* flags) {
    return hn::Gt(hn::Load(FloatTag(), flags), hn::Zero(FloatTag()));
  }
  static HWY_INLINE LaneMask HalfMask(const float* flags, int v) {
    return hn::Gt(LoadHalf(flags, v, 0), hn::Zero(Tag()));
  }
  static HWY_INLINE void Flag(FloatMask mask, float* flags) {
    StoreNarrow(hn::IfThenElse(mask, FloatConstant(1), LoadNarrow(flags, 0)), flags, 0);
  }
  static HWY_INLINE void FlagHalf(LaneMask mask, float* flags, int v) {
    StoreHalf(hn::IfThenElse(mask, Constant(1), LoadHalf(flags, v, 0)), flags, v, 0);
  }

  const LandmarkModel& model_;
  std::size_t coordinates_;
  double *q_, *p_, *c_, *m_, *x_, *u_, *f_, *moved_;
  double *normals_, *sums_;
  float *rough_c_, *rough_x_, *rough_p_, *rough_u_, *rough_y_, *rough_t_, *rough_e_;
  KeptJets jets_;
  HWY_ALIGN float idle_[kPathBatch];   // no longer running
  HWY_ALIGN float hard_[kPathBatch];   // left to the integrator in this step
  HWY_ALIGN float risky_[kPathBatch];  // there may be several roots
  HWY_ALIGN float tolerance_[kPathBatch];
};

// The state, from the batch and back to it, its noise and its hard steps.
class LaneState : public LaneStorage {
 public:
  LaneState(const LandmarkModel& model, LandmarkBatch& batch, std::size_t first_lane)
      : LaneStorage(model, batch), batch_(batch), first_lane_(first_lane), normal_lanes_(model.seed) {
    for (std::size_t i = 0; i < coordinates_; ++i) {
      for (int v = 0; v < kVectors; ++v) {
        const std::size_t at = InBatch(i, v);
        StoreWide(hn::Mul(hn::LoadU(Tag(), &batch.q[at]), Constant(1 / model.length_unit)), q_, v, i);
        StoreWide(hn::Mul(hn::LoadU(Tag(), &batch.p[at]), Constant(1 / model.momentum_unit)), p_, v, i);
        StoreWide(hn::LoadU(Tag(), &batch.moved[at]), moved_, v, i);
      }
    }
    for (std::size_t lane = 0; lane < Lanes(); ++lane)
      idle_[lane] = batch.status[first_lane + lane] == LaneStatus::kRunning ? 0 : 1;
  }

  // Whether none of the paths runs.
  HWY_INLINE bool IsIdle() const {
    for (std::size_t lane = 0; lane < Lanes(); ++lane)
      if (idle_[lane] == 0) return false;
    return true;
  }

  // Back to the batch.
  HWY_NOINLINE void Save() {
    for (std::size_t i = 0; i < coordinates_; ++i) {
      for (int v = 0; v < kVectors; ++v) {
        const std::size_t at = InBatch(i, v);
        hn::StoreU(hn::Mul(LoadWide(q_, v, i), Constant(model_.length_unit)), Tag(), &batch_.q[at]);
        hn::StoreU(hn::Mul(LoadWide(p_, v, i), Constant(model_.momentum_unit)), Tag(), &batch_.p[at]);
        hn::StoreU(LoadWide(moved_, v, i), Tag(), &batch_.moved[at]);
      }
    }
  }

  // The normals of steps 4·block … 4·block + 3.
  HWY_NOINLINE void DrawBlock(std::uint32_t block) {
    for (std::size_t channel = 0; channel < model_.channels; ++channel) {
      NormalLanes::Counter counters[kVectors];
      NormalLanes::Words signs[kVectors];
      Vector normals[kVectors][4];
      for (int v = 0; v < kVectors; ++v) {
        const auto path = hn::Iota(NormalLanes::WordTag(), batch_.first_path + first_lane_ + v * hn::Lanes(Tag()));
        signs[v] = model_.antithetic ? hn::ShiftLeft<63>(path) : NormalLanes::Word(0);
        counters[v] = {model_.antithetic ? hn::ShiftRight<1>(path) : path, NormalLanes::Word(block),
                       NormalLanes::Word(channel)};
      }
      normal_lanes_.Draw(counters, normals);
      for (int v = 0; v < kVectors; ++v) {
        for (std::size_t s = 0; s < 4; ++s) {
          const auto bits = hn::Xor(hn::BitCast(NormalLanes::WordTag(), normals[v][s]), signs[v]);
          hn::Store(hn::BitCast(Tag(), bits), Tag(), normals_ + (channel * 4 + s) * Lanes() + v * hn::Lanes(Tag()));
        }
      }
    }
  }

  // The state moved by the noise of a step, (c, m), and where the iteration begins.
  HWY_NOINLINE void Begin(std::uint32_t step) {
    const double half_root_dt = 0.5 * std::sqrt(model_.dt);
    for (int v = 0; v < kVectors; ++v) {
      for (std::size_t channel = 0; channel < model_.channels; ++channel) {
        const std::size_t lane = v * hn::Lanes(Tag());
        double* before = &batch_.before[channel * kPathBatch + first_lane_ + lane];
        const Vector now = hn::Load(Tag(), normals_ + (channel * 4 + step % 4) * Lanes() + lane);
        hn::Store(hn::Add(hn::LoadU(Tag(), before), now), Tag(), sums_ + channel * Lanes() + lane);
        hn::StoreU(now, Tag(), before);
      }
      for (std::size_t i = 0; i < coordinates_; ++i) {
        StoreWide(LoadWide(q_, v, i), c_, v, i);
        StoreWide(LoadWide(p_, v, i), m_, v, i);
      }
      AddLoads(model_.position, half_root_dt / model_.length_unit, c_, v);
      AddLoads(model_.momentum, -half_root_dt / model_.momentum_unit, m_, v);
      FlagRisky(v);
    }
    hn::Store(hn::Zero(FloatTag()), FloatTag(), hard_);
  }

  // Takes over (x, m + f) in the lanes that run, after hard steps.
  HWY_NOINLINE void End(std::uint32_t step) {
    for (int v = 0; v < kVectors; ++v) {
      Largest<Tag> size;
      for (std::size_t i = 0; i < coordinates_; ++i) {
        const Vector p = hn::Add(LoadWide(m_, v, i), LoadWide(f_, v, i));
        size.See(p);
        StoreWide(p, f_, v, i);
      }
      const LaneMask finite = hn::Lt(size.Get(), Constant(std::numeric_limits<double>::infinity()));
      FlagHalf(hn::Not(finite), hard_, v);
    }
    for (std::size_t lane = 0; lane < Lanes(); ++lane)
      if (hard_[lane] != 0 && idle_[lane] == 0) SolveHard(lane, step);
    for (int v = 0; v < kVectors; ++v) Accept(v);
  }

 private:
  HWY_INLINE std::size_t InBatch(std::size_t i, int v) const {
    return i * kPathBatch + first_lane_ + v * hn::Lanes(Tag());
  }

  HWY_INLINE void AddLoads(const std::vector<NoiseLoad>& loads, double factor, double* to, int v) const {
    for (const NoiseLoad& load : loads) {
      const Vector sum = hn::Load(Tag(), sums_ + load.channel * Lanes() + v * hn::Lanes(Tag()));
      const Vector moved = hn::MulAdd(Constant(factor * load.value), sum, LoadWide(to, v, load.coordinate));
      StoreWide(moved, to, v, load.coordinate);
    }
  }

  // κ ≤ 2 Lip(Δt K) Σ|p_a|; where that is not below 1, iterations begin at c, as the integrator's does.
  HWY_INLINE void FlagRisky(int v) {
    Vector total = hn::Zero(Tag());
    for (std::size_t i = 0; i < coordinates_; ++i) total = hn::Add(total, hn::Abs(LoadWide(m_, v, i)));
    const LaneMask safe = hn::Lt(hn::Mul(total, Constant(2 * model_.lipschitz)), Constant(1));
    StoreHalf(hn::IfThenZeroElse(safe, Constant(1)), risky_, v, 0);
    for (std::size_t i = 0; i < coordinates_; ++i)
      StoreWide(hn::IfThenElseZero(safe, LoadWide(moved_, v, i)), moved_, v, i);
  }

  HWY_NOINLINE void SolveHard(std::size_t lane, std::uint32_t step) {
    const std::size_t vector = lane / hn::Lanes(Tag());
    const std::size_t at = vector * coordinates_ * hn::Lanes(Tag()) + lane % hn::Lanes(Tag());
    if (!solve_landmarks(model_, {c_ + at, m_ + at, x_ + at, f_ + at, hn::Lanes(Tag())})) {
      idle_[lane] = 1;
      batch_.status[first_lane_ + lane] = LaneStatus::kNoRoot;
      batch_.stopped[first_lane_ + lane] = step;
    }
  }

  HWY_INLINE void Accept(int v) {
    const LaneMask runs = hn::Not(HalfMask(idle_, v));
    for (std::size_t i = 0; i < coordinates_; ++i) {
      const Vector x = LoadWide(x_, v, i);
      StoreWide(hn::IfThenElse(runs, x, LoadWide(q_, v, i)), q_, v, i);
      StoreWide(hn::IfThenElse(runs, LoadWide(f_, v, i), LoadWide(p_, v, i)), p_, v, i);
      StoreWide(hn::Sub(x, LoadWide(c_, v, i)), moved_, v, i);
    }
    double* largest = &batch_.largest_momentum[first_lane_ + v * hn::Lanes(Tag())];
    hn::StoreU(hn::Max(hn::LoadU(Tag(), largest), LargestMomentum(v)), Tag(), largest);
    double* side = &batch_.smallest_side[first_lane_ + v * hn::Lanes(Tag())];
    Vector smallest = hn::LoadU(Tag(), side);
    for (std::size_t i = 1; i < batch_.order.size(); ++i) {
      const Vector gap = hn::Sub(LoadWide(q_, v, batch_.order[i]), LoadWide(q_, v, batch_.order[i - 1]));
      smallest = hn::Min(smallest, hn::Mul(gap, Constant(model_.length_unit)));
    }
    hn::StoreU(smallest, Tag(), side);
  }

  HWY_INLINE Vector LargestMomentum(int v) const {
    Vector largest = hn::Zero(Tag());
    for (std::size_t a = 0; a < model_.count; ++a) {
      Vector square = hn::Zero(Tag());
      for (std::size_t c = 0; c < model_.dimension; ++c) {
        const Vector p = LoadWide(p_, v, a * model_.dimension + c);
        square = hn::MulAdd(p, p, square);
      }
      largest = hn::Max(largest, square);
    }
    return hn::Mul(hn::Sqrt(largest), Constant(model_.momentum_unit));
  }

  LandmarkBatch& batch_;
  std::size_t first_lane_;
  NormalLanes normal_lanes_;
};

}  // namespace HWY_NAMESPACE
}  // namespace pulson::ensemble
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_LANDMARK_GROUP_BODY
