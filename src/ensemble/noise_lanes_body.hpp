// The noises of a step, one path in each lane. Included once per vector target, so its guard toggles
// with the target.
#if defined(PULSON_NOISE_LANES_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_NOISE_LANES_BODY
#undef PULSON_NOISE_LANES_BODY
#else
#define PULSON_NOISE_LANES_BODY
#endif

#include <memory>

#include <hwy/highway.h>

#include "kernel_lanes_body.hpp"
#include "noise/bump_noise_body.hpp"
#include "noise/pair_noises_body.hpp"
#include "step_lanes.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::ensemble {
namespace HWY_NAMESPACE {

using namespace pulson::HWY_NAMESPACE;  // NOLINT(google-build-using-namespace): the same target's lanes

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
    const auto exponential = [&](std::size_t, std::size_t, Vector s)
                                 HWY_ATTR { return Exp(ClampExponent(hn::Mul(c, s))); };
    if (pairs_.group.empty())
      noise_.MoveTo(
          Vectors(q), [](std::size_t, std::size_t) HWY_ATTR { return true; }, exponential);
    else
      noise_.MoveTo(
          Vectors(q), [&](std::size_t a, std::size_t b) HWY_ATTR { return pairs_.screens(a, b); }, exponential);
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
    noise_.MoveTo(Vectors(q),
                  [&](std::size_t, std::size_t, Vector s) HWY_ATTR { return Exp(ClampExponent(hn::Mul(c, s))); });
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
    noise_.MoveTo(
        Vectors(q), [](double x) HWY_ATTR { return Constant(x); },
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

#endif  // PULSON_NOISE_LANES_BODY
