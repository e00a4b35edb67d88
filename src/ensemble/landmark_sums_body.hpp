// Sums over pairs of landmarks, one path in each lane: kernels in double precision, and in single for guesses that are
// made exact afterwards. Included once per vector target, so its guard toggles with the target.
#if defined(PULSON_LANDMARK_SUMS_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_LANDMARK_SUMS_BODY
#undef PULSON_LANDMARK_SUMS_BODY
#else
#define PULSON_LANDMARK_SUMS_BODY
#endif

#include <cmath>
#include <cstddef>
#include <type_traits>
#include <vector>

#include <hwy/highway.h>

#include "profiles_body.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::ensemble {
namespace HWY_NAMESPACE {

using namespace pulson::HWY_NAMESPACE;  // NOLINT(google-build-using-namespace): the same target's lanes

using FloatTag = hn::ScalableTag<float>;
using Floats = hn::Vec<FloatTag>;
using LaneMask = hn::Mask<Tag>;
using FloatMask = hn::Mask<FloatTag>;

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

// A kernel of one term: the fast path.
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

// d coordinates of one landmark.
template <int d, class D>
struct Coordinates {
  using V = hn::Vec<D>;
  using T = hn::TFromD<D>;

  HWY_INLINE void Load(const T* from, std::size_t landmark) {
    for (int c = 0; c < d; ++c) at[c] = hn::Load(D(), from + (landmark * d + c) * hn::Lanes(D()));
  }
  HWY_INLINE void Store(T* to, std::size_t landmark) const {
    for (int c = 0; c < d; ++c) hn::Store(at[c], D(), to + (landmark * d + c) * hn::Lanes(D()));
  }
  HWY_INLINE Coordinates Minus(const Coordinates& other) const {
    Coordinates difference;
    for (int c = 0; c < d; ++c) difference.at[c] = hn::Sub(at[c], other.at[c]);
    return difference;
  }
  HWY_INLINE V Dot(const Coordinates& other) const {
    V sum = hn::Mul(at[0], other.at[0]);
    for (int c = 1; c < d; ++c) sum = hn::MulAdd(at[c], other.at[c], sum);
    return sum;
  }
  HWY_INLINE void Add(V factor, const Coordinates& other) {
    for (int c = 0; c < d; ++c) at[c] = hn::MulAdd(factor, other.at[c], at[c]);
  }
  HWY_INLINE void Subtract(V factor, const Coordinates& other) {
    for (int c = 0; c < d; ++c) at[c] = hn::NegMulAdd(factor, other.at[c], at[c]);
  }

  V at[d];
};

// Where the sums keep the first and second factors of the derivatives of K, for each pair in the order of AddPairs.
struct KeptJets {
  float* first;
  float* second;
  std::size_t stride;
};

// u_a += Σ K(x_a − x_b) p_b and f_a −= Σ (p_a·p_b) ∇K(x_a − x_b), and the smallest |x_a − x_b|².
template <int d, class Kernel>
struct ExactSum {
  struct Landmark {
    Coordinates<d, Tag> x, p, u, f;
  };
  HWY_INLINE void Load(std::size_t a, Landmark& l) const {
    l.x.Load(x, a);
    l.p.Load(p, a);
    l.u.Load(u, a);
    l.f.Load(f, a);
  }
  HWY_INLINE void Store(std::size_t a, const Landmark& l) const {
    l.u.Store(u, a);
    l.f.Store(f, a);
  }
  HWY_INLINE void Add(Landmark& a, Landmark& b) {
    const Coordinates<d, Tag> z = a.x.Minus(b.x);
    const Vector s = z.Dot(z);
    const Jet jet = kernel.Second(s);
    if (kernel.Kinked()) nearest = hn::Min(nearest, s);
    a.u.Add(jet.value, b.p);
    b.u.Add(jet.value, a.p);
    const Vector slope = hn::Mul(jet.first, a.p.Dot(b.p));
    a.f.Subtract(slope, z);
    b.f.Add(slope, z);
    const hn::Rebind<float, Tag> half;
    hn::Store(hn::DemoteTo(half, jet.first), half, jets.first);
    jets.first += jets.stride;
    if constexpr (!Kernel::kProportional) {
      hn::Store(hn::DemoteTo(half, jet.second), half, jets.second);
      jets.second += jets.stride;
    }
  }
  const Kernel& kernel;
  const double *x, *p;
  double *u, *f;
  KeptJets jets;
  Vector nearest;
};

// u_a += Σ K(x_a − x_b) p_b in single precision.
template <int d, class Kernel>
struct RoughSum {
  struct Landmark {
    Coordinates<d, FloatTag> x, p, u;
  };
  HWY_INLINE void Load(std::size_t a, Landmark& l) const {
    l.x.Load(x, a);
    l.p.Load(p, a);
    l.u.Load(u, a);
  }
  HWY_INLINE void Store(std::size_t a, const Landmark& l) const { l.u.Store(u, a); }
  HWY_INLINE void Add(Landmark& a, Landmark& b) {
    const Coordinates<d, FloatTag> z = a.x.Minus(b.x);
    const Floats k = kernel.Roughly(z.Dot(z));
    a.u.Add(k, b.p);
    b.u.Add(k, a.p);
  }
  const Kernel& kernel;
  const float *x, *p;
  float* u;
};

// u_a += Σ p_b ∇K·(t_a − t_b): the change of velocities along a change t of positions.
template <int d>
struct TangentSum {
  struct Landmark {
    Coordinates<d, FloatTag> x, p, t, u;
  };
  HWY_INLINE void Load(std::size_t a, Landmark& l) const {
    l.x.Load(x, a);
    l.p.Load(p, a);
    l.t.Load(t, a);
    l.u.Load(u, a);
  }
  HWY_INLINE void Store(std::size_t a, const Landmark& l) const { l.u.Store(u, a); }
  HWY_INLINE void Add(Landmark& a, Landmark& b) {
    const Floats along = a.x.Minus(b.x).Dot(a.t.Minus(b.t));
    const Floats slope = hn::Mul(hn::Load(FloatTag(), jets.first), along);
    a.u.Add(slope, b.p);
    b.u.Add(slope, a.p);
    jets.first += jets.stride;
  }
  const float *x, *p, *t;
  float* u;
  KeptJets jets;
};

// f_a −= Σ (p_a·p_b) ∇²K (t_a − t_b): the change of forces.
template <int d, class Kernel>
struct ForceTangentSum {
  using Landmark = typename TangentSum<d>::Landmark;
  HWY_INLINE void Load(std::size_t a, Landmark& l) const {
    l.x.Load(x, a);
    l.p.Load(p, a);
    l.t.Load(t, a);
    l.u.Load(f, a);
  }
  HWY_INLINE void Store(std::size_t a, const Landmark& l) const { l.u.Store(f, a); }
  HWY_INLINE void Add(Landmark& a, Landmark& b) {
    const Coordinates<d, FloatTag> z = a.x.Minus(b.x);
    const Coordinates<d, FloatTag> w = a.t.Minus(b.t);
    const Floats weight = a.p.Dot(b.p);
    const Floats along_w = hn::Mul(weight, hn::Load(FloatTag(), jets.first));
    jets.first += jets.stride;
    const Floats along_z = hn::Mul(Second(weight, along_w), z.Dot(w));
    a.u.Subtract(along_w, w);
    a.u.Subtract(along_z, z);
    b.u.Add(along_w, w);
    b.u.Add(along_z, z);
  }
  // (p_a·p_b) times the second factor of ∇²K.
  HWY_INLINE Floats Second(Floats weight, Floats along_w) {
    if constexpr (Kernel::kProportional) return hn::Mul(kernel.Ratio(), along_w);
    const Floats second = hn::Load(FloatTag(), jets.second);
    jets.second += jets.stride;
    return hn::Mul(weight, second);
  }
  const Kernel& kernel;
  const float *x, *p, *t;
  float* f;
  KeptJets jets;
};

// The smallest (c_a − c_b)·(x_a − x_b): negative where two have turned about each other by more than a right angle.
template <int d>
struct TurnSum {
  struct Landmark {
    Coordinates<d, Tag> c, x;
  };
  HWY_INLINE void Load(std::size_t a, Landmark& l) const {
    l.c.Load(c, a);
    l.x.Load(x, a);
  }
  HWY_INLINE void Store(std::size_t, const Landmark&) const {}
  HWY_INLINE void Add(const Landmark& a, const Landmark& b) {
    lowest = hn::Min(lowest, a.c.Minus(b.c).Dot(a.x.Minus(b.x)));
  }
  const double *c, *x;
  Vector lowest;
};

template <int rows, class Sum>
HWY_INLINE void AddRows(Sum& sum, std::size_t a, std::size_t b, std::size_t end) {
  typename Sum::Landmark row[rows];
  for (int r = 0; r < rows; ++r) sum.Load(a + r, row[r]);
  for (; b < end; ++b) {
    typename Sum::Landmark other;
    sum.Load(b, other);
    for (int r = 0; r < rows; ++r) sum.Add(row[r], other);
    sum.Store(b, other);
  }
  for (int r = 0; r < rows; ++r) sum.Store(a + r, row[r]);
}

// Each pair a < b once. Two rows at a time load and store each b once, and hide the latencies of one another.
template <class Sum>
HWY_INLINE void AddPairs(Sum& sum, std::size_t count) {
  for (std::size_t a = 0; a + 1 < count; a += 2) {
    AddRows<1>(sum, a, a + 1, a + 2);
    AddRows<2>(sum, a, a + 2, count);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson::ensemble
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_LANDMARK_SUMS_BODY
