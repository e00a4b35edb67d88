// Heun's method in LaneShooter: steps, and rows of the derivative. Included once per vector target, so its
// guard toggles with the target.
#if defined(PULSON_LANE_HEUN_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_LANE_HEUN_BODY
#undef PULSON_LANE_HEUN_BODY
#else
#define PULSON_LANE_HEUN_BODY
#endif

#include <hwy/highway.h>

#include "lane_shooter_body.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::posterior {
namespace HWY_NAMESPACE {

// What the noise adds to (q, p) in a step, with the fields at x.
template <int d>
inline void LaneShooter<d>::Kicks(int k, const double* x, const double* p, double* of_q, double* of_p) {
  if (g_.bumps == 0) {
    const auto copy = [&](bool moves, const double* kicks, double* to) {
      moves ? Copy(kicks + static_cast<std::size_t>(k * m_ * lanes_), to, m_) : Clear(to, m_);
    };
    copy(g_.moves_positions, g_.q_kicks, of_q);
    copy(g_.moves_momenta, g_.p_kicks, of_p);
    return;
  }
  Fields(x, true);
  Displacements(k, 1, of_q);
  for (int a = 0; a < n_; ++a) {
    Vector mixed[d * d];
    Mixed(k, a, mixed);
    for (int i = 0; i < d; ++i) {
      Vector sum = hn::Zero(Tag());
      for (int j = 0; j < d; ++j) sum = hn::NegMulAdd(mixed[j * d + i], At(p, a * d + j), sum);
      Put(sum, of_p, a * d + i);
    }
  }
}

// With x₁ = x + g(x): x + ½g(x) + ½g(x₁), g of flow and noise.
template <int d>
inline void LaneShooter<d>::HeunStep(int k) {
  const double* q = node(q_, k);
  double* next = node(q_, k + 1);
  double* stage_q = node(stage_, k);
  double* stage_p = node(second_, k);
  const Vector half = Constant(0.5);
  Copy(p_, node(before_, k), m_);
  Kicks(k, q, p_, tangent_, hessian_);  // which paths do not need
  Jets(q);
  Velocity(p_, y_);
  Force(p_, c_);
  for (int i = 0; i < m_; ++i) {
    const Vector v = At(y_, i), f = At(c_, i);
    const Vector of_q = hn::Mul(half, At(tangent_, i)), of_p = hn::Mul(half, At(hessian_, i));
    const Vector moved = hn::Add(hn::Add(At(q, i), v), of_q);
    const Vector pushed = hn::Add(hn::Sub(At(p_, i), f), of_p);
    Put(moved, next, i);
    Put(pushed, p_, i);
    Put(hn::Add(hn::Add(moved, v), of_q), stage_q, i);
    Put(hn::Add(hn::Sub(pushed, f), of_p), stage_p, i);
  }
  Kicks(k, stage_q, stage_p, tangent_, hessian_);
  Jets(stage_q);
  Velocity(stage_p, y_);
  Force(stage_p, c_);
  for (int i = 0; i < m_; ++i) {
    Put(hn::Add(At(next, i), hn::MulAdd(half, At(tangent_, i), At(y_, i))), next, i);
    Put(hn::Sub(hn::MulAdd(half, At(hessian_, i), At(p_, i)), At(c_, i)), p_, i);
  }
  if (g_.keeps_order) CheckTurns(q, next, kMostGrowth);
}

// Adds rows times ½Dg at (x, p) of step k, and to by_weights_ what weights of bumps have of them.
template <int d>
inline void LaneShooter<d>::HeunPull(int k, const double* x, const double* p, const double* q_bar, const double* p_bar,
                                     double* q_to, double* p_to) {
  Jets(x);
  Matrices(p);
  AddVelocities(q_bar, p_to);
  AddProduct(-1, tangent_, p_bar, p_to, m_, rows_);
  AddProduct(-1, hessian_, p_bar, q_to, m_, rows_);
  TransposeTangent();
  AddProduct(1, tangent_, q_bar, q_to, m_, rows_);
  if (g_.bumps == 0) return;
  Fields(x, true);
  for (int a = 0; a < n_; ++a) {
    Vector mixed[d * d], bent[d * d];
    Mixed(k, a, mixed);
    Bent(k, a, x, p, bent);
    for (int r = 0; r < rows_; ++r) {
      const int first = r * m_ + a * d;
      Vector of_q[d], of_p[d];
      for (int e = 0; e < d; ++e) {
        of_q[e] = hn::Mul(Constant(0.5), At(q_bar, first + e));
        of_p[e] = hn::Mul(Constant(0.5), At(p_bar, first + e));
      }
      for (int i = 0; i < d; ++i) {
        Vector to_q = At(q_to, first + i), to_p = At(p_to, first + i);
        for (int j = 0; j < d; ++j) {
          to_q = hn::MulAdd(mixed[j * d + i], of_q[j], to_q);
          to_q = hn::NegMulAdd(bent[i * d + j], of_p[j], to_q);  // symmetric
          to_p = hn::NegMulAdd(mixed[i * d + j], of_p[j], to_p);
        }
        Put(to_q, q_to, first + i);
        Put(to_p, p_to, first + i);
      }
      AddByWeights(r, a, p, g_.beta, of_q, of_p);
    }
  }
}

// With t = x̄'·½Dg(x₁): kicks that are the same at x and x₁ have x̄' + t, and x̄ = x̄' + t + (x̄' + 2t)·½Dg(x).
template <int d>
inline void LaneShooter<d>::HeunSweep() {
  BeginSweep();
  for (int k = g_.steps - 1; k >= 0; --k) {
    ForgetWeights();
    Clear(q_pull_, m_ * rows_);
    Clear(p_pull_, m_ * rows_);
    HeunPull(k, node(stage_, k), node(second_, k), q_bar_, p_bar_, q_pull_, p_pull_);
    const auto add = [&](double* bar, double* pull) {
      for (int i = 0; i < m_ * rows_; ++i) {
        const Vector once = hn::Add(At(bar, i), At(pull, i));
        Put(once, bar, i);
        Put(hn::Add(once, At(pull, i)), pull, i);
      }
    };
    add(q_bar_, q_pull_);
    add(p_bar_, p_pull_);
    TakeByKicks(k);
    HeunPull(k, node(q_, k), node(before_, k), q_pull_, p_pull_, q_bar_, p_bar_);
    TakeByWeights(k);
  }
  EndSweep();
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson::posterior
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_LANE_HEUN_BODY
