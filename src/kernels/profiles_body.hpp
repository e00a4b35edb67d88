// The kernel profiles as vector code. Included once per vector target, so its guard toggles with the target.
#if defined(PULSON_PROFILES_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_PROFILES_BODY
#undef PULSON_PROFILES_BODY
#else
#define PULSON_PROFILES_BODY
#endif

#include <cmath>

#include <hwy/highway.h>

#include "pulson/kernels/kernel_operator.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::ScalableTag<double>;
using Vector = hn::Vec<Tag>;

HWY_INLINE Vector Constant(double value) { return hn::Set(Tag(), value); }

// The exponentials of numbers below −708 count as exp(−708), 3e-308.
HWY_INLINE Vector ClampExponent(Vector x) { return hn::Max(x, Constant(-708.0)); }

// e^x = 2ⁿ (1 + tail) for −708 ≤ x ≤ 0.
// x = n ln2 + r with |r| ≤ ½ ln2, e^r = 1 + r + r²Q(r), Q of degree 9 interpolated at Chebyshev nodes (relative error
// 1.6e-17). Adding 1.5·2⁵² rounds x/ln2 to the integer n and leaves n in the low bits, whence 2ⁿ.
struct ReducedExp {
  HWY_INLINE explicit ReducedExp(Vector x) {
    shifted = hn::MulAdd(x, Constant(0x1.71547652b82fep0), Constant(kMagic));
    const Vector n = hn::Sub(shifted, Constant(kMagic));
    const Vector ln2_low = Constant(0x1.cf79abc9e3b3ap-40);
    const Vector r_high = hn::NegMulAdd(n, Constant(0x1.62e42fefa0000p-1), x);
    const Vector r = hn::NegMulAdd(n, ln2_low, r_high);
    const Vector r_lost = hn::NegMulAdd(n, ln2_low, hn::Sub(r_high, r));  // rounded off in r
    Vector q = Constant(0x1.af38a9b0ec855p-26);
    q = hn::MulAdd(q, r, Constant(0x1.289185613a3d6p-22));
    q = hn::MulAdd(q, r, Constant(0x1.71de0dae63bb3p-19));
    q = hn::MulAdd(q, r, Constant(0x1.a019b90d2ae7ap-16));
    q = hn::MulAdd(q, r, Constant(0x1.a01a01a7c41d5p-13));
    q = hn::MulAdd(q, r, Constant(0x1.6c16c1788bd90p-10));
    q = hn::MulAdd(q, r, Constant(0x1.11111111109b3p-7));
    q = hn::MulAdd(q, r, Constant(0x1.5555555553d63p-5));
    q = hn::MulAdd(q, r, Constant(0x1.5555555555556p-3));
    q = hn::MulAdd(q, r, Constant(0.5));
    tail = hn::Add(r, hn::MulAdd(hn::Mul(r, r), q, r_lost));
  }

  // To within 1 ulp.
  HWY_INLINE Vector Exp() const {
    const hn::RebindToSigned<Tag> bits;
    const Vector e = hn::Add(Constant(1.0), tail);
    return hn::BitCast(Tag(), hn::Add(hn::BitCast(bits, e), hn::ShiftLeft<52>(hn::BitCast(bits, shifted))));
  }
  // e^x − 1 from e^x: without loss where x is small.
  HWY_INLINE Vector MinusOne(Vector e) const {
    return hn::IfThenElse(hn::Eq(shifted, Constant(kMagic)), tail, hn::Sub(e, Constant(1.0)));
  }

  static constexpr double kMagic = 0x1.8p52;
  Vector shifted, tail;
};

HWY_INLINE Vector Exp(Vector x) { return ReducedExp(x).Exp(); }

// A profile gives weight·k, and the factors of ∇K = first·z, ∇²K = first·I + second·zzᵀ, from s = |z|².
struct Jet {
  Vector value, first, second;
};

// The same, and K(0) − K, without loss near 0 for the kernels of the paper.
struct DroppingJet {
  Vector value, first, second, drop;
};

// 1/r, and 0 at r = 0: there peakon's K' := 0, and matern32's second·zzᵀ → 0.
HWY_INLINE Vector InverseDistance(Vector s) {
  return hn::IfThenZeroElse(hn::Eq(s, hn::Zero(Tag())), hn::Div(Constant(1.0), hn::Sqrt(s)));
}

struct GaussianProfile {
  explicit GaussianProfile(const KernelTerm& term)
      : weight(Constant(term.weight)), c(Constant(-1 / (term.alpha * term.alpha))), c2(hn::Add(c, c)) {}
  HWY_INLINE Vector Value(Vector s) const { return hn::Mul(weight, Exp(ClampExponent(hn::Mul(c, s)))); }
  HWY_INLINE Jet First(Vector s) const {
    const Vector k = Value(s);
    return {k, hn::Mul(c2, k), k};
  }
  HWY_INLINE Jet Second(Vector s) const {
    const Jet jet = First(s);
    return {jet.value, jet.first, hn::Mul(c2, jet.first)};
  }
  HWY_INLINE DroppingJet Dropping(Vector s) const {
    const ReducedExp exponential(ClampExponent(hn::Mul(c, s)));
    const Vector e = exponential.Exp();
    const Vector k = hn::Mul(weight, e);
    const Vector first = hn::Mul(c2, k);
    return {k, first, hn::Mul(c2, first), hn::Neg(hn::Mul(weight, exponential.MinusOne(e)))};
  }
  Vector weight, c, c2;
};

struct PeakonProfile {
  explicit PeakonProfile(const KernelTerm& term) : weight(Constant(term.weight)), c(Constant(-1 / term.alpha)) {}
  HWY_INLINE Vector Value(Vector s) const { return hn::Mul(weight, Exp(ClampExponent(hn::Mul(c, hn::Sqrt(s))))); }
  HWY_INLINE Jet First(Vector s) const {
    const Vector k = Value(s);
    return {k, hn::Mul(hn::Mul(c, k), InverseDistance(s)), k};
  }
  HWY_INLINE Jet Second(Vector s) const {
    const Vector k = Value(s);
    const Vector inverse = InverseDistance(s);
    const Vector first = hn::Mul(hn::Mul(c, k), inverse);
    return {k, first, hn::Mul(hn::Mul(first, inverse), hn::Sub(c, inverse))};
  }
  HWY_INLINE DroppingJet Dropping(Vector s) const {
    const ReducedExp exponential(ClampExponent(hn::Mul(c, hn::Sqrt(s))));
    const Vector e = exponential.Exp();
    const Vector k = hn::Mul(weight, e);
    const Vector inverse = InverseDistance(s);
    const Vector first = hn::Mul(hn::Mul(c, k), inverse);
    return {k, first, hn::Mul(hn::Mul(first, inverse), hn::Sub(c, inverse)),
            hn::Neg(hn::Mul(weight, exponential.MinusOne(e)))};
  }
  Vector weight, c;
};

// With t = −√3 r/α: k = (1 − t)eᵗ.
struct Matern32Profile {
  explicit Matern32Profile(const KernelTerm& term)
      : weight(Constant(term.weight)), c(Constant(-std::sqrt(3.0) / term.alpha)), minus_c2(hn::Neg(hn::Mul(c, c))) {}
  HWY_INLINE Vector Value(Vector s) const { return First(s).value; }
  // t is clamped before the polynomial, which could overflow beside the exponential.
  HWY_INLINE Jet First(Vector s) const {
    const Vector t = ClampExponent(hn::Mul(c, hn::Sqrt(s)));
    const Vector e = hn::Mul(weight, Exp(t));
    return {hn::NegMulAdd(t, e, e), hn::Mul(minus_c2, e), e};
  }
  HWY_INLINE Jet Second(Vector s) const {
    const Jet jet = First(s);
    return {jet.value, jet.first, hn::Mul(hn::Mul(c, jet.first), InverseDistance(s))};
  }
  HWY_INLINE DroppingJet Dropping(Vector s) const {
    const Jet jet = Second(s);
    return {jet.value, jet.first, jet.second, hn::Sub(weight, jet.value)};
  }
  Vector weight, c, minus_c2;
};

// With t = −√5 r/α: k = (1 − t + t²/3)eᵗ.
struct Matern52Profile {
  explicit Matern52Profile(const KernelTerm& term)
      : weight(Constant(term.weight)),
        c(Constant(-std::sqrt(5.0) / term.alpha)),
        c2(hn::Mul(c, c)),
        minus_third(hn::Mul(c2, Constant(-1.0 / 3))) {}
  HWY_INLINE Vector Value(Vector s) const { return Second(s).value; }
  HWY_INLINE Jet First(Vector s) const { return Second(s); }
  HWY_INLINE Jet Second(Vector s) const {
    const Vector t = ClampExponent(hn::Mul(c, hn::Sqrt(s)));
    const Vector e = hn::Mul(weight, Exp(t));
    const Vector polynomial = hn::NegMulAdd(hn::NegMulAdd(t, Constant(1.0 / 3), Constant(1.0)), t, Constant(1.0));
    const Vector slope = hn::Mul(minus_third, e);
    return {hn::Mul(polynomial, e), hn::NegMulAdd(t, slope, slope), hn::Neg(hn::Mul(c2, slope))};
  }
  HWY_INLINE DroppingJet Dropping(Vector s) const {
    const Jet jet = Second(s);
    return {jet.value, jet.first, jet.second, hn::Sub(weight, jet.value)};
  }
  Vector weight, c, c2, minus_third;
};

}  // namespace HWY_NAMESPACE
}  // namespace pulson
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_PROFILES_BODY
