// Roots of implicit equations, one path in each lane. Included once per vector target, so its guard toggles with the
// target.
#if defined(PULSON_LANE_ROOTS_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_LANE_ROOTS_BODY
#undef PULSON_LANE_ROOTS_BODY
#else
#define PULSON_LANE_ROOTS_BODY
#endif

#include <limits>

#include <hwy/highway.h>

#include "landmark_sums_body.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson::ensemble {
namespace HWY_NAMESPACE {

using namespace pulson::HWY_NAMESPACE;  // NOLINT(google-build-using-namespace): the same target's lanes

// x = c + F(x) for one or two blocks of equal size in different units, such as [q p].
struct LaneEquation {
  const double* c;
  double* x;             // where the iteration begins, and where F is known at last
  double* f;             // F(x): the root is c + f
  std::size_t block;     // numbers of each
  int blocks;            // 1 or 2
  const Vector* scales;  // of each block: a bound on the terms of F, see ImplicitMap::rounding_scale
  double contraction;    // see ImplicitMap::contraction
};

// Finds the roots of all lanes that are open, each by a fixed-point iteration that is accelerated by the secant of its
// last two turns (D. Anderson, 1965, of depth 1). With g = c + F(x) and r = g − x,
//
//     x ← g − γ (g − g'),   γ = r·(r − r')/|r − r'|²,   ' of the turn before; γ = 0 where |γ| > ½
//
// until r, or what a further turn would leave of it, is round-off. F must contract along every change of x, |F(x) −
// F(x')| ≤ contraction |x − x'|, which without acceleration is what the integrator asks. A lane that is done keeps its
// x, so that it is a function of its own numbers. @param map (x, f): f = F(x) @param g, r memory of the size of x
// @return the lanes whose residuals do not contract as they must
template <class Map>
HWY_NOINLINE LaneMask FindRoots(const LaneEquation& equation, LaneMask open, double* g, double* r, const Map& map) {
  constexpr double kEpsilon = 0x1p-52;
  constexpr int kMostTurns = 400;  // as the integrator
  const std::size_t block = equation.block;
  const auto at = [](double* array, std::size_t i) -> Vector& { return reinterpret_cast<Vector*>(array)[i]; };
  const auto c = [&](std::size_t i) { return reinterpret_cast<const Vector*>(equation.c)[i]; };
  LaneMask failed = hn::FirstN(Tag(), 0);
  Vector previous = Constant(std::numeric_limits<double>::infinity());
  Vector rate = hn::Zero(Tag());
  for (int turn = 0; !hn::AllFalse(Tag(), open); ++turn) {
    map(static_cast<const double*>(equation.x), equation.f);
    Vector correction = hn::Zero(Tag()), beside_terms = correction, product = correction, square = correction;
    Vector moved = correction, mapped = correction;  // changes of x and of F(x) since the last turn
    for (int b = 0; b < equation.blocks; ++b) {
      Largest<Tag> change, size, move, image;
      Vector block_product = hn::Zero(Tag()), block_square = block_product;
      for (std::size_t i = b * block; i < (b + 1) * block; ++i) {
        const Vector next = hn::Add(c(i), at(equation.f, i));
        const Vector residual = hn::Sub(next, at(equation.x, i));
        change.See(residual);
        size.See(next);
        if (turn == 0) continue;
        const Vector by = hn::Sub(residual, at(r, i));
        const Vector of_map = hn::Sub(next, at(g, i));
        image.See(of_map);
        move.See(hn::Sub(of_map, by));
        block_product = hn::MulAdd(residual, by, block_product);
        block_square = hn::MulAdd(by, by, block_square);
      }
      const Vector scale = hn::Max(size.Get(), Constant(std::numeric_limits<double>::min()));
      const Vector inverse = hn::Div(Constant(1), scale);
      correction = hn::Max(correction, hn::Mul(change.Get(), inverse));
      moved = hn::Max(moved, hn::Mul(move.Get(), inverse));
      mapped = hn::Max(mapped, hn::Mul(image.Get(), inverse));
      beside_terms = hn::Max(beside_terms, hn::Div(change.Get(), hn::Max(scale, equation.scales[b])));
      product = hn::MulAdd(hn::Mul(block_product, inverse), inverse, product);
      square = hn::MulAdd(hn::Mul(block_square, inverse), inverse, square);
      correction = hn::Add(correction, hn::Mul(change.Get(), hn::Zero(Tag())));  // a NaN stays
    }
    const LaneMask finite = hn::Lt(correction, Constant(std::numeric_limits<double>::infinity()));
    const LaneMask shrinks = hn::And(finite, hn::Le(mapped, hn::Mul(Constant(equation.contraction), moved)));
    const LaneMask at_rounding = hn::Le(beside_terms, Constant(64 * kEpsilon));
    if (turn > 0) rate = hn::Max(rate, hn::Div(mapped, hn::Max(moved, Constant(std::numeric_limits<double>::min()))));
    LaneMask done =
        hn::Or(hn::Le(correction, Constant(kEpsilon)), hn::And(at_rounding, hn::Not(hn::Lt(correction, previous))));
    if (turn > 0) done = hn::Or(done, hn::Le(hn::Mul(correction, rate), Constant(kEpsilon / 2)));
    const LaneMask lost = hn::Not(hn::Or(hn::Or(shrinks, at_rounding), done));
    failed = hn::Or(failed, hn::And(open, lost));
    open = hn::AndNot(hn::Or(done, lost), open);
    if (turn == kMostTurns) return hn::Or(failed, open);
    if (hn::AllFalse(Tag(), open)) return failed;
    Vector gamma = hn::Zero(Tag());
    if (turn > 0) {
      const Vector ratio = hn::Div(product, hn::Max(square, Constant(std::numeric_limits<double>::min())));
      gamma = hn::IfThenElseZero(hn::Le(hn::Abs(ratio), Constant(0.5)), ratio);
    }
    for (std::size_t i = 0; i < block * static_cast<std::size_t>(equation.blocks); ++i) {
      const Vector next = hn::Add(c(i), at(equation.f, i));
      const Vector residual = hn::Sub(next, at(equation.x, i));
      const Vector secant = turn > 0 ? hn::NegMulAdd(gamma, hn::Sub(next, at(g, i)), next) : next;
      at(g, i) = next;
      at(r, i) = residual;
      at(equation.x, i) = hn::IfThenElse(open, secant, at(equation.x, i));
    }
    previous = correction;
  }
  return failed;
}

// The same for one block, by Newton's iteration with most of the derivative of F: e = r + Jr + J²r + … until its terms
// are as small as what linearising leaves, or round-off, and x ← x + e. A lane in which J does not contract as F must
// is not solved. @param map (turn, x, f): f = F(x), roughly in turns before `first_exact` @param tangent (turn, term,
// t, u): u = J t at the x of the last map, J ≈ F'(x) @param t, u, e, g memory of
// the size of x
template <class Map, class Tangent>
HWY_NOINLINE LaneMask FindRootsByTangents(const LaneEquation& equation, int first_exact, LaneMask open, double* t,
                                          double* u, double* e, double* g, const Map& map, const Tangent& tangent) {
  constexpr double kEpsilon = 0x1p-52;
  constexpr int kMostTurns = 20;
  const std::size_t size = equation.block;
  const auto at = [](double* array, std::size_t i) -> Vector& { return reinterpret_cast<Vector*>(array)[i]; };
  const auto c = [&](std::size_t i) { return reinterpret_cast<const Vector*>(equation.c)[i]; };
  LaneMask failed = hn::FirstN(Tag(), 0);
  Vector previous = Constant(std::numeric_limits<double>::infinity());
  Vector rate = hn::Zero(Tag());
  for (std::size_t i = 0; i < size; ++i) at(g, i) = at(e, i) = hn::Zero(Tag());
  for (int turn = 0; !hn::AllFalse(Tag(), open); ++turn) {
    if (turn == kMostTurns) return hn::Or(failed, open);
    map(turn, static_cast<const double*>(equation.x), equation.f);
    Largest<Tag> change, whole, move, image;
    for (std::size_t i = 0; i < size; ++i) {
      const Vector next = hn::Add(c(i), at(equation.f, i));
      const Vector residual = hn::Sub(next, at(equation.x, i));
      change.See(residual);
      whole.See(next);
      image.See(hn::Sub(next, at(g, i)));
      move.See(at(e, i));
      at(g, i) = next;
      at(t, i) = residual;
      at(e, i) = residual;
    }
    const Vector correction = change.Get();
    const Vector scale = hn::Max(whole.Get(), Constant(std::numeric_limits<double>::min()));
    const Vector rounding = hn::Mul(hn::Max(scale, equation.scales[0]), Constant(64 * kEpsilon));
    const Vector least = hn::Mul(scale, Constant(kEpsilon / 2));
    LaneMask shrinks = hn::Lt(correction, previous);
    if (turn > first_exact)  // e is the change of x
      shrinks = hn::And(shrinks, hn::Le(image.Get(), hn::Mul(Constant(equation.contraction), move.Get())));
    const LaneMask at_rounding = hn::Le(correction, rounding);
    LaneMask done = hn::Or(hn::Le(correction, hn::Mul(scale, Constant(kEpsilon))),
                           hn::And(at_rounding, hn::Not(hn::Lt(correction, previous))));
    if (turn > 0) done = hn::Or(done, hn::Le(hn::Mul(correction, rate), least));
    if (turn < first_exact) done = hn::FirstN(Tag(), 0);
    const LaneMask lost = hn::Not(hn::Or(hn::Or(shrinks, at_rounding), done));
    failed = hn::Or(failed, hn::And(open, lost));
    open = hn::AndNot(hn::Or(done, lost), open);
    if (hn::AllFalse(Tag(), open)) return failed;

    const Vector wanted = hn::Max(hn::Mul(correction, hn::Div(correction, scale)), least);
    Vector term = correction;
    LaneMask more = open;
    for (int number = 0; !hn::AllFalse(Tag(), more); ++number) {
      tangent(turn, number, static_cast<const double*>(t), u);
      Largest<Tag> next;
      for (std::size_t i = 0; i < size; ++i) {
        at(t, i) = at(u, i);
        next.See(at(t, i));
        at(e, i) = hn::Add(at(e, i), hn::IfThenElseZero(more, at(t, i)));
      }
      const Vector ratio = hn::Div(next.Get(), hn::Max(term, Constant(std::numeric_limits<double>::min())));
      rate = hn::IfThenElse(more, hn::Max(rate, ratio), rate);
      const LaneMask grows = hn::AndNot(at_rounding, hn::Not(hn::Le(ratio, Constant(equation.contraction))));
      failed = hn::Or(failed, hn::And(more, grows));
      open = hn::AndNot(grows, open);
      term = next.Get();
      more = hn::AndNot(hn::Or(grows, hn::Not(hn::Gt(hn::Mul(term, rate), wanted))), more);
    }
    for (std::size_t i = 0; i < size; ++i)
      at(equation.x, i) = hn::IfThenElse(open, hn::Add(at(equation.x, i), at(e, i)), at(equation.x, i));
    previous = correction;
  }
  return failed;
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson::ensemble
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_LANE_ROOTS_BODY
