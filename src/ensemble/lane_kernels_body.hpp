// Kernels in double precision, and in single for guesses that are made exact afterwards. Included once per vector
// target, so its guard toggles with the target.
#if defined(PULSON_LANE_KERNELS_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_LANE_KERNELS_BODY
#undef PULSON_LANE_KERNELS_BODY
#else
#define PULSON_LANE_KERNELS_BODY
#endif

#include <cmath>
#include <type_traits>
#include <vector>

#include <hwy/highway.h>

#include "profiles_body.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson {
namespace HWY_NAMESPACE {

using FloatTag = hn::ScalableTag<float>;
using Floats = hn::Vec<FloatTag>;

HWY_INLINE Floats FloatConstant(double value) { return hn::Set(FloatTag(), static_cast<float>(value)); }

// The exponentials of numbers below −80 count as exp(−80).
HWY_INLINE Floats RoughClamp(Floats x) { return hn::Max(x, FloatConstant(-80)); }

// e^x for −80 ≤ x ≤ 0: as ReducedExp, with e^r = 1 + rQ(r), Q of degree 4 interpolated at Chebyshev nodes (relative
// error 2e-7).
HWY_INLINE Floats RoughExp(Floats x) {
  const Floats magic = FloatConstant(0x1.8p23);
  const Floats shifted = hn::MulAdd(x, FloatConstant(0x1.715476p0), magic);
  const Floats r = hn::NegMulAdd(hn::Sub(shifted, magic), FloatConstant(0x1.62e430p-1), x);
  Floats q = FloatConstant(0x1.120b62p-7);
  q = hn::MulAdd(q, r, FloatConstant(0x1.570b98p-5));
  q = hn::MulAdd(q, r, FloatConstant(0x1.5554dep-3));
  q = hn::MulAdd(q, r, FloatConstant(0x1.fffe5ap-2));
  q = hn::MulAdd(q, r, FloatConstant(1));
  const Floats e = hn::MulAdd(q, r, FloatConstant(1));
  const hn::RebindToSigned<FloatTag> bits;
  return hn::BitCast(FloatTag(), hn::Add(hn::BitCast(bits, e), hn::ShiftLeft<23>(hn::BitCast(bits, shifted))));
}

// The profile of a Profile of profiles_body.hpp.
template <class Profile>
struct Rough;

template <>
struct Rough<GaussianProfile> {
  explicit Rough(const KernelTerm& term)
      : weight(FloatConstant(term.weight)), c(FloatConstant(-1 / (term.alpha * term.alpha))) {}
  HWY_INLINE Floats Value(Floats s) const { return hn::Mul(weight, RoughExp(RoughClamp(hn::Mul(c, s)))); }
  Floats weight, c;
};

template <>
struct Rough<PeakonProfile> {
  explicit Rough(const KernelTerm& term) : weight(FloatConstant(term.weight)), c(FloatConstant(-1 / term.alpha)) {}
  HWY_INLINE Floats Value(Floats s) const { return hn::Mul(weight, RoughExp(RoughClamp(hn::Mul(c, hn::Sqrt(s))))); }
  Floats weight, c;
};

template <>
struct Rough<Matern32Profile> {
  explicit Rough(const KernelTerm& term)
      : weight(FloatConstant(term.weight)), c(FloatConstant(-std::sqrt(3.0) / term.alpha)) {}
  HWY_INLINE Floats Value(Floats s) const {
    const Floats t = RoughClamp(hn::Mul(c, hn::Sqrt(s)));
    const Floats e = hn::Mul(weight, RoughExp(t));
    return hn::NegMulAdd(t, e, e);
  }
  Floats weight, c;
};

template <>
struct Rough<Matern52Profile> {
  explicit Rough(const KernelTerm& term)
      : weight(FloatConstant(term.weight)), c(FloatConstant(-std::sqrt(5.0) / term.alpha)) {}
  HWY_INLINE Floats Value(Floats s) const {
    const Floats t = RoughClamp(hn::Mul(c, hn::Sqrt(s)));
    const Floats polynomial =
        hn::NegMulAdd(hn::NegMulAdd(t, FloatConstant(1.0 / 3), FloatConstant(1)), t, FloatConstant(1));
    return hn::Mul(hn::Mul(weight, polynomial), RoughExp(t));
  }
  Floats weight, c;
};

// A kernel of one term: the fast way.
template <class Profile>
class OneTerm {
 public:
  static constexpr bool kProportional = std::is_same_v<Profile, GaussianProfile>;  // second = ratio·first
  explicit OneTerm(const std::vector<KernelTerm>& terms)
      : exact_(terms.front()), rough_(terms.front()), ratio_(-2 / (terms.front().alpha * terms.front().alpha)) {}
  // K' jumps at 0.
  static HWY_INLINE bool Kinked() { return std::is_same_v<Profile, PeakonProfile>; }
  HWY_INLINE Jet Second(Vector s) const { return exact_.Second(s); }
  HWY_INLINE Floats Roughly(Floats s) const { return rough_.Value(s); }
  HWY_INLINE Floats Ratio() const { return FloatConstant(ratio_); }

 private:
  Profile exact_;
  Rough<Profile> rough_;
  double ratio_;
};

// A kernel of any terms. Its profiles are called, as to inline them everywhere takes a compiler long.
class ManyTerms {
 public:
  static constexpr bool kProportional = false;
  explicit ManyTerms(const std::vector<KernelTerm>& terms) : begin_(terms.data()), end_(begin_ + terms.size()) {
    for (const KernelTerm& term : terms) kinked_ = kinked_ || term.profile == KernelProfile::kPeakon;
  }
  HWY_INLINE bool Kinked() const { return kinked_; }
  static HWY_INLINE Floats Ratio() { return hn::Zero(FloatTag()); }  // without meaning
  HWY_INLINE Jet Second(Vector s) const {
    Jet sum{hn::Zero(Tag()), hn::Zero(Tag()), hn::Zero(Tag())};
    for (const KernelTerm* term = begin_; term != end_; ++term) {
      const Jet jet = TermSecond(*term, s);
      sum = {hn::Add(sum.value, jet.value), hn::Add(sum.first, jet.first), hn::Add(sum.second, jet.second)};
    }
    return sum;
  }
  HWY_INLINE Floats Roughly(Floats s) const {
    Floats sum = hn::Zero(FloatTag());
    for (const KernelTerm* term = begin_; term != end_; ++term) sum = hn::Add(sum, TermRoughly(*term, s));
    return sum;
  }

 private:
  static HWY_NOINLINE Jet TermSecond(const KernelTerm& term, Vector s) {
    switch (term.profile) {
      case KernelProfile::kGaussian:
        return GaussianProfile(term).Second(s);
      case KernelProfile::kPeakon:
        return PeakonProfile(term).Second(s);
      case KernelProfile::kMatern32:
        return Matern32Profile(term).Second(s);
      case KernelProfile::kMatern52:
        return Matern52Profile(term).Second(s);
    }
    __builtin_unreachable();
  }
  static HWY_NOINLINE Floats TermRoughly(const KernelTerm& term, Floats s) {
    switch (term.profile) {
      case KernelProfile::kGaussian:
        return Rough<GaussianProfile>(term).Value(s);
      case KernelProfile::kPeakon:
        return Rough<PeakonProfile>(term).Value(s);
      case KernelProfile::kMatern32:
        return Rough<Matern32Profile>(term).Value(s);
      case KernelProfile::kMatern52:
        return Rough<Matern52Profile>(term).Value(s);
    }
    __builtin_unreachable();
  }

  const KernelTerm* begin_;
  const KernelTerm* end_;
  bool kinked_ = false;
};

}  // namespace HWY_NAMESPACE
}  // namespace pulson
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_LANE_KERNELS_BODY
