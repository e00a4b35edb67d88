// Compiled once per vector target by foreach_target.h; the best one is chosen at run time.

#include <algorithm>
#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "step_lanes.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
#include "lane_roots_body.hpp"
#include "step_lanes.hpp"
#include "step_state_body.hpp"
// clang-format on

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::ensemble {
namespace HWY_NAMESPACE {

using namespace pulson::HWY_NAMESPACE;  // NOLINT(google-build-using-namespace): the same target's lanes

// The steps of all schemes.
class StepLanes : public StepState {
 public:
  using StepState::StepState;

  HWY_NOINLINE void Step(std::uint32_t step) {
    TakeIncrements(step);
    hard_ = hn::FirstN(Tag(), 0);
    switch (model_.scheme) {
      case LaneScheme::kHeun:
        Heun();
        break;
      case LaneScheme::kMidpoint:
        Midpoint();
        break;
      case LaneScheme::kVariational:
        Variational();
        break;
      case LaneScheme::kVariational2:
        Variational2();
        break;
    }
    SolveHard(step);
    Accept();
  }

 private:
  // f = Δt (H_p, −H_q) + (h_w,p, −h_w,q) at [q p]
  void Field(const double* z, double* f) {
    const double* const p = z + size_ * Lanes();
    parts_.kernel->MoveTo(z, p, f);
    parts_.kernel->Force(z, p, Half(f));
    MoveNoise(z);
    TakeIncrements();
    AddVelocities(1, f);
    AddForces(-1, p, Half(f));
  }

  void Heun() {
    Field(z_, f_);
    Sum(z_, f_, x_, 2 * size_);
    Field(x_, end_);
    for (std::size_t i = 0; i < 2 * size_; ++i)
      At(end_, i) = hn::MulAdd(Constant(0.5), hn::Add(At(f_, i), At(end_, i)), At(z_, i));
  }

  void Midpoint() {
    const Vector total = TotalMomentum(p());
    for (std::size_t i = 0; i < 2 * size_; ++i) At(x_, i) = At(z_, i);
    const Vector scales[2] = {hn::Mul(Constant(model_.at_zero), total),
                              hn::Mul(Constant(model_.lipschitz), hn::Mul(total, total))};
    Solve({z_, x_, f_, size_, 2, scales, 0.5}, [&](const double* m, double* f) {
      Field(m, f);
      for (std::size_t i = 0; i < 2 * size_; ++i) At(f, i) = hn::Mul(Constant(0.5), At(f, i));
    });
    for (std::size_t i = 0; i < 2 * size_; ++i) At(end_, i) = hn::MulAdd(Constant(2), At(f_, i), At(z_, i));
  }

  void Variational() {
    MoveNoise(q());
    TakeIncrements();
    Momenta(1, p(), m_);
    if (model_.compensates) {
      Clear(before_);
      AddCompensationVelocities(model_.flow_time, before_);  // the first guess of G_p
    }
    for (std::size_t i = 0; i < size_; ++i) At(c_, i) = At(q(), i);
    AddVelocities(1, c_);
    const LaneMask risky = RiskyLanes(TotalMomentum(m_));
    for (std::size_t i = 0; i < size_; ++i) At(x_, i) = hn::Add(At(c_, i), hn::IfThenZeroElse(risky, At(moved_, i)));
    Flow(risky);
    for (std::size_t i = 0; i < size_; ++i) At(moved_, i) = At(f_, i);
  }

  void Variational2() {
    const Vector zero[1] = {hn::Zero(Tag())};
    const Vector total = TotalMomentum(p());
    parts_.kernel->MoveTo(q(), p(), f_);
    for (std::size_t i = 0; i < size_; ++i) At(x_, i) = At(p(), i);
    const Vector scales[1] = {hn::Mul(Constant(model_.lipschitz), hn::Mul(total, total))};
    Solve({p(), x_, f_, size_, 1, scales, 0.5}, [&](const double* p, double* f) { parts_.kernel->Force(q(), p, f); });
    if (hn::AllFalse(Tag(), Open())) return;  // to the integrator
    Sum(p(), f_, before_, size_);             // p'
    parts_.kernel->Velocity(before_, moved_);
    Sum(q(), moved_, c_, size_);  // q'
    if (!model_.traits.additive && model_.traits.moves_positions()) {
      for (std::size_t i = 0; i < size_; ++i) At(x_, i) = At(c_, i);
      Solve({c_, x_, f_, size_, 1, zero, 0.5}, [&](const double* q, double* f) {
        MoveNoise(q);
        Clear(f);
        AddVelocities(0.5, f);
      });
      if (hn::AllFalse(Tag(), Open())) return;
    } else {
      MoveNoise(c_);
    }
    if (model_.traits.additive) {
      for (std::size_t i = 0; i < size_; ++i) At(m_, i) = At(before_, i);
      AddForces(-1, before_, m_);
    } else {
      TakeIncrements();
      Momenta(0.5, before_, m_);  // of the middle
      for (std::size_t i = 0; i < size_; ++i) At(end_, i) = At(m_, i);
      for (std::size_t i = 0; i < size_; ++i) At(m_, i) = At(before_, i);
      AddForces(-1, end_, m_);
    }
    AddVelocities(1, c_);
    Sum(c_, moved_, x_, size_);  // near the root
    Flow(RiskyLanes(TotalMomentum(m_)));
  }

  // m = p − factor·h_w,q(m) at the noise's positions.
  void Momenta(double factor, const double* p, double* m) {
    for (std::size_t i = 0; i < size_; ++i) At(m, i) = Vectors(p)[i];
    if (!model_.traits.moves_momenta) return;
    if (model_.traits.additive) return AddForces(-factor, p, m);
    const Vector zero[1] = {hn::Zero(Tag())};
    double* const x = Half(end_);  // not x_, where the noise may be
    for (std::size_t i = 0; i < size_; ++i) At(x, i) = Vectors(p)[i];
    Solve({p, x, f_, size_, 1, zero, 0.9}, [&](const double* at, double* f) {
      Clear(f);
      AddForces(-factor, at, f);
    });
    Sum(p, f_, m, size_);
  }

  // x = c + flow_time (H + G)_p(x, m), from x, and the momenta there.
  void Flow(LaneMask risky) {
    const Vector scales[1] = {hn::Mul(Constant(model_.at_zero), TotalMomentum(m_))};
    const auto map = [&](int turn, const double* x, double* f) {
      parts_.kernel->MoveTo(x, m_, f);
      if (!model_.compensates) return;
      if (turn == 0) return Sum(f, before_, f, size_);
      MoveNoise(x);
      AddCompensationVelocities(model_.flow_time, f);
    };
    // G is small beside H: what it adds to the first term is enough.
    const auto tangent = [&](int turn, int term, const double* t, double* u) {
      parts_.kernel->Tangent(x_, m_, t, u);
      if (model_.compensates && turn > 0 && term == 0) AddCompensationTangents(model_.flow_time, t, u);
    };
    const LaneEquation equation{c_, x_, f_, size_, 1, scales, 0.9};
    hard_ = hn::Or(hard_, FindRootsByTangents(equation, model_.compensates ? 1 : 0, Open(), g_, Half(x_), r_, Half(g_),
                                              map, tangent));
    Sum(c_, f_, end_, size_);
    if (model_.compensates || !hn::AllFalse(Tag(), risky)) CheckTurns();
    parts_.kernel->Force(x_, m_, Half(end_));
    if (model_.compensates) AddCompensationForces(-model_.flow_time, m_, Half(end_));
    Sum(m_, Half(end_), Half(end_), size_);
  }

  template <class Map>
  void Solve(const LaneEquation& equation, const Map& map) {
    hard_ = hn::Or(hard_, FindRoots(equation, Open(), g_, r_, map));
  }
  LaneMask Open() const { return hn::Not(hn::Or(idle_, hard_)); }

  // Landmarks that have turned about each other by more than a right angle may be on another root.
  HWY_NOINLINE void CheckTurns() {
    const std::size_t d = model_.dimension;
    Vector lowest = hn::Zero(Tag());
    for (std::size_t a = 1; a < model_.count; ++a)
      for (std::size_t b = 0; b < a; ++b) {
        Vector product = hn::Zero(Tag());
        for (std::size_t j = 0; j < d; ++j)
          product = hn::MulAdd(hn::Sub(At(c_, a * d + j), At(c_, b * d + j)),
                               hn::Sub(At(end_, a * d + j), At(end_, b * d + j)), product);
        lowest = hn::Min(lowest, product);
      }
    hard_ = hn::Or(hard_, hn::Lt(lowest, hn::Zero(Tag())));
  }
};

void AdvanceSteps(const StepModel& model, LandmarkBatch& batch, std::uint32_t first, std::uint32_t last) {
  for (std::size_t lane = 0; lane < kPathBatch; lane += hn::Lanes(Tag())) {
    StepLanes lanes(model, batch, lane);
    for (std::uint32_t step = first; step < last && !lanes.IsIdle(); ++step) {
      if (step == first || step % 4 == 0) lanes.DrawBlock(step / 4);
      lanes.Step(step);
    }
    lanes.Save();
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson::ensemble
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#if HWY_ONCE

namespace pulson::ensemble {

HWY_EXPORT(AdvanceSteps);

void advance_steps(const StepModel& model, LandmarkBatch& batch, std::uint32_t first, std::uint32_t last) {
  HWY_DYNAMIC_DISPATCH(AdvanceSteps)(model, batch, first, last);
}

}  // namespace pulson::ensemble

#endif  // HWY_ONCE
