#include "backward_equation.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::fokker_planck {

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

namespace {

constexpr int kDampedSteps = 2;

// A shift by less of a line's spacing is none.
constexpr double kLeastShift = 1e-12;

// Cubic interpolation at t in [0, 1) between the second and third of four equally spaced values.
std::array<double, 4> cubic_weights(double t) {
  return {-t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2, -(t + 1) * t * (t - 2) / 2,
          (t + 1) * t * (t - 1) / 6};
}

}  // namespace

BackwardEquation::BackwardEquation(const ScaledPair& pair, const PairMesh& mesh)
    : mesh_(mesh),
      nodes_(static_cast<std::size_t>(mesh.nodes())),
      lines_(static_cast<std::size_t>(mesh.lines)),
      dt_(pair.end / mesh.steps) {
  discretise(pair);
  factorise();
  half_shifts_ = shifts(pair, dt_ / 2);
  full_shifts_ = shifts(pair, dt_);
  for (const Shift& shift : full_shifts_) margin_ = std::max(margin_, std::abs(shift.first) + 3);
  padded_.resize(lines_ + 2 * static_cast<std::size_t>(margin_));
  find_start(pair);

  u_.resize(nodes_ * lines_);
  const auto middle = static_cast<std::ptrdiff_t>(mesh_.half * lines_);
  std::fill(u_.begin(), u_.begin() + middle, 1.0);
  std::fill_n(u_.begin() + middle, lines_, 0.5);
  carried_ = u_;
}

double BackwardEquation::position(double node) const {
  return mesh_.scale * std::sinh(mesh_.spacing * (node - mesh_.half));
}

// With x' = dx/di: ∂_xx u = (1/x'_i) ((u_{i+1} − u_i)/x'_{i+½} − (u_i − u_{i−1})/x'_{i−½}), ∂_x u = (u_{i+1} −
// u_{i−1})/(2x'_i).
void BackwardEquation::discretise(const ScaledPair& pair) {
  const auto stretch = [&](double node) {
    return mesh_.scale * mesh_.spacing * std::cosh(mesh_.spacing * (node - mesh_.half));
  };
  const double half_step = dt_ / 2;
  for (int i = 0; i < mesh_.nodes(); ++i) {
    const double diffusion = half_step * pair.diffusion / (2 * stretch(i));
    left_.push_back(i == 0 ? 0 : diffusion / stretch(i - 0.5));
    right_.push_back(i + 1 == mesh_.nodes() ? 0 : diffusion / stretch(i + 0.5));
    const bool inside = i > 0 && i + 1 < mesh_.nodes();
    drift_.push_back(inside ? half_step * pair.drop(position(i)) / (2 * stretch(i)) : 0);
  }
  for (int j = 0; j < mesh_.lines; ++j)
    tau_.push_back(std::tanh(0.5 * (pair.y + (j - mesh_.start_line) * mesh_.line_spacing)));
}

void BackwardEquation::factorise() {
  inverse_pivot_.resize(nodes_ * lines_);
  upper_.resize(nodes_ * lines_);
  for (std::size_t i = 0; i < nodes_; ++i) {
    for (std::size_t j = 0; j < lines_; ++j) {
      const std::size_t at = i * lines_ + j;
      const double lower = left_[i] - drift_[i] * tau_[j];
      const double before = i == 0 ? 0 : upper_[at - lines_];
      inverse_pivot_[at] = 1 / (1 + left_[i] + right_[i] - lower * before);
      upper_[at] = (right_[i] + drift_[i] * tau_[j]) * inverse_pivot_[at];
    }
  }
}

std::vector<BackwardEquation::Shift> BackwardEquation::shifts(const ScaledPair& pair, double step) const {
  std::vector<Shift> all;
  for (std::size_t i = 0; i < nodes_; ++i) {
    const double lines = -pair.slope(position(static_cast<double>(i))) * step / mesh_.line_spacing;
    if (std::abs(lines) < kLeastShift) continue;
    const double whole = std::floor(lines);
    all.push_back({i, static_cast<std::ptrdiff_t>(whole) - 1, cubic_weights(lines - whole)});
  }
  return all;
}

void BackwardEquation::find_start(const ScaledPair& pair) {
  const double node = std::asinh(pair.x / mesh_.scale) / mesh_.spacing + mesh_.half;
  const double whole = std::floor(node);
  start_node_ = static_cast<std::size_t>(whole) - 1;
  start_weights_ = cubic_weights(node - whole);
}

// The values beyond the first and last line are theirs.
void BackwardEquation::advect(const std::vector<Shift>& shifts) {
  for (const Shift& shift : shifts) {
    double* const row = carried_.data() + shift.node * lines_;
    std::fill_n(padded_.begin(), margin_, row[0]);
    std::copy_n(row, lines_, padded_.begin() + margin_);
    std::fill_n(padded_.end() - margin_, margin_, row[lines_ - 1]);
    const double* const from = padded_.data() + margin_ + shift.first;
    const auto [a, b, c, d] = shift.weights;
    for (std::size_t j = 0; j < lines_; ++j) row[j] = a * from[j] + b * from[j + 1] + c * from[j + 2] + d * from[j + 3];
  }
}

// u = (I − ½Δs A)⁻¹ carried for all lines at once, then carried = new_weight u + old_weight carried.
void BackwardEquation::solve(double new_weight, double old_weight) {
  const double* const tau = tau_.data();
  for (std::size_t i = 0; i < nodes_; ++i) {
    const std::size_t at = i * lines_;
    const double* const right_side = carried_.data() + at;
    const double* const inverse_pivot = inverse_pivot_.data() + at;
    double* const u = u_.data() + at;
    if (i == 0) {
      for (std::size_t j = 0; j < lines_; ++j) u[j] = right_side[j] * inverse_pivot[j];
      continue;
    }
    const double* const before = u - lines_;
    const double left = left_[i];
    const double drift = drift_[i];
    for (std::size_t j = 0; j < lines_; ++j)
      u[j] = (right_side[j] + (left - drift * tau[j]) * before[j]) * inverse_pivot[j];
  }
  for (std::size_t i = nodes_; i-- > 0;) {
    const std::size_t at = i * lines_;
    const double* const upper = upper_.data() + at;
    double* const carried = carried_.data() + at;
    double* const u = u_.data() + at;
    if (i + 1 < nodes_) {
      const double* const after = u + lines_;
      for (std::size_t j = 0; j < lines_; ++j) u[j] += upper[j] * after[j];
    }
    for (std::size_t j = 0; j < lines_; ++j) carried[j] = new_weight * u[j] + old_weight * carried[j];
  }
}

void BackwardEquation::step() {
  if (taken_ < kDampedSteps) {
    advect(half_shifts_);
    solve(1, 0);
    advect(half_shifts_);
    // As u − ½Δs A u = S u_before, the first w is 2u − S u_before.
    if (taken_ + 1 < kDampedSteps)
      solve(1, 0);
    else
      solve(2, -1);
  } else {
    advect(full_shifts_);
    solve(2, -1);
  }
  ++taken_;
}

double BackwardEquation::at_start() const {
  double value = 0;
  for (std::size_t k = 0; k < 4; ++k)
    value += start_weights_[k] * u_[(start_node_ + k) * lines_ + static_cast<std::size_t>(mesh_.start_line)];
  return value;
}

}  // namespace pulson::fokker_planck
