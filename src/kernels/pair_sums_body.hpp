// The vector code of the pair sums. Included once per vector target, so its guard toggles with the target.
#if defined(PULSON_PAIR_SUMS_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_PAIR_SUMS_BODY
#undef PULSON_PAIR_SUMS_BODY
#else
#define PULSON_PAIR_SUMS_BODY
#endif

#include <hwy/highway.h>

#include "pair_sums.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::ScalableTag<double>;
using Vector = hn::Vec<Tag>;

HWY_INLINE Vector Constant(double value) { return hn::Set(Tag(), value); }

// exp(x) for x ≤ 0 to within 1 ulp; x below −708 gives exp(−708), 3e-308.
// x = n ln2 + r with |r| ≤ ½ ln2, e^r = 1 + r + r²Q(r), Q of degree 9 interpolated at Chebyshev nodes (relative error
// 1.6e-17). Adding 1.5·2⁵² rounds x/ln2 to the integer n and leaves n in the low bits, whence 2ⁿ.
HWY_INLINE Vector ExpNonPositive(Vector x) {
  const hn::RebindToSigned<Tag> bits;
  const Vector magic = Constant(0x1.8p52);
  x = hn::Max(x, Constant(-708.0));
  const Vector shifted = hn::MulAdd(x, Constant(0x1.71547652b82fep0), magic);
  const Vector n = hn::Sub(shifted, magic);
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
  const Vector e = hn::Add(Constant(1.0), hn::Add(r, hn::MulAdd(hn::Mul(r, r), q, r_lost)));
  return hn::BitCast(Tag(), hn::Add(hn::BitCast(bits, e), hn::ShiftLeft<52>(hn::BitCast(bits, shifted))));
}

// A profile gives weight·k, and the factors of ∇K = first·z, ∇²K = first·I + second·zzᵀ, from s = |z|².
struct Jet {
  Vector value, first, second;
};

struct GaussianProfile {
  explicit GaussianProfile(const KernelTerm& term)
      : weight(Constant(term.weight)), c(Constant(-1 / (term.alpha * term.alpha))), c2(hn::Add(c, c)) {}
  HWY_INLINE Vector Value(Vector s) const { return hn::Mul(weight, ExpNonPositive(hn::Mul(c, s))); }
  HWY_INLINE Jet First(Vector s) const {
    const Vector k = Value(s);
    return {k, hn::Mul(c2, k), k};
  }
  HWY_INLINE Jet Second(Vector s) const {
    const Jet jet = First(s);
    return {jet.value, jet.first, hn::Mul(c2, jet.first)};
  }
  Vector weight, c, c2;
};

struct PeakonProfile {
  explicit PeakonProfile(const KernelTerm& term) : weight(Constant(term.weight)), c(Constant(-1 / term.alpha)) {}
  HWY_INLINE Vector Value(Vector s) const { return hn::Mul(weight, ExpNonPositive(hn::Mul(c, hn::Sqrt(s)))); }
  // K'(0) := 0, so both factors vanish at s = 0.
  HWY_INLINE Vector InverseDistance(Vector s) const {
    return hn::IfThenZeroElse(hn::Eq(s, hn::Zero(Tag())), hn::Div(Constant(1.0), hn::Sqrt(s)));
  }
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
  Vector weight, c;
};

template <int d>
HWY_INLINE Vector Dot(const Vector* a, const Vector* b) {
  Vector sum = hn::Mul(a[0], b[0]);
  for (int c = 1; c < d; ++c) sum = hn::MulAdd(a[c], b[c], sum);
  return sum;
}

template <int d>
HWY_INLINE void Load(const double* rows, std::size_t stride, std::size_t i, Vector* to) {
  for (int c = 0; c < d; ++c) to[c] = hn::LoadU(Tag(), rows + c * stride + i);
}

template <int d>
HWY_INLINE void Broadcast(const double* rows, std::size_t stride, std::size_t j, Vector* to) {
  for (int c = 0; c < d; ++c) to[c] = Constant(rows[c * stride + j]);
}

template <int d>
HWY_INLINE Vector Difference(const Vector* x, const Vector* y, Vector* z) {
  for (int c = 0; c < d; ++c) z[c] = hn::Sub(x[c], y[c]);
  return Dot<d>(z, z);
}

// Each sum holds one vector of targets: Begin loads them, Source loads what all lanes share, Add adds one source.
template <int d>
struct ApplySum {
  static constexpr int kRows = d;
  static constexpr int kUnroll = 4;
  struct Source {
    Vector y[d], a[d];
    Source(const PairSumArguments& g, std::size_t j) {
      Broadcast<d>(g.y, g.source_stride, j, y);
      Broadcast<d>(g.a, g.source_stride, j, a);
    }
  };
  HWY_INLINE void Begin(const PairSumArguments& g, std::size_t i) { Load<d>(g.x, g.target_stride, i, x); }
  template <class Profile>
  HWY_INLINE void Add(const Profile& profile, const Source& source, Vector* sum) const {
    Vector z[d];
    const Vector k = profile.Value(Difference<d>(x, source.y, z));
    for (int c = 0; c < d; ++c) sum[c] = hn::MulAdd(k, source.a[c], sum[c]);
  }
  Vector x[d];
};

template <int d>
struct ApplyJacobianSum {
  static constexpr int kRows = d + d * d;
  static constexpr int kUnroll = 2;
  using Source = typename ApplySum<d>::Source;
  HWY_INLINE void Begin(const PairSumArguments& g, std::size_t i) { Load<d>(g.x, g.target_stride, i, x); }
  template <class Profile>
  HWY_INLINE void Add(const Profile& profile, const Source& source, Vector* sum) const {
    Vector z[d];
    const Jet jet = profile.First(Difference<d>(x, source.y, z));
    for (int c = 0; c < d; ++c) sum[c] = hn::MulAdd(jet.value, source.a[c], sum[c]);
    for (int e = 0; e < d; ++e) {
      const Vector slope = hn::Mul(jet.first, z[e]);
      for (int c = 0; c < d; ++c) sum[d + e * d + c] = hn::MulAdd(slope, source.a[c], sum[d + e * d + c]);
    }
  }
  Vector x[d];
};

template <int d>
struct TangentSum {
  static constexpr int kRows = d;
  static constexpr int kUnroll = 2;
  struct Source {
    Vector y[d], a[d], b[d];
    Source(const PairSumArguments& g, std::size_t j) {
      Broadcast<d>(g.y, g.source_stride, j, y);
      Broadcast<d>(g.a, g.source_stride, j, a);
      Broadcast<d>(g.b, g.source_stride, j, b);
    }
  };
  HWY_INLINE void Begin(const PairSumArguments& g, std::size_t i) {
    Load<d>(g.x, g.target_stride, i, x);
    Load<d>(g.u, g.target_stride, i, u);
  }
  template <class Profile>
  HWY_INLINE void Add(const Profile& profile, const Source& source, Vector* sum) const {
    Vector z[d], w[d];
    const Jet jet = profile.First(Difference<d>(x, source.y, z));
    for (int c = 0; c < d; ++c) w[c] = hn::Sub(u[c], source.b[c]);
    const Vector slope = hn::Mul(jet.first, Dot<d>(z, w));
    for (int c = 0; c < d; ++c) sum[c] = hn::MulAdd(slope, source.a[c], sum[c]);
  }
  Vector x[d], u[d];
};

template <int d>
struct GradientSum {
  static constexpr int kRows = d;
  static constexpr int kUnroll = 2;
  using Source = typename TangentSum<d>::Source;
  HWY_INLINE void Begin(const PairSumArguments& g, std::size_t i) {
    Load<d>(g.x, g.target_stride, i, x);
    Load<d>(g.u, g.target_stride, i, u);
    Load<d>(g.v, g.target_stride, i, v);
  }
  template <class Profile>
  HWY_INLINE void Add(const Profile& profile, const Source& source, Vector* sum) const {
    Vector z[d];
    const Jet jet = profile.First(Difference<d>(x, source.y, z));
    const Vector slope = hn::Mul(jet.first, hn::Add(Dot<d>(u, source.b), Dot<d>(v, source.a)));
    for (int c = 0; c < d; ++c) sum[c] = hn::MulAdd(slope, z[c], sum[c]);
  }
  Vector x[d], u[d], v[d];
};

template <int d>
struct HessianSum {
  static constexpr int kRows = d;
  static constexpr int kUnroll = 2;
  using Source = typename TangentSum<d>::Source;
  HWY_INLINE void Begin(const PairSumArguments& g, std::size_t i) {
    Load<d>(g.x, g.target_stride, i, x);
    Load<d>(g.u, g.target_stride, i, u);
    Load<d>(g.v, g.target_stride, i, v);
  }
  template <class Profile>
  HWY_INLINE void Add(const Profile& profile, const Source& source, Vector* sum) const {
    Vector z[d], w[d];
    const Jet jet = profile.Second(Difference<d>(x, source.y, z));
    for (int c = 0; c < d; ++c) w[c] = hn::Sub(u[c], source.b[c]);
    const Vector weight = Dot<d>(v, source.a);
    const Vector along_w = hn::Mul(weight, jet.first);
    const Vector along_z = hn::Mul(weight, hn::Mul(jet.second, Dot<d>(z, w)));
    for (int c = 0; c < d; ++c) sum[c] = hn::MulAdd(along_w, w[c], hn::MulAdd(along_z, z[c], sum[c]));
  }
  Vector x[d], u[d], v[d];
};

// kTargetBlock targets, `unroll` vectors of them at a time: independent chains hide the latency of the exponential.
template <class Sum, class Profile, int unroll>
HWY_INLINE std::size_t AddVectors(const PairSumArguments& g, const Profile& profile, std::size_t i) {
  const std::size_t lanes = hn::Lanes(Tag());
  Sum targets[unroll];
  Vector sums[unroll][Sum::kRows];
  for (int t = 0; t < unroll; ++t) {
    targets[t].Begin(g, i + t * lanes);
    for (Vector& sum : sums[t]) sum = hn::Zero(Tag());
  }
  for (std::size_t j = 0; j < g.sources; ++j) {
    const typename Sum::Source source(g, j);
    for (int t = 0; t < unroll; ++t) targets[t].Add(profile, source, sums[t]);
  }
  for (int t = 0; t < unroll; ++t) {
    for (int row = 0; row < Sum::kRows; ++row) {
      double* out = g.out + row * g.target_stride + i + t * lanes;
      hn::StoreU(hn::Add(hn::LoadU(Tag(), out), sums[t][row]), Tag(), out);
    }
  }
  return unroll * lanes;
}

template <class Sum, class Profile>
void AddBlock(const PairSumArguments& g, std::size_t first) {
  const Profile profile(g.term);
  const std::size_t end = first + kTargetBlock < g.targets ? first + kTargetBlock : g.targets;
  const std::size_t lanes = hn::Lanes(Tag());
  std::size_t i = first;
  while (i + (Sum::kUnroll - 1) * lanes < end) i += AddVectors<Sum, Profile, Sum::kUnroll>(g, profile, i);
  while (i < end) i += AddVectors<Sum, Profile, 1>(g, profile, i);
}

template <template <int> class Sum, class Profile>
void AddBlockInDimension(const PairSumArguments& g, std::size_t first) {
  switch (g.dimension) {
    case 1:
      return AddBlock<Sum<1>, Profile>(g, first);
    case 2:
      return AddBlock<Sum<2>, Profile>(g, first);
    default:
      return AddBlock<Sum<3>, Profile>(g, first);
  }
}

template <template <int> class Sum>
void AddBlockWithProfile(const PairSumArguments& g, std::size_t first) {
  switch (g.term.profile) {
    case KernelProfile::kGaussian:
      return AddBlockInDimension<Sum, GaussianProfile>(g, first);
    case KernelProfile::kPeakon:
      return AddBlockInDimension<Sum, PeakonProfile>(g, first);
  }
}

void AddPairSums(const PairSumArguments& g, std::size_t first) {
  switch (g.sum) {
    case PairSum::kApply:
      return AddBlockWithProfile<ApplySum>(g, first);
    case PairSum::kApplyJacobian:
      return AddBlockWithProfile<ApplyJacobianSum>(g, first);
    case PairSum::kTangent:
      return AddBlockWithProfile<TangentSum>(g, first);
    case PairSum::kGradient:
      return AddBlockWithProfile<GradientSum>(g, first);
    case PairSum::kHessian:
      return AddBlockWithProfile<HessianSum>(g, first);
  }
}

std::size_t LaneCount() { return hn::Lanes(Tag()); }

}  // namespace HWY_NAMESPACE
}  // namespace pulson
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_PAIR_SUMS_BODY
