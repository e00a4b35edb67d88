// Paths in vector lanes between their steps. Included once per vector target, so its guard toggles
// with the target.
#if defined(PULSON_STEP_STATE_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_STEP_STATE_BODY
#undef PULSON_STEP_STATE_BODY
#else
#define PULSON_STEP_STATE_BODY
#endif

#include <cmath>
#include <limits>

#include <hwy/highway.h>

#include "noise_lanes_body.hpp"
#include "normal_lanes_body.hpp"
#include "step_lanes.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::ensemble {
namespace HWY_NAMESPACE {

using namespace pulson::HWY_NAMESPACE;  // NOLINT(google-build-using-namespace): the same target's lanes

// As many paths as a vector has numbers: their state, from the batch and back to it, their noise and their hard steps.
// An array holds the lanes of its first number, then those of the next.
class StepState {
 public:
  StepState(const StepModel& model, LandmarkBatch& batch, std::size_t first_lane)
      : model_(model),
        batch_(batch),
        first_lane_(first_lane),
        size_(model.dimension * model.count),
        normal_lanes_(model.seed),
        idle_(hn::FirstN(Tag(), 0)),
        hard_(idle_) {
    const std::size_t pairs = model.count * (model.count - 1);
    LaneArena arena(batch.wide.reserve((17 * size_ + 5 * model.channels + pairs + NoiseMemory(model)) * Lanes()));
    for (double** array : {&z_, &end_, &x_, &f_, &g_, &r_}) *array = arena.Take(2 * size_);
    for (double** array : {&c_, &m_, &h_, &moved_, &before_}) *array = arena.Take(size_);
    normals_ = arena.Take(4 * model.channels);
    w_ = arena.Take(model.channels);
    parts_ = MakeParts(model, arena);
    for (std::size_t i = 0; i < size_; ++i) {
      At(z_, i) = hn::LoadU(Tag(), &batch.q[InBatch(i)]);
      At(z_, size_ + i) = hn::LoadU(Tag(), &batch.p[InBatch(i)]);
      At(moved_, i) = hn::LoadU(Tag(), &batch.moved[InBatch(i)]);
    }
    HWY_ALIGN double idle[kPathBatch];
    for (std::size_t lane = 0; lane < Lanes(); ++lane)
      idle[lane] = batch.status[first_lane + lane] == LaneStatus::kRunning ? 0 : 1;
    idle_ = hn::Gt(hn::Load(Tag(), idle), hn::Zero(Tag()));
  }

  bool IsIdle() const { return hn::AllTrue(Tag(), idle_); }

  // The normals of steps 4·block … 4·block + 3.
  HWY_NOINLINE void DrawBlock(std::uint32_t block) {
    const auto path = hn::Iota(NormalLanes::WordTag(), batch_.first_path + first_lane_);
    const auto signs = model_.antithetic ? hn::ShiftLeft<63>(path) : NormalLanes::Word(0);
    for (std::size_t channel = 0; channel < model_.channels; ++channel) {
      const NormalLanes::Counter counters[1] = {
          {model_.antithetic ? hn::ShiftRight<1>(path) : path, NormalLanes::Word(block), NormalLanes::Word(channel)}};
      Vector normals[1][4];
      normal_lanes_.Draw(counters, normals);
      for (std::size_t s = 0; s < 4; ++s)
        At(normals_, channel * 4 + s) =
            hn::BitCast(Tag(), hn::Xor(hn::BitCast(NormalLanes::WordTag(), normals[0][s]), signs));
    }
  }

  // Back to the batch.
  HWY_NOINLINE void Save() {
    for (std::size_t i = 0; i < size_; ++i) {
      hn::StoreU(At(z_, i), Tag(), &batch_.q[InBatch(i)]);
      hn::StoreU(At(z_, size_ + i), Tag(), &batch_.p[InBatch(i)]);
      hn::StoreU(At(moved_, i), Tag(), &batch_.moved[InBatch(i)]);
    }
  }

 protected:
  static HWY_INLINE std::size_t Lanes() { return hn::Lanes(Tag()); }
  static HWY_INLINE Vector& At(double* array, std::size_t i) { return Vectors(array)[i]; }
  double* Half(double* array) const { return array + size_ * Lanes(); }
  HWY_INLINE std::size_t InBatch(std::size_t i) const { return i * kPathBatch + first_lane_; }
  double* q() const { return z_; }
  double* p() const { return Half(z_); }

  // w of a step, as the integrator has it.
  void TakeIncrements(std::uint32_t step) {
    const bool is_mean = model_.scheme == LaneScheme::kVariational;  // of this step's and the last's
    const Vector root = Constant((is_mean ? 0.5 : 1) * std::sqrt(model_.dt));
    for (std::size_t channel = 0; channel < model_.channels; ++channel) {
      double* const before = &batch_.before[channel * kPathBatch + first_lane_];
      const Vector now = At(normals_, channel * 4 + step % 4);
      At(w_, channel) = hn::Mul(root, is_mean ? hn::Add(hn::LoadU(Tag(), before), now) : now);
      hn::StoreU(now, Tag(), before);
    }
  }

  void MoveNoise(const double* q) {
    for (const auto& noise : parts_.noises) noise->MoveTo(q);
  }
  void TakeIncrements() {
    for (std::size_t i = 0; i < parts_.noises.size(); ++i) parts_.noises[i]->TakeIncrements(Increments(i));
  }
  const double* Increments(std::size_t i) const { return w_ + model_.noises[i].first_channel * Lanes(); }

  // to += factor·h_w,p
  void AddVelocities(double factor, double* to) {
    if (!model_.traits.moves_positions()) return;
    Clear(h_);
    for (std::size_t i = 0; i < parts_.noises.size(); ++i) parts_.noises[i]->AddVelocity(Increments(i), h_);
    AddTo(to, factor);
  }
  // to += factor·h_w,q
  void AddForces(double factor, const double* p, double* to) {
    if (!model_.traits.moves_momenta) return;
    Clear(h_);
    for (std::size_t i = 0; i < parts_.noises.size(); ++i) parts_.noises[i]->AddForce(p, Increments(i), h_);
    AddTo(to, factor);
  }
  void AddCompensationVelocities(double factor, double* to) {
    Clear(h_);
    for (const auto& noise : parts_.noises) noise->AddCompensationVelocity(h_);
    AddTo(to, factor);
  }
  void AddCompensationForces(double factor, const double* p, double* to) {
    Clear(h_);
    for (const auto& noise : parts_.noises) noise->AddCompensationForce(p, h_);
    AddTo(to, factor);
  }
  void AddCompensationTangents(double factor, const double* t, double* to) {
    Clear(h_);
    for (const auto& noise : parts_.noises) noise->AddCompensationTangent(t, h_);
    AddTo(to, factor);
  }
  void Clear(double* array) {
    for (std::size_t i = 0; i < size_; ++i) At(array, i) = hn::Zero(Tag());
  }
  void AddTo(double* to, double factor) {
    for (std::size_t i = 0; i < size_; ++i) At(to, i) = hn::MulAdd(Constant(factor), At(h_, i), At(to, i));
  }
  void Sum(const double* a, const double* b, double* to, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) At(to, i) = hn::Add(Vectors(a)[i], Vectors(b)[i]);
  }

  // A bound of Σ|p_a|.
  Vector TotalMomentum(const double* p) const {
    Vector total = hn::Zero(Tag());
    for (std::size_t i = 0; i < size_; ++i) total = hn::Add(total, hn::Abs(Vectors(p)[i]));
    return total;
  }

  // κ ≤ 2 Lip(K) Σ|p_a|: where that is not below 1 there may be several roots.
  LaneMask RiskyLanes(Vector total) const {
    return hn::Not(hn::Lt(hn::Mul(total, Constant(2 * model_.lipschitz)), Constant(1)));
  }

  HWY_NOINLINE void SolveHard(std::uint32_t step) {
    Largest<Tag> size;
    for (std::size_t i = 0; i < 2 * size_; ++i) size.See(At(end_, i));
    const LaneMask finite = hn::Lt(size.Get(), Constant(std::numeric_limits<double>::infinity()));
    hard_ = hn::AndNot(idle_, hn::Or(hard_, hn::Not(finite)));
    if (hn::AllFalse(Tag(), hard_)) return;
    for (std::size_t i = 0; i < size_; ++i) At(moved_, i) = hn::IfThenZeroElse(hard_, At(moved_, i));
    HWY_ALIGN double hard[kPathBatch];
    hn::Store(hn::IfThenElseZero(hard_, Constant(1)), Tag(), hard);
    for (std::size_t i = 0; i < 2 * size_; ++i) At(end_, i) = hn::IfThenElse(hard_, At(z_, i), At(end_, i));
    for (std::size_t lane = 0; lane < Lanes(); ++lane) {
      if (hard[lane] == 0) continue;
      hard[lane] = 0;
      if (take_hard_step(model_, end_ + lane, Half(end_) + lane, w_ + lane, Lanes())) continue;
      hard[lane] = 1;
      batch_.status[first_lane_ + lane] = LaneStatus::kNoRoot;
      batch_.stopped[first_lane_ + lane] = step;
    }
    idle_ = hn::Or(idle_, hn::Gt(hn::Load(Tag(), hard), hn::Zero(Tag())));
  }

  HWY_NOINLINE void Accept() {
    for (std::size_t i = 0; i < 2 * size_; ++i) At(z_, i) = hn::IfThenElse(idle_, At(z_, i), At(end_, i));
    const std::size_t d = model_.dimension;
    Vector largest = hn::Zero(Tag());
    for (std::size_t a = 0; a < model_.count; ++a) {
      Vector square = hn::Zero(Tag());
      for (std::size_t j = 0; j < d; ++j) square = hn::MulAdd(At(p(), a * d + j), At(p(), a * d + j), square);
      largest = hn::Max(largest, square);
    }
    double* const momentum = &batch_.largest_momentum[first_lane_];
    hn::StoreU(hn::Max(hn::LoadU(Tag(), momentum), hn::Sqrt(largest)), Tag(), momentum);
    double* const side = &batch_.smallest_side[first_lane_];
    Vector smallest = hn::LoadU(Tag(), side);
    for (std::size_t i = 1; i < batch_.order.size(); ++i)
      smallest = hn::Min(smallest, hn::Sub(At(q(), batch_.order[i]), At(q(), batch_.order[i - 1])));
    hn::StoreU(smallest, Tag(), side);
  }

  const StepModel& model_;
  LandmarkBatch& batch_;
  std::size_t first_lane_;
  std::size_t size_;
  NormalLanes normal_lanes_;
  StepParts parts_;
  double *z_, *end_, *x_, *f_, *g_, *r_;    // [q p]: the state, that after the step, and of its equations
  double *c_, *m_, *h_, *moved_, *before_;  // dN
  double *normals_, *w_;
  LaneMask idle_;  // no longer running
  LaneMask hard_;  // left to the integrator in this step
};

}  // namespace HWY_NAMESPACE
}  // namespace pulson::ensemble
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_STEP_STATE_BODY
