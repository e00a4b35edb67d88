// The sums of the kernel in a step, one path in each lane. Included once per vector target, so its guard toggles
// with the target.
#if defined(PULSON_KERNEL_LANES_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_KERNEL_LANES_BODY
#undef PULSON_KERNEL_LANES_BODY
#else
#define PULSON_KERNEL_LANES_BODY
#endif

#include <memory>

#include <hwy/highway.h>

#include "landmark_sums_body.hpp"
#include "step_lanes.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::ensemble {
namespace HWY_NAMESPACE {

using namespace pulson::HWY_NAMESPACE;  // NOLINT(google-build-using-namespace): the same target's lanes

// Takes its arrays, of vectors, one after the other from a block of memory.
class LaneArena {
 public:
  explicit LaneArena(double* next) : next_(next) {}
  double* Take(std::size_t vectors) {
    double* const here = next_;
    next_ += vectors * hn::Lanes(Tag());
    return here;
  }

 private:
  double* next_;
};

HWY_INLINE Vector* Vectors(double* array) { return reinterpret_cast<Vector*>(array); }
HWY_INLINE const Vector* Vectors(const double* array) { return reinterpret_cast<const Vector*>(array); }

// u_a += Σ K(x_a − x_b) p_b, where K and its slope are kept for each pair.
template <int d, class Kernel>
struct KeepingSum {
  struct Landmark {
    Coordinates<d, Tag> x, p, u;
  };
  HWY_INLINE void Load(std::size_t a, Landmark& l) const {
    l.x.Load(x, a);
    l.p.Load(p, a);
    l.u.Load(u, a);
  }
  HWY_INLINE void Store(std::size_t a, const Landmark& l) const { l.u.Store(u, a); }
  HWY_INLINE void Add(Landmark& a, Landmark& b) {
    const Coordinates<d, Tag> z = a.x.Minus(b.x);
    const Jet jet = kernel.Second(z.Dot(z));
    a.u.Add(jet.value, b.p);
    b.u.Add(jet.value, a.p);
    hn::Store(jet.value, Tag(), kept);
    hn::Store(jet.first, Tag(), kept + hn::Lanes(Tag()));
    kept += 2 * hn::Lanes(Tag());
  }
  const Kernel& kernel;
  const double *x, *p;
  double *u, *kept;
};

// The same with K as it is kept.
template <int d>
struct KeptVelocitySum {
  struct Landmark {
    Coordinates<d, Tag> p, u;
  };
  HWY_INLINE void Load(std::size_t a, Landmark& l) const {
    l.p.Load(p, a);
    l.u.Load(u, a);
  }
  HWY_INLINE void Store(std::size_t a, const Landmark& l) const { l.u.Store(u, a); }
  HWY_INLINE void Add(Landmark& a, Landmark& b) {
    const Vector k = hn::Load(Tag(), kept);
    a.u.Add(k, b.p);
    b.u.Add(k, a.p);
    kept += 2 * hn::Lanes(Tag());
  }
  const double* p;
  double* u;
  const double* kept;
};

// f_a −= Σ (p_a·p_b) ∇K(x_a − x_b), as it is kept.
template <int d>
struct KeptForceSum {
  struct Landmark {
    Coordinates<d, Tag> x, p, f;
  };
  HWY_INLINE void Load(std::size_t a, Landmark& l) const {
    l.x.Load(x, a);
    l.p.Load(p, a);
    l.f.Load(f, a);
  }
  HWY_INLINE void Store(std::size_t a, const Landmark& l) const { l.f.Store(f, a); }
  HWY_INLINE void Add(Landmark& a, Landmark& b) {
    const Vector slope = hn::Mul(hn::Load(Tag(), kept + hn::Lanes(Tag())), a.p.Dot(b.p));
    const Coordinates<d, Tag> z = a.x.Minus(b.x);
    a.f.Subtract(slope, z);
    b.f.Add(slope, z);
    kept += 2 * hn::Lanes(Tag());
  }
  const double *x, *p;
  double* f;
  const double* kept;
};

// u_a += Σ p_b ∇K·(t_a − t_b), as it is kept: the change of velocities along a change t of positions.
template <int d>
struct KeptTangentSum {
  struct Landmark {
    Coordinates<d, Tag> x, p, t, u;
  };
  HWY_INLINE void Load(std::size_t a, Landmark& l) const {
    l.x.Load(x, a);
    l.p.Load(p, a);
    l.t.Load(t, a);
    l.u.Load(u, a);
  }
  HWY_INLINE void Store(std::size_t a, const Landmark& l) const { l.u.Store(u, a); }
  HWY_INLINE void Add(Landmark& a, Landmark& b) {
    const Vector along = a.x.Minus(b.x).Dot(a.t.Minus(b.t));
    const Vector slope = hn::Mul(hn::Load(Tag(), kept + hn::Lanes(Tag())), along);
    a.u.Add(slope, b.p);
    b.u.Add(slope, a.p);
    kept += 2 * hn::Lanes(Tag());
  }
  const double *x, *p, *t;
  double* u;
  const double* kept;
};

// flow_time·K of all lanes. The arrays are of coordinates.
class KernelLanes {
 public:
  virtual ~KernelLanes() = default;
  // u = K(x)p; keeps K and its slopes at x.
  virtual void MoveTo(const double* x, const double* p, double* u) = 0;
  // u = K p
  virtual void Velocity(const double* p, double* u) const = 0;
  // f = −H_q at the same x
  virtual void Force(const double* x, const double* p, double* f) const = 0;
  // u = ∂(K(x)p)/∂x t at the same x
  virtual void Tangent(const double* x, const double* p, const double* t, double* u) const = 0;
};

template <int d, class Kernel>
class KernelLanesOf final : public KernelLanes {
 public:
  KernelLanesOf(const StepModel& model, double* kept)
      : kernel_(model.terms), count_(model.count), at_zero_(model.at_zero), kept_(kept) {}

  void MoveTo(const double* x, const double* p, double* u) override {
    OfItself(p, u);
    KeepingSum<d, Kernel> sum{kernel_, x, p, u, kept_};
    AddPairs(sum, count_);
  }
  void Velocity(const double* p, double* u) const override {
    OfItself(p, u);
    KeptVelocitySum<d> sum{p, u, kept_};
    AddPairs(sum, count_);
  }
  void Force(const double* x, const double* p, double* f) const override {
    Clear(f);
    KeptForceSum<d> sum{x, p, f, kept_};
    AddPairs(sum, count_);
  }
  void Tangent(const double* x, const double* p, const double* t, double* u) const override {
    Clear(u);
    KeptTangentSum<d> sum{x, p, t, u, kept_};
    AddPairs(sum, count_);
  }

 private:
  HWY_INLINE void Clear(double* array) const {
    for (std::size_t i = 0; i < d * count_; ++i) Vectors(array)[i] = hn::Zero(Tag());
  }
  HWY_INLINE void OfItself(const double* p, double* u) const {
    for (std::size_t i = 0; i < d * count_; ++i) Vectors(u)[i] = hn::Mul(Constant(at_zero_), Vectors(p)[i]);
  }

  Kernel kernel_;
  std::size_t count_;
  double at_zero_;
  double* kept_;
};

template <int d>
std::unique_ptr<KernelLanes> MakeKernel(const StepModel& model, double* kept) {
  if (model.terms.size() > 1) return std::make_unique<KernelLanesOf<d, ManyTerms>>(model, kept);
  switch (model.terms.front().profile) {
    case KernelProfile::kGaussian:
      return std::make_unique<KernelLanesOf<d, OneTerm<GaussianProfile>>>(model, kept);
    case KernelProfile::kPeakon:
      return std::make_unique<KernelLanesOf<d, OneTerm<PeakonProfile>>>(model, kept);
    case KernelProfile::kMatern32:
      return std::make_unique<KernelLanesOf<d, OneTerm<Matern32Profile>>>(model, kept);
    case KernelProfile::kMatern52:
      return std::make_unique<KernelLanesOf<d, OneTerm<Matern52Profile>>>(model, kept);
  }
  __builtin_unreachable();
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson::ensemble
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_KERNEL_LANES_BODY
