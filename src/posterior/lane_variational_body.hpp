// The integrator variational-2 in LaneShooter: steps, and rows of the derivative. Included once per vector target, so
// its guard toggles with the target.
#if defined(PULSON_LANE_VARIATIONAL_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_LANE_VARIATIONAL_BODY
#undef PULSON_LANE_VARIATIONAL_BODY
#else
#define PULSON_LANE_VARIATIONAL_BODY
#endif

#include <hwy/highway.h>

#include "lane_shooter_body.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::posterior {
namespace HWY_NAMESPACE {

// x ← c + map(x) in each lane until what the corrections would still add, if they go on to contract as they did last,
// is round-off; lanes in which they do not contract are lost.
template <int d>
template <class Map>
inline void LaneShooter<d>::Iterate(const double* c, double* x, double* of_map, double contraction, const Map& map) {
  constexpr int kMostTurns = 100;
  constexpr double kRoundOff = 2e-14, kUncertain = 1e-11;  // of the largest coordinate
  Vector previous = Constant(1e300);
  Flags done = lost_;
  for (int turn = 0; turn < kMostTurns; ++turn) {
    map(x, of_map);
    Vector correction = hn::Zero(Tag());
    Vector size = Constant(1e-300);
    for (int i = 0; i < m_; ++i) {
      const Vector next = hn::Add(At(c, i), At(of_map, i));
      correction = hn::Max(correction, hn::Abs(hn::Sub(next, At(x, i))));
      size = hn::Max(size, hn::Abs(next));
      Put(next, x, i);
    }
    done = hn::Or(done, hn::Le(correction, hn::Mul(Constant(kRoundOff), size)));  // of NaN not
    if (turn > 0) {
      const Vector still = hn::Mul(hn::Mul(Constant(kRoundOff), size), hn::Sub(previous, correction));
      done = hn::Or(done, hn::Le(hn::Mul(correction, correction), still));
      const Flags slow = hn::Not(hn::Le(correction, hn::Mul(Constant(contraction), previous)));
      const Flags large = hn::Not(hn::Le(correction, hn::Mul(Constant(kUncertain), size)));
      lost_ = hn::Or(lost_, hn::AndNot(done, hn::And(slow, large)));
      done = hn::Or(done, slow);
    }
    if (hn::AllTrue(Tag(), done)) return;
    previous = correction;
  }
  lost_ = hn::Or(lost_, hn::Not(done));
}

template <int d>
inline void LaneShooter<d>::Step(int k) {
  const double* q = node(q_, k);
  double* next = node(q_, k + 1);
  double* stage = node(stage_, k);
  double* second = node(second_, k);
  if (k == 0) Jets(q);
  for (int i = 0; i < m_; ++i) Put(At(p_, i), stage, i);
  Iterate(p_, stage, y_, 0.5, [&](const double* p, double* f) {
    Force(p, f);
    for (int i = 0; i < m_; ++i) Put(hn::Neg(At(f, i)), f, i);
  });
  Velocity(stage, y_);
  const int first = k * m_;
  if (g_.bumps > 0) {
    ThroughBumps(k, q, stage, y_, c_, second);
    for (int i = 0; i < m_; ++i) Put(hn::Add(At(c_, i), At(y_, i)), next, i);  // near the root
  }
  for (int i = 0; g_.bumps == 0 && i < m_; ++i) {
    Vector c = hn::Add(At(q, i), At(y_, i));
    if (g_.moves_positions) c = hn::Add(c, At(g_.q_kicks, first + i));
    Put(c, c_, i);
    Vector p = At(stage, i);
    if (g_.moves_momenta) p = hn::Add(p, At(g_.p_kicks, first + i));
    Put(p, second, i);
    Put(hn::Add(c, At(y_, i)), next, i);  // near the root
  }
  Iterate(c_, next, y_, 0.9, [&](const double* x, double* v) { VelocityAt(x, second, v); });
  CheckTurns(c_, next);
  Jets(next);
  Force(second, y_);
  for (int i = 0; i < m_; ++i) Put(hn::Sub(At(second, i), At(y_, i)), p_, i);
}

// I + sign/2 · M for the d×d matrix of a landmark, solved for the vector x; lanes that turn over are lost.
template <int d>
HWY_INLINE void LaneShooter<d>::SolveBlock(const Vector* matrix, double sign, Vector* x) {
  Vector a[d][d];
  for (int i = 0; i < d; ++i)
    for (int j = 0; j < d; ++j) a[i][j] = hn::MulAdd(Constant(sign / 2), matrix[i * d + j], Constant(i == j ? 1 : 0));
  for (int k = 0; k < d; ++k) {
    lost_ = hn::Or(lost_, hn::Not(hn::Gt(a[k][k], Constant(kLeastPivot))));
    const Vector inverse = hn::Div(Constant(1), a[k][k]);
    for (int i = k + 1; i < d; ++i) {
      const Vector factor = hn::Mul(a[i][k], inverse);
      for (int j = k + 1; j < d; ++j) a[i][j] = hn::NegMulAdd(factor, a[k][j], a[i][j]);
      x[i] = hn::NegMulAdd(factor, x[k], x[i]);
    }
  }
  for (int k = d - 1; k >= 0; --k) {
    for (int j = k + 1; j < d; ++j) x[k] = hn::NegMulAdd(a[k][j], x[j], x[k]);
    x[k] = hn::Div(x[k], a[k][k]);
  }
}

// The midpoint rule of the fields' flow: (q + moved, p) to (to_q, to_p).
template <int d>
inline void LaneShooter<d>::ThroughBumps(int k, const double* q, const double* p, const double* moved, double* to_q,
                                         double* to_p) {
  double* middle = node(middle_q_, k);
  double* middle_p = node(middle_p_, k);
  for (int i = 0; i < m_; ++i) {
    Put(hn::Add(At(q, i), At(moved, i)), to_q, i);
    Put(At(to_q, i), middle, i);
  }
  Iterate(to_q, middle, system_, 0.5, [&](const double* x, double* half) {
    Fields(x, false);
    Displacements(k, 0.5, half);
  });
  Fields(middle, true);
  Displacements(k, 1, system_);
  for (int a = 0; a < n_; ++a) {
    Vector mixed[d * d], transposed[d * d], x[d];
    Mixed(k, a, mixed);
    for (int i = 0; i < d; ++i) {
      x[i] = At(p, a * d + i);
      for (int j = 0; j < d; ++j) transposed[i * d + j] = mixed[j * d + i];
    }
    SolveBlock(transposed, 1, x);  // p_m + ½ Σ ∇φ (βw·p_m) = p
    for (int i = 0; i < d; ++i) {
      Put(x[i], middle_p, a * d + i);
      Put(hn::Sub(hn::Add(x[i], x[i]), At(p, a * d + i)), to_p, a * d + i);
      Put(hn::Add(At(to_q, a * d + i), At(system_, a * d + i)), to_q, a * d + i);
    }
  }
}

// As RowSweep::through_midpoint_noise().
template <int d>
inline void LaneShooter<d>::SweepBumps(int k) {
  const double* middle = node(middle_q_, k);
  const double* p = node(middle_p_, k);
  Fields(middle, true);
  for (int a = 0; a < n_; ++a) {
    Vector mixed[d * d], bent[d * d];
    Mixed(k, a, mixed);
    Bent(k, a, middle, p, bent);
    Vector transposed[d * d];
    for (int i = 0; i < d; ++i)
      for (int j = 0; j < d; ++j) transposed[i * d + j] = mixed[j * d + i];
    for (int r = 0; r < rows_; ++r) {
      const int first = r * m_ + a * d;
      Vector nu_p[d], nu_q[d];
      for (int e = 0; e < d; ++e) nu_p[e] = hn::Add(At(p_bar_, first + e), At(p_bar_, first + e));
      SolveBlock(mixed, 1, nu_p);
      for (int e = 0; e < d; ++e) {
        nu_q[e] = hn::Add(At(q_bar_, first + e), At(q_bar_, first + e));
        for (int j = 0; j < d; ++j) nu_q[e] = hn::NegMulAdd(hn::Mul(Constant(0.5), bent[e * d + j]), nu_p[j], nu_q[e]);
      }
      SolveBlock(transposed, -1, nu_q);
      for (int e = 0; e < d; ++e) {
        Put(hn::Sub(nu_q[e], At(q_bar_, first + e)), q_bar_, first + e);
        Put(hn::Sub(nu_p[e], At(p_bar_, first + e)), p_bar_, first + e);
      }
      AddByWeights(r, a, p, g_.beta / 2, nu_q, nu_p);
    }
  }
}

// I + sign·A
template <int d>
inline void LaneShooter<d>::System(double sign) {
  for (int i = 0; i < m_ * m_; ++i) Put(hn::Mul(Constant(sign), At(tangent_, i)), system_, i);
  for (int i = 0; i < m_; ++i) Put(hn::Add(At(system_, i * m_ + i), Constant(1)), system_, i * m_ + i);
}

// The rows of the derivative of the end, backwards along the path, as RowSweep.
template <int d>
inline void LaneShooter<d>::Sweep() {
  BeginSweep();
  for (int k = g_.steps - 1; k >= 0; --k) {
    Jets(node(q_, k + 1));
    Matrices(node(second_, k));
    AddProduct(-1, hessian_, p_bar_, q_bar_, m_, rows_);
    // p̄ −= A p̄ in place: from the product
    Copy(p_bar_, scratch(), m_ * rows_);
    AddProduct(-1, tangent_, scratch(), p_bar_, m_, rows_);
    TransposeTangent();
    System(-1);
    SolveInPlace(system_, q_bar_, m_, rows_);
    AddVelocities(q_bar_, p_bar_);
    if (g_.bumps > 0) {
      ForgetWeights();
      SweepBumps(k);
      TakeByWeights(k);
    }
    TakeByKicks(k);
    Jets(node(q_, k));
    Matrices(node(stage_, k));
    AddVelocities(q_bar_, p_bar_);
    System(1);
    SolveInPlace(system_, p_bar_, m_, rows_);
    TransposeTangent();
    Copy(q_bar_, scratch(), m_ * rows_);
    AddProduct(1, tangent_, scratch(), q_bar_, m_, rows_);
    AddProduct(-1, hessian_, p_bar_, q_bar_, m_, rows_);
  }
  EndSweep();
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson::posterior
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_LANE_VARIATIONAL_BODY
