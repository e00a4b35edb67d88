// Pairs of landmarks of LaneShooter: the flow, and its derivatives. Included once per vector target, so its
// guard toggles with the target.
#if defined(PULSON_LANE_PAIRS_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_LANE_PAIRS_BODY
#undef PULSON_LANE_PAIRS_BODY
#else
#define PULSON_LANE_PAIRS_BODY
#endif

#include <vector>

#include <hwy/highway.h>

#include "lane_shooter_body.hpp"
#include "profiles_body.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::posterior {
namespace HWY_NAMESPACE {

inline Jet KernelJet(const std::vector<KernelTerm>& terms, Vector s) {
  Jet sum{hn::Zero(Tag()), hn::Zero(Tag()), hn::Zero(Tag())};
  const auto add = [&](const Jet& jet) {
    sum = {hn::Add(sum.value, jet.value), hn::Add(sum.first, jet.first), hn::Add(sum.second, jet.second)};
  };
  for (const KernelTerm& term : terms) switch (term.profile) {
      case KernelProfile::kGaussian:
        add(GaussianProfile(term).Second(s));
        break;
      case KernelProfile::kPeakon:
        add(PeakonProfile(term).Second(s));
        break;
      case KernelProfile::kMatern32:
        add(Matern32Profile(term).Second(s));
        break;
      case KernelProfile::kMatern52:
        add(Matern52Profile(term).Second(s));
        break;
    }
  return sum;
}

// task(jets), with the numbers of one profile computed once.
template <class Task>
HWY_INLINE void WithJets(const std::vector<KernelTerm>& terms, const Task& task) {
  const auto of = [&](const auto& profile) { task([&](Vector s) { return profile.Second(s); }); };
  if (terms.size() != 1) return task([&](Vector s) { return KernelJet(terms, s); });
  switch (terms.front().profile) {
    case KernelProfile::kGaussian:
      return of(GaussianProfile(terms.front()));
    case KernelProfile::kPeakon:
      return of(PeakonProfile(terms.front()));
    case KernelProfile::kMatern32:
      return of(Matern32Profile(terms.front()));
    case KernelProfile::kMatern52:
      return of(Matern52Profile(terms.front()));
  }
}

// K, first·z and second of all pairs at positions, first and second times ½Δt.
template <int d>
inline void LaneShooter<d>::Jets(const double* q) {
  WithJets(*g_.terms, [&](const auto& jets) { JetsBy(jets, q); });
}

template <int d>
template <class PairJets>
HWY_INLINE void LaneShooter<d>::JetsBy(const PairJets& jets, const double* q) {
  const Vector half = Constant(g_.half);
  for (int b = 0; b < n_; ++b)
    for (int a = 0; a <= b; ++a) {
      Vector z[d];
      Vector s = hn::Zero(Tag());
      for (int e = 0; e < d; ++e) {
        z[e] = hn::Sub(At(q, a * d + e), At(q, b * d + e));
        s = hn::MulAdd(z[e], z[e], s);
      }
      const Jet jet = jets(s);
      const Vector first = hn::Mul(half, jet.first);
      Put(hn::Mul(half, jet.value), value_, a * n_ + b);
      Put(hn::Mul(half, jet.value), value_, b * n_ + a);
      Put(hn::Mul(half, jet.second), bend_, a * n_ + b);
      Put(first, bend_, b * n_ + a);  // below the diagonal: first
      for (int e = 0; e < d; ++e) {
        Put(hn::Mul(first, z[e]), slope_, (a * n_ + b) * d + e);
        Put(hn::Neg(hn::Mul(first, z[e])), slope_, (b * n_ + a) * d + e);
      }
    }
}

// ½Δt K p
template <int d>
inline void LaneShooter<d>::Velocity(const double* p, double* v) const {
  for (int a = 0; a < n_; ++a) {
    Vector sum[d];
    for (Vector& entry : sum) entry = hn::Zero(Tag());
    for (int b = 0; b < n_; ++b) {
      const Vector k = At(value_, a * n_ + b);
      for (int e = 0; e < d; ++e) sum[e] = hn::MulAdd(k, At(p, b * d + e), sum[e]);
    }
    for (int e = 0; e < d; ++e) Put(sum[e], v, a * d + e);
  }
}

// ½Δt H_q
template <int d>
inline void LaneShooter<d>::Force(const double* p, double* f) const {
  for (int b = 0; b < n_; ++b) {
    Vector of_b[d], sum[d];
    for (int e = 0; e < d; ++e) {
      of_b[e] = At(p, b * d + e);
      sum[e] = hn::Zero(Tag());
    }
    const double* slope = slope_ + static_cast<std::size_t>(b * n_ * d * lanes_);
    for (int a = 0; a < b; ++a) {
      Vector product = hn::Zero(Tag());
      for (int e = 0; e < d; ++e) product = hn::MulAdd(At(p, a * d + e), of_b[e], product);
      for (int e = 0; e < d; ++e) {
        const Vector g = At(slope, a * d + e);
        sum[e] = hn::MulAdd(product, g, sum[e]);
        Put(hn::NegMulAdd(product, g, At(f, a * d + e)), f, a * d + e);
      }
    }
    for (int e = 0; e < d; ++e) Put(sum[e], f, b * d + e);
  }
}

// ½Δt K(x) p at positions x, without the pairs' jets.
template <int d>
inline void LaneShooter<d>::VelocityAt(const double* x, const double* p, double* v) const {
  WithJets(*g_.terms, [&](const auto& jets) { VelocityBy(jets, x, p, v); });
}

template <int d>
template <class PairJets>
HWY_INLINE void LaneShooter<d>::VelocityBy(const PairJets& jets, const double* x, const double* p, double* v) const {
  const Vector half = Constant(g_.half);
  const Vector alone = hn::Mul(half, jets(hn::Zero(Tag())).value);
  for (int b = 0; b < n_; ++b) {
    Vector at_b[d], of_b[d], sum[d];
    for (int e = 0; e < d; ++e) {
      at_b[e] = At(x, b * d + e);
      of_b[e] = At(p, b * d + e);
      sum[e] = hn::Mul(alone, of_b[e]);
    }
    for (int a = 0; a < b; ++a) {
      Vector s = hn::Zero(Tag());
      for (int e = 0; e < d; ++e) {
        const Vector z = hn::Sub(At(x, a * d + e), at_b[e]);
        s = hn::MulAdd(z, z, s);
      }
      const Vector k = hn::Mul(half, jets(s).value);
      for (int e = 0; e < d; ++e) {
        sum[e] = hn::MulAdd(k, At(p, a * d + e), sum[e]);
        Put(hn::MulAdd(k, of_b[e], At(v, a * d + e)), v, a * d + e);
      }
    }
    for (int e = 0; e < d; ++e) Put(sum[e], v, b * d + e);
  }
}

// ½Δt times A = ∂(H_p)/∂q and H_qq, with the jets of the positions.
template <int d>
inline void LaneShooter<d>::Matrices(const double* p) {
  const auto place = [&](int a, int b, int i, int j) { return (b * d + j) * m_ + a * d + i; };
  const auto add = [&](double* to, int a, int i, int j, Vector value) {
    Put(hn::Add(At(to, place(a, a, i, j)), value), to, place(a, a, i, j));
  };
  for (int a = 0; a < n_; ++a)
    for (int i = 0; i < d * d; ++i) {
      Put(hn::Zero(Tag()), tangent_, place(a, a, i / d, i % d));
      Put(hn::Zero(Tag()), hessian_, place(a, a, i / d, i % d));
    }
  for (int b = 0; b < n_; ++b)
    for (int a = 0; a < b; ++a) {
      Vector g[d];
      Vector product = hn::Zero(Tag());
      for (int e = 0; e < d; ++e) {
        g[e] = At(slope_, (a * n_ + b) * d + e);
        product = hn::MulAdd(At(p, a * d + e), At(p, b * d + e), product);
      }
      const Vector first = At(bend_, b * n_ + a);
      const Vector second = At(bend_, a * n_ + b);
      // second·zzᵀ from g = ½Δt first z
      const Flags flat = hn::Lt(hn::Abs(first), Constant(1e-140));
      const Vector unit = hn::IfThenElse(flat, Constant(1), first);
      const Vector weight = hn::IfThenZeroElse(flat, hn::Div(second, hn::Mul(unit, unit)));
      for (int i = 0; i < d; ++i)
        for (int j = 0; j < d; ++j) {
          const Vector of_b = hn::Mul(At(p, b * d + i), g[j]);
          const Vector of_a = hn::Neg(hn::Mul(At(p, a * d + i), g[j]));
          add(tangent_, a, i, j, of_b);
          Put(hn::Neg(of_b), tangent_, place(a, b, i, j));
          add(tangent_, b, i, j, of_a);
          Put(hn::Neg(of_a), tangent_, place(b, a, i, j));
          Vector bend = hn::Mul(weight, hn::Mul(g[i], g[j]));
          if (i == j) bend = hn::Add(bend, first);
          bend = hn::Mul(bend, product);
          add(hessian_, a, i, j, bend);
          add(hessian_, b, i, j, bend);
          Put(hn::Neg(bend), hessian_, place(a, b, i, j));
          Put(hn::Neg(bend), hessian_, place(b, a, i, j));
        }
    }
}

// to += (½Δt K ⊗ I) from
template <int d>
inline void LaneShooter<d>::AddVelocities(const double* from, double* to) const {
  for (int r = 0; r < rows_; ++r)
    for (int a = 0; a < n_;) a += a + 4 <= n_ ? AddVelocitiesOf<4>(r, a, from, to) : AddVelocitiesOf<1>(r, a, from, to);
}

// Of kTall landmarks. @return kTall
template <int d>
template <int kTall>
HWY_INLINE int LaneShooter<d>::AddVelocitiesOf(int r, int a, const double* from, double* to) const {
  Vector sum[kTall][d];
  for (int t = 0; t < kTall; ++t)
    for (int e = 0; e < d; ++e) sum[t][e] = At(to, r * m_ + (a + t) * d + e);
  for (int b = 0; b < n_; ++b) {
    Vector of_b[d];
    for (int e = 0; e < d; ++e) of_b[e] = At(from, r * m_ + b * d + e);
    for (int t = 0; t < kTall; ++t) {
      const Vector k = At(value_, b * n_ + a + t);  // symmetric
      for (int e = 0; e < d; ++e) sum[t][e] = hn::MulAdd(k, of_b[e], sum[t][e]);
    }
  }
  for (int t = 0; t < kTall; ++t)
    for (int e = 0; e < d; ++e) Put(sum[t][e], to, r * m_ + (a + t) * d + e);
  return kTall;
}

template <int d>
inline void LaneShooter<d>::TransposeTangent() {
  for (int i = 0; i < m_; ++i)
    for (int j = 0; j < i; ++j) {
      const Vector above = At(tangent_, i * m_ + j);
      Put(At(tangent_, j * m_ + i), tangent_, i * m_ + j);
      Put(above, tangent_, j * m_ + i);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson::posterior
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_LANE_PAIRS_BODY
