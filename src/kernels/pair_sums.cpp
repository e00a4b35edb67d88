// Compiled once per vector target by foreach_target.h; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pair_sums.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
#include <hwy/targets.h>
#include "pair_sums.hpp"
#include "profiles_body.hpp"
// clang-format on

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson {
namespace HWY_NAMESPACE {

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

template <int d>
struct FlowSum {
  static constexpr int kRows = 2 * d;
  static constexpr int kUnroll = 2;
  using Source = typename ApplySum<d>::Source;
  HWY_INLINE void Begin(const PairSumArguments& g, std::size_t i) {
    Load<d>(g.x, g.target_stride, i, x);
    Load<d>(g.v, g.target_stride, i, v);
  }
  template <class Profile>
  HWY_INLINE void Add(const Profile& profile, const Source& source, Vector* sum) const {
    Vector z[d];
    const Jet jet = profile.First(Difference<d>(x, source.y, z));
    const Vector slope = hn::Mul(jet.first, Dot<d>(v, source.a));
    for (int c = 0; c < d; ++c) sum[c] = hn::MulAdd(jet.value, source.a[c], sum[c]);
    for (int c = 0; c < d; ++c) sum[d + c] = hn::MulAdd(slope, z[c], sum[d + c]);
  }
  Vector x[d], v[d];
};

template <int d>
struct FlowTangentSum {
  static constexpr int kRows = 2 * d;
  static constexpr int kUnroll = d == 1 ? 2 : 1;  // more would not find registers
  struct Source {
    Vector y[d], a[d], b[d], c[d];
    Source(const PairSumArguments& g, std::size_t j) {
      Broadcast<d>(g.y, g.source_stride, j, y);
      Broadcast<d>(g.a, g.source_stride, j, a);
      Broadcast<d>(g.b, g.source_stride, j, b);
      Broadcast<d>(g.c, g.source_stride, j, c);
    }
  };
  HWY_INLINE void Begin(const PairSumArguments& g, std::size_t i) {
    Load<d>(g.x, g.target_stride, i, x);
    Load<d>(g.u, g.target_stride, i, u);
    Load<d>(g.v, g.target_stride, i, v);
    Load<d>(g.w, g.target_stride, i, w);
  }
  template <class Profile>
  HWY_INLINE void Add(const Profile& profile, const Source& source, Vector* sum) const {
    Vector z[d], change[d];
    const Jet jet = profile.Second(Difference<d>(x, source.y, z));
    for (int i = 0; i < d; ++i) change[i] = hn::Sub(u[i], source.b[i]);
    const Vector along = Dot<d>(z, change);
    const Vector slope = hn::Mul(jet.first, along);
    const Vector both = Dot<d>(v, source.a);
    const Vector along_change = hn::Mul(both, jet.first);
    const Vector crossed = hn::MulAdd(jet.first, hn::Add(Dot<d>(w, source.a), Dot<d>(v, source.c)),
                                      hn::Mul(both, hn::Mul(jet.second, along)));
    for (int i = 0; i < d; ++i) {
      sum[i] = hn::MulAdd(jet.value, source.c[i], hn::MulAdd(slope, source.a[i], sum[i]));
      sum[d + i] = hn::MulAdd(along_change, change[i], hn::MulAdd(crossed, z[i], sum[d + i]));
    }
  }
  Vector x[d], u[d], v[d], w[d];
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
    case KernelProfile::kMatern32:
      return AddBlockInDimension<Sum, Matern32Profile>(g, first);
    case KernelProfile::kMatern52:
      return AddBlockInDimension<Sum, Matern52Profile>(g, first);
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
    case PairSum::kFlow:
      return AddBlockWithProfile<FlowSum>(g, first);
    case PairSum::kFlowTangent:
      return AddBlockWithProfile<FlowTangentSum>(g, first);
  }
}

std::size_t LaneCount() { return hn::Lanes(Tag()); }

}  // namespace HWY_NAMESPACE
}  // namespace pulson
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#if HWY_ONCE

namespace pulson {

HWY_EXPORT(AddPairSums);
HWY_EXPORT(LaneCount);

void add_pair_sums(const PairSumArguments& arguments, std::size_t first) {
  HWY_DYNAMIC_DISPATCH(AddPairSums)(arguments, first);
}

std::size_t vector_lanes() { return HWY_DYNAMIC_DISPATCH(LaneCount)(); }

std::string vector_target() { return hwy::TargetName(hwy::SupportedAndGeneratedTargets().front()); }

}  // namespace pulson

#endif  // HWY_ONCE
