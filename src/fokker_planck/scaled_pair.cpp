#include "scaled_pair.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

#include "core/number_checks.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

// Of the coarsest mesh. The three are balanced: refining any one of them alone lowers the error by a part only.
constexpr double kSpacing = 0.16;      // Δξ: 6 nodes in a kernel's width
constexpr double kLineSpacing = 0.48;  // Δy, where solutions vary over about 1
constexpr double kStepShift = 0.64;    // the largest change of y in a step

// The domain ends this many standard deviations of the noise beyond the start, where about 1e-5 of all paths come.
constexpr double kDeviations = 4.5;

// The domain ends so far in y beyond the start, and beyond where noise alone decides a crossing. With 3 probabilities
// change by up to 1e-4, with 9 by less than 1e-6.
constexpr double kMoreMomenta = 6;

// The nodes that interpolation in x needs beyond the last that is asked for.
constexpr int kMoreNodes = 2;

// The largest T P sup|K'|: the steps of the coarsest mesh are in proportion to it, and here take about a minute.
constexpr double kMostShift = 1e7;

void check(const PairEquation& pair) {
  require_finite("the pair's beta", pair.beta);
  if (pair.beta < 0) throw InputError(fmt::format("the pair's beta is {}; it must not be negative", pair.beta));
  require_positive("the pair's time", pair.time);
  for (const double number : {pair.q1, pair.q2, pair.p1, pair.p2}) require_finite("a position or momentum", number);
  if (pair.q1 == pair.q2)
    throw InputError(fmt::format("both pulsons are at {}; a pair that has no order cannot cross", pair.q1));
  if (!(pair.p1 > 0 && pair.p2 > 0) && !(pair.p1 < 0 && pair.p2 < 0))
    throw InputError(fmt::format(
        "the momenta are {} and {}; the equation on a grid needs both positive or both negative", pair.p1, pair.p2));
  const double shift = pair.time * std::abs(pair.p1 + pair.p2) * pair.kernel.lipschitz();
  if (!(shift <= kMostShift))
    throw InputError(fmt::format(
        "time * (p1 + p2) * sup|K'| is {:.3g}; the equation on a grid takes steps in proportion, up to {:.3g}", shift,
        kMostShift));
}

// The length over which noise and drift balance near x = 0, were the drift x: below the true one, x² for smooth
// kernels.
double balance_length(const ScaledPair& pair) { return std::min(1.0, std::sqrt(pair.diffusion)); }

}  // namespace

double ScaledPair::drop(double at) const {
  const double r = length * at;
  return 1 - kernel->jet(r * r).value / kernel->at_zero();
}

double ScaledPair::slope(double at) const {
  const double r = length * at;
  return kernel->jet(r * r).first * r * length / kernel->at_zero();
}

ScaledPair scaled_pair(const PairEquation& pair) {
  check(pair);
  double length = pair.kernel.terms().front().alpha;
  for (const KernelTerm& term : pair.kernel.terms()) length = std::min(length, term.alpha);
  const double speed = std::abs(pair.p1 + pair.p2) * pair.kernel.at_zero();
  const double mirror = pair.p1 < 0 ? -1 : 1;
  const double exchange = mirror * (pair.q2 - pair.q1) < 0 ? -1 : 1;
  const double diffusion = pair.beta * pair.beta / (length * speed);
  if (pair.beta > 0) require_positive("the pair's beta^2/(alpha |p1 + p2| K(0))", diffusion);
  return {.kernel = &pair.kernel,
          .length = length,
          .diffusion = diffusion,
          .end = pair.time * speed / length,
          .x = exchange * mirror * (pair.q2 - pair.q1) / length,
          .y = exchange * std::log(pair.p2 / pair.p1),
          .lipschitz = pair.kernel.lipschitz() * length / pair.kernel.at_zero()};
}

PairMesh pair_mesh(const ScaledPair& pair, int level) {
  const double spread = std::sqrt(pair.diffusion * pair.end);
  const double refinement = std::ldexp(1.0, level);
  const double widest = pair.x + kDeviations * spread;
  const double largest_y = std::max(std::abs(pair.y), -2 * std::log(balance_length(pair))) + kMoreMomenta;

  PairMesh mesh{};
  mesh.scale = std::min(balance_length(pair), spread / 2);
  mesh.spacing = kSpacing / refinement;
  mesh.half = static_cast<int>(std::ceil(std::asinh(widest / mesh.scale) / mesh.spacing)) + kMoreNodes;
  mesh.line_spacing = kLineSpacing / refinement;
  mesh.start_line = static_cast<int>(std::ceil((largest_y + pair.y) / mesh.line_spacing));
  mesh.lines = mesh.start_line + 1 + static_cast<int>(std::ceil((largest_y - pair.y) / mesh.line_spacing));
  const double coarse_steps = pair.end * pair.lipschitz / kStepShift;
  mesh.steps =
      kCurveIntervals * static_cast<int>(refinement * std::max(1.0, std::ceil(coarse_steps / kCurveIntervals)));
  return mesh;
}

}  // namespace pulson
