// The memory of a few paths of N landmarks in vector lanes. Included once per vector target,
// so its guard toggles with the target.
#if defined(PULSON_LANDMARK_LAYOUT_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_LANDMARK_LAYOUT_BODY
#undef PULSON_LANDMARK_LAYOUT_BODY
#else
#define PULSON_LANDMARK_LAYOUT_BODY
#endif

#include <cmath>
#include <limits>

#include <hwy/highway.h>

#include "landmark_lanes.hpp"
#include "landmark_sums_body.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson {
namespace HWY_NAMESPACE {

using LaneMask = hn::Mask<Tag>;
using FloatMask = hn::Mask<FloatTag>;
using HalfTag = hn::Rebind<float, Tag>;

// The largest of numbers, and NaN if one is not finite.
template <class D>
class Largest {
 public:
  using V = hn::Vec<D>;
  HWY_INLINE Largest() : size_(hn::Zero(D())), poison_(size_) {}
  HWY_INLINE void See(V x) {
    size_ = hn::Max(size_, hn::Abs(x));
    poison_ = hn::MulAdd(x, hn::Zero(D()), poison_);
  }
  HWY_INLINE V Get() const { return hn::Add(size_, poison_); }

 private:
  V size_, poison_;
};

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

}  // namespace HWY_NAMESPACE
}  // namespace pulson
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_LANDMARK_LAYOUT_BODY
