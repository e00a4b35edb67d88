// The paths of LaneShots and their slopes as vector code: what all integrators and noises share. Included once per
// vector target, so its guard toggles with the target.
#if defined(PULSON_LANE_SHOOTER_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_LANE_SHOOTER_BODY
#undef PULSON_LANE_SHOOTER_BODY
#else
#define PULSON_LANE_SHOOTER_BODY
#endif

#include <algorithm>
#include <vector>

#include <hwy/highway.h>

#include "lane_algebra_body.hpp"
#include "lane_shots.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::posterior {
namespace HWY_NAMESPACE {

using namespace pulson::HWY_NAMESPACE;  // NOLINT(google-build-using-namespace): the same target's lanes

using Flags = hn::Mask<Tag>;

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
  // lane_pairs_body.hpp
  void Jets(const double* q);
  template <class PairJets>
  HWY_INLINE void JetsBy(const PairJets& jets, const double* q);
  void Velocity(const double* p, double* v) const;
  void Force(const double* p, double* f) const;
  void VelocityAt(const double* x, const double* p, double* v) const;
  template <class PairJets>
  HWY_INLINE void VelocityBy(const PairJets& jets, const double* x, const double* p, double* v) const;
  void Matrices(const double* p);
  void AddVelocities(const double* from, double* to) const;
  template <int kTall>
  HWY_INLINE int AddVelocitiesOf(int r, int a, const double* from, double* to) const;
  void TransposeTangent();

  // lane_bumps_body.hpp
  void Fields(const double* x, bool with_gradients);
  void Displacements(int k, double factor, double* to) const;
  HWY_INLINE void Mixed(int k, int a, Vector* matrix) const;
  HWY_INLINE void Bent(int k, int a, const double* x, const double* p, Vector* bent) const;
  HWY_INLINE void AddByWeights(int r, int a, const double* p, double factor, const Vector* nu_q, const Vector* nu_p);

  // lane_heun_body.hpp
  void Kicks(int k, const double* x, const double* p, double* of_q, double* of_p);
  void HeunStep(int k);
  void HeunPull(int k, const double* x, const double* p, const double* q_bar, const double* p_bar, double* q_to,
                double* p_to);
  void HeunSweep();

  // lane_variational_body.hpp
  template <class Map>
  void Iterate(const double* c, double* x, double* of_map, double contraction, const Map& map);
  void Step(int k);
  HWY_INLINE void SolveBlock(const Vector* matrix, double sign, Vector* x);
  void ThroughBumps(int k, const double* q, const double* p, const double* moved, double* to_q, double* to_p);
  void SweepBumps(int k);
  void System(double sign);
  void Sweep();

  void CheckTurns(const double* before, const double* after, double growth = 0);
  void BeginSweep();
  void TakeByKicks(int k);
  void TakeByWeights(int k);
  void EndSweep();
  void Take(const double* bar, const double* by, double* to, int k, int height);

  double* take(int size) {
    double* here = next_;
    next_ += static_cast<std::size_t>(size) * static_cast<std::size_t>(lanes_);
    return here;
  }
  double* node(double* of, int k) const { return of + static_cast<std::size_t>(k * m_ * lanes_); }
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

// Landmarks that have turned about each other by more than a right angle may be on another root; and those that are
// farther apart than that many times the square.
template <int d>
inline void LaneShooter<d>::CheckTurns(const double* before, const double* after, double growth) {
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

template <int d>
inline void LaneShooter<d>::BeginSweep() {
  if (g_.slopes != nullptr) Clear(g_.slopes, rows_ * g_.columns);
  Clear(p_bar_, m_ * rows_);
  for (int i = 0; i < m_ * rows_; ++i) Put(Constant(i % (m_ + 1) == 0 ? 1 : 0), q_bar_, i);
}

// What a step's kicks, weights of bumps and the start have of the rows.
template <int d>
inline void LaneShooter<d>::TakeByKicks(int k) {
  if (g_.moves_positions) Take(q_bar_, g_.by_q, g_.rows_by_q, k, m_);
  if (g_.moves_momenta) Take(p_bar_, g_.by_p, g_.rows_by_p, k, m_);
}

template <int d>
inline void LaneShooter<d>::TakeByWeights(int k) {
  if (g_.bumps > 0) Take(by_weights_, g_.by_weights, g_.rows_by_weights, k, g_.bumps * d);
}

template <int d>
inline void LaneShooter<d>::EndSweep() {
  Take(p_bar_, g_.by_start, g_.rows_by_start, 0, m_);
}

template <int d>
inline void LaneShooter<d>::Take(const double* bar, const double* by, double* to, int k, int height) {
  if (g_.slopes != nullptr)
    AddSlope(bar, by + k * height * g_.columns, g_.slopes, height, rows_, g_.columns);
  else
    Copy(bar, to + static_cast<std::size_t>(k * height * rows_ * lanes_), height * rows_);
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson::posterior
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_LANE_SHOOTER_BODY
