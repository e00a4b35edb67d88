// The kernel and the noises of a step, one path in each lane. Included once per vector target, so its guard toggles
// with the target.
#if defined(PULSON_STEP_LANES_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_STEP_LANES_BODY
#undef PULSON_STEP_LANES_BODY
#else
#define PULSON_STEP_LANES_BODY
#endif

#include <memory>

#include <hwy/highway.h>

#include "landmark_sums_body.hpp"
#include "noise/bump_noise_body.hpp"
#include "noise/pair_noises_body.hpp"
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

// A noise of all lanes. It adds to sums; w are the increments of its channels.
class NoiseLanes {
 public:
  virtual ~NoiseLanes() = default;
  virtual void MoveTo(const double* q) = 0;
  virtual void TakeIncrements(const double* /*w*/) {}                               ///< of the forces that follow
  virtual void AddVelocity(const double* w, double* by_p) const = 0;                ///< h_w,p
  virtual void AddForce(const double* p, const double* w, double* by_q) const = 0;  ///< h_w,q
  virtual void AddCompensationVelocity(double* by_p) const = 0;                     ///< G_p
  virtual void AddCompensationForce(const double* p, double* by_q) const = 0;       ///< G_q
  virtual void AddCompensationTangent(const double* t, double* by_p) const = 0;     ///< the change of G_p along t
};

inline PairNoiseConstants<Vector> NoiseConstants(double beta, double range) {
  return {hn::Zero(Tag()), Constant(beta), Constant(0.25 * beta * beta), Constant(-2 / range)};
}

class AdditiveLanes final : public NoiseLanes {
 public:
  explicit AdditiveLanes(const NoiseLoads& loads) : loads_(loads) {}
  void MoveTo(const double* /*q*/) override {}
  void AddVelocity(const double* w, double* by_p) const override { Add(loads_.position, w, by_p); }
  void AddForce(const double* /*p*/, const double* w, double* by_q) const override { Add(loads_.momentum, w, by_q); }
  void AddCompensationVelocity(double* /*by_p*/) const override {}
  void AddCompensationForce(const double* /*p*/, double* /*by_q*/) const override {}
  void AddCompensationTangent(const double* /*t*/, double* /*by_p*/) const override {}

 private:
  static void Add(const std::vector<NoiseLoad>& loads, const double* w, double* to) {
    for (const NoiseLoad& load : loads) {
      Vector& sum = Vectors(to)[load.coordinate];
      sum = hn::MulAdd(Constant(load.value), Vectors(w)[load.channel], sum);
    }
  }
  const NoiseLoads& loads_;
};

template <int d>
class ScreenedLanes final : public NoiseLanes {
 public:
  ScreenedLanes(const ScreenedPairs& pairs, std::size_t count, LaneArena& arena)
      : pairs_(pairs),
        chosen_(static_cast<std::size_t>(pairs.on.count(static_cast<int>(count)))),
        noise_(count, NoiseConstants(pairs.beta, pairs.gamma),
               Vectors(arena.Take(ScreenedNoise<d, Vector>::MemorySize(count)))) {}

  void MoveTo(const double* q) override {
    const Vector c = Constant(-1 / pairs_.gamma);
    const auto exponential = [&](std::size_t, std::size_t, Vector s) HWY_ATTR {
      return Exp(ClampExponent(hn::Mul(c, s)));
    };
    if (pairs_.group.empty())
      noise_.MoveTo(Vectors(q), [](std::size_t, std::size_t) HWY_ATTR { return true; }, exponential);
    else
      noise_.MoveTo(Vectors(q), [&](std::size_t a, std::size_t b) HWY_ATTR { return pairs_.screens(a, b); },
                    exponential);
  }
  void AddVelocity(const double* w, double* by_p) const override {
    noise_.AddVelocity(chosen_, Choice(), Vectors(w), Vectors(by_p));
  }
  void AddForce(const double* p, const double* w, double* by_q) const override {
    noise_.AddForce(chosen_, Choice(), Vectors(p), Vectors(w), Vectors(by_q));
  }
  void AddCompensationVelocity(double* by_p) const override {
    noise_.AddCompensationVelocity(chosen_, Choice(), Vectors(by_p));
  }
  void AddCompensationForce(const double* p, double* by_q) const override {
    noise_.AddCompensationForce(chosen_, Choice(), Vectors(p), Vectors(by_q));
  }
  void AddCompensationTangent(const double* t, double* by_p) const override {
    noise_.AddCompensationTangent(chosen_, Choice(), Vectors(t), Vectors(by_p));
  }

 private:
  auto Choice() const {
    return [this](std::size_t i) { return static_cast<std::size_t>(pairs_.on[static_cast<int>(i)]); };
  }
  const ScreenedPairs& pairs_;
  std::size_t chosen_;
  ScreenedNoise<d, Vector> noise_;
};

template <int d>
class KunitaLanes final : public NoiseLanes {
 public:
  KunitaLanes(const KunitaPairs& pairs, std::size_t count, LaneArena& arena)
      : c_(-1 / (pairs.width * pairs.width)),
        noise_(count, NoiseConstants(pairs.beta, pairs.width * pairs.width),
               Vectors(arena.Take(KunitaNoise<d, Vector>::MemorySize(count)))) {}

  void MoveTo(const double* q) override {
    const Vector c = Constant(c_);
    noise_.MoveTo(Vectors(q), [&](std::size_t, std::size_t, Vector s) HWY_ATTR {
      return Exp(ClampExponent(hn::Mul(c, s)));
    });
  }
  void AddVelocity(const double* w, double* by_p) const override { noise_.AddVelocity(Vectors(w), Vectors(by_p)); }
  void AddForce(const double* p, const double* w, double* by_q) const override {
    noise_.AddForce(Vectors(p), Vectors(w), Vectors(by_q));
  }
  void AddCompensationVelocity(double* by_p) const override { noise_.AddCompensationVelocity(Vectors(by_p)); }
  void AddCompensationForce(const double* p, double* by_q) const override {
    noise_.AddCompensationForce(Vectors(p), Vectors(by_q));
  }
  void AddCompensationTangent(const double* t, double* by_p) const override {
    noise_.AddCompensationForce(Vectors(t), Vectors(by_p));
  }

 private:
  double c_;
  KunitaNoise<d, Vector> noise_;
};

template <int d>
class BumpLanes final : public NoiseLanes {
 public:
  BumpLanes(const LaneBumps& bumps, std::size_t count, LaneArena& arena)
      : c_(-1 / (bumps.width * bumps.width)),
        noise_(count, bumps.ticks, NoiseConstants(bumps.beta, bumps.width * bumps.width),
               Vectors(arena.Take(BumpNoise<d, Vector>::MemorySize(count, bumps.ticks)))) {}

  void MoveTo(const double* q) override {
    const Vector c = Constant(c_);
    noise_.MoveTo(Vectors(q), [](double x) HWY_ATTR { return Constant(x); },
                  [&](Vector s) HWY_ATTR { return Exp(ClampExponent(hn::Mul(c, s))); });
  }
  void TakeIncrements(const double* w) override { noise_.TakeIncrements(Vectors(w)); }
  void AddVelocity(const double* w, double* by_p) const override { noise_.AddVelocity(Vectors(w), Vectors(by_p)); }
  void AddForce(const double* p, const double* /*w*/, double* by_q) const override {
    noise_.AddForce(Vectors(p), Vectors(by_q));
  }
  void AddCompensationVelocity(double* by_p) const override { noise_.AddCompensationVelocity(Vectors(by_p)); }
  void AddCompensationForce(const double* p, double* by_q) const override {
    noise_.AddCompensationForce(Vectors(p), Vectors(by_q));
  }
  void AddCompensationTangent(const double* t, double* by_p) const override {
    noise_.AddCompensationForce(Vectors(t), Vectors(by_p));
  }

 private:
  double c_;
  BumpNoise<d, Vector> noise_;
};

template <int d>
struct NoiseLanesMaker {
  std::unique_ptr<NoiseLanes> operator()(const NoiseLoads& loads) const {
    return std::make_unique<AdditiveLanes>(loads);
  }
  std::unique_ptr<NoiseLanes> operator()(const ScreenedPairs& pairs) const {
    return std::make_unique<ScreenedLanes<d>>(pairs, count, arena);
  }
  std::unique_ptr<NoiseLanes> operator()(const KunitaPairs& pairs) const {
    return std::make_unique<KunitaLanes<d>>(pairs, count, arena);
  }
  std::unique_ptr<NoiseLanes> operator()(const LaneBumps& bumps) const {
    return std::make_unique<BumpLanes<d>>(bumps, count, arena);
  }
  std::size_t count;
  LaneArena& arena;
};

inline std::size_t MemoryOfBumps(const LaneBumps& bumps, const StepModel& model) {
  if (model.dimension == 1) return BumpNoise<1, Vector>::MemorySize(model.count, bumps.ticks);
  if (model.dimension == 2) return BumpNoise<2, Vector>::MemorySize(model.count, bumps.ticks);
  return BumpNoise<3, Vector>::MemorySize(model.count, bumps.ticks);
}

// How many vectors the noise keeps.
inline std::size_t NoiseMemory(const StepModel& model) {
  const std::size_t n = model.count;
  std::size_t size = 0;
  for (const LaneNoise& noise : model.noises) {
    if (std::holds_alternative<ScreenedPairs>(noise.formula)) size += ScreenedNoise<3, Vector>::MemorySize(n);
    if (std::holds_alternative<KunitaPairs>(noise.formula)) size += KunitaNoise<3, Vector>::MemorySize(n);
    if (const auto* bumps = std::get_if<LaneBumps>(&noise.formula)) size += MemoryOfBumps(*bumps, model);
  }
  return size;
}

// What the step needs of the model. make_unique is not of the target, and neither are constructors: they are called.
struct StepParts {
  std::unique_ptr<KernelLanes> kernel;
  std::vector<std::unique_ptr<NoiseLanes>> noises;
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

template <int d>
StepParts MakePartsOf(const StepModel& model, LaneArena& arena) {
  StepParts parts{MakeKernel<d>(model, arena.Take(model.count * (model.count - 1))), {}};
  for (const LaneNoise& noise : model.noises)
    parts.noises.push_back(std::visit(NoiseLanesMaker<d>{model.count, arena}, noise.formula));
  return parts;
}

inline StepParts MakeParts(const StepModel& model, LaneArena& arena) {
  if (model.dimension == 1) return MakePartsOf<1>(model, arena);
  if (model.dimension == 2) return MakePartsOf<2>(model, arena);
  return MakePartsOf<3>(model, arena);
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson::ensemble
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_STEP_LANES_BODY
