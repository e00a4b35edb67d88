// Noise by bumps in LaneShooter: fields at landmarks, and their derivatives. Included once per vector target, so its
// guard toggles with the target.
#if defined(PULSON_LANE_BUMPS_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_LANE_BUMPS_BODY
#undef PULSON_LANE_BUMPS_BODY
#else
#define PULSON_LANE_BUMPS_BODY
#endif

#include <hwy/highway.h>

#include "lane_shooter_body.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::posterior {
namespace HWY_NAMESPACE {

// φ_f, and ∇φ_f on demand, at all landmarks.
template <int d>
inline void LaneShooter<d>::Fields(const double* x, bool with_gradients) {
  const Vector sharpness = Constant(-g_.sharpness);
  for (int f = 0; f < g_.bumps; ++f)
    for (int a = 0; a < n_; ++a) {
      Vector off[d];
      Vector s = hn::Zero(Tag());
      for (int e = 0; e < d; ++e) {
        off[e] = hn::Sub(At(x, a * d + e), Constant(g_.centres[f * d + e]));
        s = hn::MulAdd(off[e], off[e], s);
      }
      const Vector value = Exp(ClampExponent(hn::Mul(sharpness, s)));
      Put(value, fields_, f * n_ + a);
      const Vector slope = hn::Mul(hn::Add(sharpness, sharpness), value);
      for (int e = 0; with_gradients && e < d; ++e) Put(hn::Mul(slope, off[e]), gradients_, (f * n_ + a) * d + e);
    }
}

// Σ_f β w_f φ_f
template <int d>
inline void LaneShooter<d>::Displacements(int k, double factor, double* to) const {
  for (int a = 0; a < n_; ++a)
    for (int e = 0; e < d; ++e) {
      Vector sum = hn::Zero(Tag());
      for (int f = 0; f < g_.bumps; ++f)
        sum = hn::MulAdd(At(g_.weights, (k * g_.bumps + f) * d + e), At(fields_, f * n_ + a), sum);
      Put(hn::Mul(Constant(factor), sum), to, a * d + e);
    }
}

// ∇²h_w,pq at a landmark: Σ_f β w_f ∇φ_fᵀ.
template <int d>
HWY_INLINE void LaneShooter<d>::Mixed(int k, int a, Vector* matrix) const {
  for (int i = 0; i < d; ++i)
    for (int j = 0; j < d; ++j) {
      Vector sum = hn::Zero(Tag());
      for (int f = 0; f < g_.bumps; ++f)
        sum = hn::MulAdd(At(g_.weights, (k * g_.bumps + f) * d + i), At(gradients_, (f * n_ + a) * d + j), sum);
      matrix[i * d + j] = sum;
    }
}

// Σ_f (βw_f·p) ∇²φ_f at a landmark, ∇²φ = c (φ I + (x − c_f) ∇φᵀ); symmetric.
template <int d>
HWY_INLINE void LaneShooter<d>::Bent(int k, int a, const double* x, const double* p, Vector* bent) const {
  const Vector c = Constant(-2 * g_.sharpness);
  for (int i = 0; i < d * d; ++i) bent[i] = hn::Zero(Tag());
  for (int f = 0; f < g_.bumps; ++f) {
    Vector along = hn::Zero(Tag());
    for (int e = 0; e < d; ++e) along = hn::MulAdd(At(g_.weights, (k * g_.bumps + f) * d + e), At(p, a * d + e), along);
    along = hn::Mul(along, c);
    for (int i = 0; i < d; ++i) {
      const Vector off = hn::Sub(At(x, a * d + i), Constant(g_.centres[f * d + i]));
      for (int j = 0; j < d; ++j) {
        Vector bend = hn::Mul(off, At(gradients_, (f * n_ + a) * d + j));
        if (i == j) bend = hn::Add(bend, At(fields_, f * n_ + a));
        bent[i * d + j] = hn::MulAdd(along, bend, bent[i * d + j]);
      }
    }
  }
}

// by_w(i, r) += factor·(φ_f ν_q − p (∇φ_f·ν_p)) of landmark a, for channel i and row r.
template <int d>
HWY_INLINE void LaneShooter<d>::AddByWeights(int r, int a, const double* p, double factor, const Vector* nu_q,
                                             const Vector* nu_p) {
  for (int f = 0; f < g_.bumps; ++f) {
    Vector slope = hn::Zero(Tag());
    for (int j = 0; j < d; ++j) slope = hn::MulAdd(nu_p[j], At(gradients_, (f * n_ + a) * d + j), slope);
    for (int e = 0; e < d; ++e) {
      const int place = (r * g_.bumps + f) * d + e;
      Vector sum = hn::Mul(nu_q[e], At(fields_, f * n_ + a));
      sum = hn::NegMulAdd(At(p, a * d + e), slope, sum);
      Put(hn::MulAdd(Constant(factor), sum, At(by_weights_, place)), by_weights_, place);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson::posterior
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_LANE_BUMPS_BODY
