// The paths of LaneShots and their slopes as vector code. Included once per vector target, so its guard toggles with
// the target.
#if defined(PULSON_LANE_SHOTS_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_LANE_SHOTS_BODY
#undef PULSON_LANE_SHOTS_BODY
#else
#define PULSON_LANE_SHOTS_BODY
#endif

#include <algorithm>
#include <cmath>
#include <vector>

#include <hwy/highway.h>

#include "lane_algebra_body.hpp"
#include "lane_shots.hpp"
#include "profiles_body.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::posterior {
namespace HWY_NAMESPACE {

using namespace pulson::HWY_NAMESPACE;  // NOLINT(google-build-using-namespace): the same target's lanes

using Flags = hn::Mask<Tag>;

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

template <int d>
class LaneShooter {
 public:
  explicit LaneShooter(const LaneShotArguments& g)
      : g_(g),
        n_(g.landmarks),
        m_(d * g.landmarks),
        rows_(g.derivatives ? m_ : 0),
        lanes_(static_cast<int>(hn::Lanes(Tag()))) {
    const int matrix = m_ * m_;
    const int nodes = (g.steps + 1) * m_;
    const int of_bumps = g.bumps * n_ * (1 + d) + 2 * g.steps * m_ + rows_ * g.bumps * d;
    const int of_heun = g.heun ? nodes + 2 * m_ * rows_ : 0;
    const int in_all = 3 * nodes + 3 * m_ + n_ * n_ * (2 + d) + 3 * matrix + 2 * m_ * rows_ + of_bumps + of_heun;
    g.workspace->resize(static_cast<std::size_t>(in_all * lanes_));
    next_ = g.workspace->data();
    q_ = take(nodes);
    stage_ = take(nodes);   // p' of each step
    second_ = take(nodes);  // p'' of each step
    p_ = take(m_);
    y_ = take(m_);
    c_ = take(m_);
    value_ = take(n_ * n_);
    bend_ = take(n_ * n_);
    slope_ = take(n_ * n_ * d);
    tangent_ = take(matrix);
    hessian_ = take(matrix);
    system_ = take(matrix);
    q_bar_ = take(m_ * rows_);
    p_bar_ = take(m_ * rows_);
    if (g.heun) {
      before_ = take(nodes);
      q_pull_ = take(m_ * rows_);
      p_pull_ = take(m_ * rows_);
    }
    if (g.bumps == 0) return;
    fields_ = take(g.bumps * n_);
    gradients_ = take(g.bumps * n_ * d);
    middle_q_ = take(g.steps * m_);
    middle_p_ = take(g.steps * m_);
    by_weights_ = take(rows_ * g.bumps * d);
  }

  void Run() {
    const Flags none = hn::FirstN(Tag(), 0);
    lost_ = none;
    for (int i = 0; i < m_; ++i) {
      Put(Constant(g_.q0[i]), q_, i);
      Put(At(g_.p0, i), p_, i);
    }
    for (int k = 0; k < g_.steps; ++k) g_.heun ? HeunStep(k) : Step(k);
    const double* end = node(q_, g_.steps);
    const double* middle = node(q_, (g_.steps + 1) / 2);
    for (int i = 0; i < m_; ++i) Put(At(end, i), g_.ends, i);
    for (int i = 0; i < m_; ++i) Put(At(middle, i), g_.middles, i);
    Vector all = hn::Zero(Tag());
    for (int i = 0; i < m_; ++i) all = hn::Add(all, hn::Add(At(end, i), At(p_, i)));
    const Flags finite = hn::Lt(hn::Abs(all), Constant(1e300));
    Put(hn::IfThenElseZero(hn::AndNot(lost_, finite), Constant(1)), g_.found, 0);
    if (g_.derivatives) g_.heun ? HeunSweep() : Sweep();
  }

 private:
  double* take(int size) {
    double* here = next_;
    next_ += static_cast<std::size_t>(size) * static_cast<std::size_t>(lanes_);
    return here;
  }
  double* node(double* of, int k) const { return of + static_cast<std::size_t>(k * m_ * lanes_); }

  // K, first·z and second of all pairs at positions, first and second times ½Δt.
  void Jets(const double* q) {
    WithJets(*g_.terms, [&](const auto& jets) { JetsBy(jets, q); });
  }

  template <class PairJets>
  HWY_INLINE void JetsBy(const PairJets& jets, const double* q) {
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
  void Velocity(const double* p, double* v) const {
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
  void Force(const double* p, double* f) const {
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
  void VelocityAt(const double* x, const double* p, double* v) const {
    WithJets(*g_.terms, [&](const auto& jets) { VelocityBy(jets, x, p, v); });
  }

  template <class PairJets>
  HWY_INLINE void VelocityBy(const PairJets& jets, const double* x, const double* p, double* v) const {
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

  // x ← c + map(x) in each lane until what the corrections would still add, if they go on to contract as they did last,
  // is round-off; lanes in which they do not contract are lost.
  template <class Map>
  void Iterate(const double* c, double* x, double* of_map, double contraction, const Map& map) {
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

  // What the noise adds to (q, p) in a step, with the fields at x.
  void Kicks(int k, const double* x, const double* p, double* of_q, double* of_p) {
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
  void HeunStep(int k) {
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
  void HeunPull(int k, const double* x, const double* p, const double* q_bar, const double* p_bar, double* q_to,
                double* p_to) {
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
  void HeunSweep() {
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

  void Step(int k) {
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

  // φ_f, and ∇φ_f on demand, at all landmarks.
  void Fields(const double* x, bool with_gradients) {
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
  void Displacements(int k, double factor, double* to) const {
    for (int a = 0; a < n_; ++a)
      for (int e = 0; e < d; ++e) {
        Vector sum = hn::Zero(Tag());
        for (int f = 0; f < g_.bumps; ++f)
          sum = hn::MulAdd(At(g_.weights, (k * g_.bumps + f) * d + e), At(fields_, f * n_ + a), sum);
        Put(hn::Mul(Constant(factor), sum), to, a * d + e);
      }
  }

  // I + sign/2 · M for the d×d matrix of a landmark, solved for the vector x; lanes that turn over are lost.
  HWY_INLINE void SolveBlock(const Vector* matrix, double sign, Vector* x) {
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

  // ∇²h_w,pq at a landmark: Σ_f β w_f ∇φ_fᵀ.
  HWY_INLINE void Mixed(int k, int a, Vector* matrix) const {
    for (int i = 0; i < d; ++i)
      for (int j = 0; j < d; ++j) {
        Vector sum = hn::Zero(Tag());
        for (int f = 0; f < g_.bumps; ++f)
          sum = hn::MulAdd(At(g_.weights, (k * g_.bumps + f) * d + i), At(gradients_, (f * n_ + a) * d + j), sum);
        matrix[i * d + j] = sum;
      }
  }

  // The midpoint rule of the fields' flow: (q + moved, p) to (to_q, to_p).
  void ThroughBumps(int k, const double* q, const double* p, const double* moved, double* to_q, double* to_p) {
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

  // Σ_f (βw_f·p) ∇²φ_f at a landmark, ∇²φ = c (φ I + (x − c_f) ∇φᵀ); symmetric.
  HWY_INLINE void Bent(int k, int a, const double* x, const double* p, Vector* bent) const {
    const Vector c = Constant(-2 * g_.sharpness);
    for (int i = 0; i < d * d; ++i) bent[i] = hn::Zero(Tag());
    for (int f = 0; f < g_.bumps; ++f) {
      Vector along = hn::Zero(Tag());
      for (int e = 0; e < d; ++e)
        along = hn::MulAdd(At(g_.weights, (k * g_.bumps + f) * d + e), At(p, a * d + e), along);
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
  HWY_INLINE void AddByWeights(int r, int a, const double* p, double factor, const Vector* nu_q, const Vector* nu_p) {
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

  // As RowSweep::through_midpoint_noise().
  void SweepBumps(int k) {
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
          for (int j = 0; j < d; ++j)
            nu_q[e] = hn::NegMulAdd(hn::Mul(Constant(0.5), bent[e * d + j]), nu_p[j], nu_q[e]);
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

  // Landmarks that have turned about each other by more than a right angle may be on another root; and those that are
  // farther apart than that many times the square.
  void CheckTurns(const double* before, const double* after, double growth = 0) {
    for (int b = 0; b < n_; ++b)
      for (int a = 0; a < b; ++a) {
        Vector product = hn::Zero(Tag()), from = hn::Zero(Tag()), to = hn::Zero(Tag());
        for (int e = 0; e < d; ++e) {
          const Vector x = hn::Sub(At(before, a * d + e), At(before, b * d + e));
          const Vector y = hn::Sub(At(after, a * d + e), At(after, b * d + e));
          product = hn::MulAdd(x, y, product);
          from = hn::MulAdd(x, x, from);
          to = hn::MulAdd(y, y, to);
        }
        lost_ = hn::Or(lost_, hn::Lt(product, hn::Zero(Tag())));
        if (growth > 0) lost_ = hn::Or(lost_, hn::Gt(to, hn::Mul(Constant(growth), from)));
      }
  }

  // ½Δt times A = ∂(H_p)/∂q and H_qq, with the jets of the positions.
  void Matrices(const double* p) {
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
  void AddVelocities(const double* from, double* to) const {
    for (int r = 0; r < rows_; ++r)
      for (int a = 0; a < n_;)
        a += a + 4 <= n_ ? AddVelocitiesOf<4>(r, a, from, to) : AddVelocitiesOf<1>(r, a, from, to);
  }

  // Of kTall landmarks. @return kTall
  template <int kTall>
  HWY_INLINE int AddVelocitiesOf(int r, int a, const double* from, double* to) const {
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

  void TransposeTangent() {
    for (int i = 0; i < m_; ++i)
      for (int j = 0; j < i; ++j) {
        const Vector above = At(tangent_, i * m_ + j);
        Put(At(tangent_, j * m_ + i), tangent_, i * m_ + j);
        Put(above, tangent_, j * m_ + i);
      }
  }

  // I + sign·A
  void System(double sign) {
    for (int i = 0; i < m_ * m_; ++i) Put(hn::Mul(Constant(sign), At(tangent_, i)), system_, i);
    for (int i = 0; i < m_; ++i) Put(hn::Add(At(system_, i * m_ + i), Constant(1)), system_, i * m_ + i);
  }

  // The rows of the derivative of the end, backwards along the path, as RowSweep.
  void Sweep() {
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

  void BeginSweep() {
    if (g_.slopes != nullptr) Clear(g_.slopes, rows_ * g_.columns);
    Clear(p_bar_, m_ * rows_);
    for (int i = 0; i < m_ * rows_; ++i) Put(Constant(i % (m_ + 1) == 0 ? 1 : 0), q_bar_, i);
  }

  // What a step's kicks, weights of bumps and the start have of the rows.
  void TakeByKicks(int k) {
    if (g_.moves_positions) Take(q_bar_, g_.by_q, g_.rows_by_q, k, m_);
    if (g_.moves_momenta) Take(p_bar_, g_.by_p, g_.rows_by_p, k, m_);
  }
  void TakeByWeights(int k) {
    if (g_.bumps > 0) Take(by_weights_, g_.by_weights, g_.rows_by_weights, k, g_.bumps * d);
  }
  void EndSweep() { Take(p_bar_, g_.by_start, g_.rows_by_start, 0, m_); }

  void Take(const double* bar, const double* by, double* to, int k, int height) {
    if (g_.slopes != nullptr)
      AddSlope(bar, by + k * height * g_.columns, g_.slopes, height, rows_, g_.columns);
    else
      Copy(bar, to + static_cast<std::size_t>(k * height * rows_ * lanes_), height * rows_);
  }

  void ForgetWeights() {
    if (g_.bumps > 0) Clear(by_weights_, rows_ * g_.bumps * d);
  }
  void Clear(double* of, int size) const {
    std::fill(of, of + static_cast<std::size_t>(size) * static_cast<std::size_t>(lanes_), 0.0);
  }
  void Copy(const double* from, double* to, int size) const {
    std::copy(from, from + static_cast<std::size_t>(size) * static_cast<std::size_t>(lanes_), to);
  }
  double* scratch() {
    scratch_.resize(static_cast<std::size_t>(m_ * rows_ * lanes_));
    return scratch_.data();
  }

  const LaneShotArguments& g_;
  int n_, m_, rows_, lanes_;
  double* next_;
  double *q_, *stage_, *second_, *p_, *y_, *c_;
  static constexpr double kMostGrowth = 9;    // as RungeKuttaIntegrator's
  static constexpr double kLeastPivot = 0.1;  // of I + ½A, which is I for small steps
  double *fields_ = nullptr, *gradients_ = nullptr, *middle_q_ = nullptr, *middle_p_ = nullptr;
  double* by_weights_ = nullptr;
  double *value_, *bend_, *slope_, *tangent_, *hessian_, *system_, *q_bar_, *p_bar_;
  double *before_ = nullptr, *q_pull_ = nullptr, *p_pull_ = nullptr;  // of Heun's method; before_: p of each step
  std::vector<double> scratch_;
  Flags lost_;
};

void ShootLanes(const LaneShotArguments& arguments) {
  switch (arguments.dimension) {
    case 1:
      return LaneShooter<1>(arguments).Run();
    case 2:
      return LaneShooter<2>(arguments).Run();
    default:
      return LaneShooter<3>(arguments).Run();
  }
}

std::size_t ShotLaneCount() { return hn::Lanes(Tag()); }

}  // namespace HWY_NAMESPACE
}  // namespace pulson::posterior
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_LANE_SHOTS_BODY
