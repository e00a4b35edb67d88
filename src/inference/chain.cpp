#include "chain.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

#include "no_u_turn.hpp"
#include "normal_quantile.hpp"
#include "posterior/fitted_draws.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::inference {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kQuarterTurn = std::numbers::pi / 2;
constexpr double kFirstAngle = 0.8;
constexpr double kLeastAngle = 1e-4;
constexpr int kMostKicks = 32, kMostDoublings = 6;
constexpr double kThetaAcceptance = 0.3;
constexpr double kAdaptation = 0.6;
constexpr double kWider = 1.3;  // deviations of the law within which φ rotates
// Nats, where a chain begins, below the weight of the centre: draws of a reference of strongly bent paths may lie 10⁵
// below, from where chains come to other parts of the posterior.
constexpr double kFarFromCentre = 10;
constexpr int kStarts = 50;         // draws of the reference before a chain begins at its centre
constexpr double kFewJumps = 0.01;  // of jumps in the warm-up that led elsewhere: later only one draw is tried then

// Kinds of random numbers within an iteration.
constexpr std::size_t kOfExchange = 0, kKindsOfSpecimen = 6, kFirstTheta = 1;
constexpr std::uint64_t kStartIterations = 1ULL << 30U, kExchangeIterations = 1ULL << 29U;

}  // namespace

Chain::Chain(const ChainSetting& setting, int number, double power)
    : setting_(setting),
      number_(static_cast<std::uint64_t>(number)),
      power_(power),
      log_angle_(std::log(kFirstAngle)),
      log_scale_(setting.move.fits_data
                     ? std::log(kQuarterTurn)
                     : std::log(2.4 / std::sqrt(std::max<double>(1, static_cast<double>(setting.space.count()))))),
      centre_(setting.reference.centre),
      root_(setting.reference.root) {
  const Index k = setting_.space.count();
  double size = 1;  // of the first normal numbers: smaller where there is no path, or none as good as at the centre
  double least = -std::numeric_limits<double>::infinity();
  if (power_ > 0 && begin_at(make_theta(setting_, setting_.reference.centre, power_), 0))
    least = log_weight() - kFarFromCentre;
  for (int start = 0; start < kStarts; ++start, size *= 0.9) {
    iteration_ = kStartIterations + static_cast<std::uint64_t>(start);
    VectorXd phi = setting_.reference.centre;
    if (k > 0) phi += size * VectorXd(root_.triangularView<Eigen::Lower>() * normals(0, k));
    if (begin_at(make_theta(setting_, phi, power_), size) && (power_ == 0 || log_weight() >= least)) break;
  }
  if (points_.empty()) throw NumericalError("no path is found where chains begin; use more `grid.steps`");
  iteration_ = 0;
}

bool Chain::begin_at(ThetaPoint theta, double size) {
  std::vector<ChainPoint> points;
  for (std::size_t i = 0; i < setting_.specimens.size(); ++i) {
    const std::size_t kind = kFirstTheta + kKindsOfSpecimen * (i + 1);
    const Specimen& specimen = setting_.specimens[i];
    auto begun = power_ == 0 ? point(i, theta, 0, size * normals(kind + 1, specimen.unknowns()))
                             : point(i, theta, drawn_component(setting_.reference.log_weights[i], uniform(kind)),
                                     size * normals(kind + 1, specimen.unknowns() + specimen.data()));
    if (!begun) return false;
    points.push_back(std::move(*begun));
  }
  theta_ = std::move(theta);
  points_ = std::move(points);
  return true;
}

void Chain::redraw() {
  try {
    if (begin_at(make_theta(setting_, normals(0, setting_.space.count()), power_), 1)) return;
  } catch (const Error&) {
    // θ without a model, as where the matrix of the kernel is singular
  }
  ++lost_draws_;
}

// (ζ, ε) given z are drawn anew: those of any normal numbers, moved by what their z lacks, v + AᵀP⁻¹(z − Av − mean)
// with the covariance P = AAᵀ = (I + JᵀJ)⁻¹ of z.
std::vector<ChainPoint> Chain::seen_here(const ThetaPoint& theta, const std::vector<ChainPoint>& points) const {
  if (power_ == 0) return points;
  std::vector<ChainPoint> made = points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    ChainPoint& point = made[i];
    const std::size_t kind = kFirstTheta + kKindsOfSpecimen * (i + 1);
    const std::uint64_t iteration = kExchangeIterations + iteration_;
    point.weight = log_weight_of(setting_, i, theta, power_, point.component, point.z, point.shot);
    point.component = drawn_component(point.weight.responsibilities.array().log(),
                                      normal_probability(drawn(setting_.seed, number_, iteration, kind, 1)[0]));
    const LinearAt& linear = theta.linear[i][point.component];
    point.v = drawn(setting_.seed, number_, iteration, kind + 1, point.z.size() + setting_.specimens[i].data());
    const VectorXd lacks = point.z - linear.draw(point.v);
    point.v += linear.pull_back(lacks + linear.transposed(linear.apply(lacks)));
  }
  return made;
}

void Chain::set_power(double power) {
  if (power == power_) return;
  power_ = power;
  theta_ = make_theta(setting_, theta_.phi, power_);
  points_ = seen_here(theta_, points_);
}

double Chain::exchange(Chain& lower) {
  const double probability =
      std::min(1.0, std::exp((power_ - lower.power_) * (lower.log_likelihood() - log_likelihood())));
  if (!(uniform(kOfExchange) < probability)) return probability;
  try {
    ThetaPoint here = make_theta(setting_, lower.theta_.phi, power_);
    ThetaPoint there = make_theta(setting_, theta_.phi, lower.power_);
    std::vector<ChainPoint> points = seen_here(here, lower.points_);
    lower.points_ = lower.seen_here(there, points_);
    points_ = std::move(points);
    theta_ = std::move(here);
    lower.theta_ = std::move(there);
  } catch (const Error&) {
    return 0;
  }
  return probability;
}

VectorXd Chain::normals(std::size_t kind, Index count) const {
  return drawn(setting_.seed, number_, iteration_, kind, count);
}

double Chain::uniform(std::size_t kind) const { return normal_probability(normals(kind, 1)[0]); }

double Chain::log_weight() const {
  double sum = log_standard_normal(theta_.phi) - setting_.reference.log_density(theta_.phi);
  for (const ChainPoint& point : points_) sum += point.weight.value;
  return sum;
}

double Chain::log_likelihood() const {
  double sum = 0;
  for (const ChainPoint& point : points_) sum += point.shot.log_likelihood;
  return sum;
}

std::optional<ChainPoint> Chain::point(std::size_t specimen, const ThetaPoint& theta, std::size_t component, VectorXd v,
                                       bool passing) {
  ++evaluations_;
  ChainPoint at{component, std::move(v), {}, {}, {}};
  std::optional<VectorXd> z = power_ == 0 ? at.v : draw_of(setting_, specimen, theta, component, at.v, passing);
  if (!z) return std::nullopt;
  at.z = std::move(*z);
  std::optional<Specimen::Shot> shot = setting_.specimens[specimen].shoot(theta.models[specimen], at.z);
  if (!shot) return std::nullopt;
  at.shot = std::move(*shot);
  if (power_ == 0 || (passing && setting_.move.fits_data)) return at;
  at.weight = log_weight_of(setting_, specimen, theta, power_, component, at.z, at.shot);
  if (!std::isfinite(at.weight.value)) return std::nullopt;
  return at;
}

VectorXd Chain::gradient(std::size_t specimen, const ChainPoint& at) const {
  const Specimen& of = setting_.specimens[specimen];
  const Specimen::Model& model = theta_.models[specimen];
  const std::vector<LinearAt>& linear = theta_.linear[specimen];
  if (setting_.is_fitted(at.component)) return fitted_kick(of, model, linear.front(), at.z, at.shot);
  if (setting_.move.fits_data) return VectorXd::Zero(at.v.size());  // wide laws, which jumps come to and leave
  const LogWeight& weight = at.weight;
  const std::vector<Component>& components = setting_.reference.components[specimen];
  VectorXd by_z = -power_ * of.transposed(model, at.shot, at.shot.residual);
  for (std::size_t m = 0, first = 0; m < weight.residuals.size(); ++m) {
    while (components[first].mode != m) ++first;
    // Jᵀ(Jz + c) Σ responsibility/width², J = width·J of the first.
    double sum = 0;
    for (std::size_t c = first; c < components.size(); ++c)
      if (components[c].mode == m)
        sum += weight.responsibilities[static_cast<Index>(c)] * power_ / (components[c].width * components[c].width);
    by_z += linear[first].transposed(components[first].width / std::sqrt(power_) * sum * weight.residuals[m]);
  }
  return linear[at.component].pull_back(by_z);
}

// Rotations of (v, η) by the angle of a step, which leave N(0, I) invariant, between kicks of η by the gradient of the
// log weight: reversible, and of the volume of (v, η).
double Chain::energy(const ChainPoint& at, const VectorXd& eta) {
  return -at.weight.value + 0.5 * at.v.squaredNorm() + 0.5 * eta.squaredNorm();
}

std::optional<TrajectoryPoint> Chain::step(std::size_t specimen, const TrajectoryPoint& from, double angle,
                                           bool passing) {
  VectorXd eta = from.eta + 0.5 * angle * from.kick;
  VectorXd turned = std::cos(angle) * from.at.v + std::sin(angle) * eta;
  eta = std::cos(angle) * eta - std::sin(angle) * from.at.v;
  auto next = point(specimen, theta_, from.at.component, std::move(turned), passing);
  if (!next) return std::nullopt;
  VectorXd kick = VectorXd::Zero(eta.size());
  if (setting_.move.uses_gradient) kick = gradient(specimen, *next);
  eta += 0.5 * angle * kick;
  const double energy = Chain::energy(*next, eta);
  return TrajectoryPoint{std::move(*next), std::move(eta), std::move(kick), energy};
}

void Chain::move_path(std::size_t specimen, bool adapting) {
  const std::size_t kind = kFirstTheta + kKindsOfSpecimen * (specimen + 1);
  const ChainPoint& from = points_[specimen];
  VectorXd eta = normals(kind + 1, from.v.size());
  VectorXd kick = VectorXd::Zero(eta.size());
  if (setting_.move.uses_gradient) kick = gradient(specimen, from);
  const double energy = Chain::energy(from, eta);
  TrajectoryPoint at{from, std::move(eta), std::move(kick), energy};
  double probability = 0, of_kicks = 0;  // of_kicks: without what no kick sees, to which steps cannot adapt
  if (setting_.move.until_it_turns) {
    const double angle = std::exp(log_angle_);
    const VectorXd uniforms = normals(kind + 2, Index{2} << kMostDoublings).unaryExpr(&normal_probability);
    NoUTurn trajectory(
        [&](const TrajectoryPoint& of, int direction) { return step(specimen, of, direction * angle, false); },
        uniforms, kMostDoublings);
    points_[specimen] = trajectory.draw(at);
    probability = of_kicks = trajectory.acceptance();
  } else {
    // Steps of different lengths, so that no trajectory is periodic.
    const double angle = std::exp(log_angle_) * (0.8 + 0.4 * uniform(kind));
    const int steps = setting_.move.uses_gradient
                          ? std::clamp(static_cast<int>(std::lround(kQuarterTurn / angle)), 1, kMostKicks)
                          : 1;
    bool lost = false;
    for (int count = 0; count < steps && !lost; ++count) {
      auto next = step(specimen, at, angle, count + 1 < steps);
      lost = !next;
      if (!lost) at = std::move(*next);
    }
    if (!lost && !std::isnan(at.energy)) {
      const LogWeight &begin = from.weight, &end = at.at.weight;
      const double not_kicked = end.value - end.kicked - begin.value + begin.kicked;
      probability = std::min(1.0, std::exp(energy - at.energy));
      of_kicks = std::min(1.0, std::exp(energy - at.energy - not_kicked));
    }
    if (uniform(kind + 2) < probability) points_[specimen] = std::move(at.at);
  }
  if (!adapting) {
    accepted_ += probability;
    ++moves_;
  } else {
    log_angle_ +=
        (of_kicks - setting_.move.target_acceptance) / std::pow(static_cast<double>(iteration_ + 1), kAdaptation);
    log_angle_ = std::clamp(log_angle_, std::log(kLeastAngle), std::log(kQuarterTurn));
  }
}

// Independent draws of the reference, as many as are shot at the cost of few, of which by their weights one is taken,
// or none: iterated sampling importance resampling (C. Andrieu, A. Lee and M. Vihola, Bernoulli 24, 2018). Of one draw
// it is Metropolis' rule.
void Chain::jump(std::size_t specimen, bool adapting) {
  const std::size_t kind = kFirstTheta + kKindsOfSpecimen * (specimen + 1) + 3;
  ChainPoint& here = points_[specimen];
  const bool useless = !adapting && static_cast<double>(jumped_) < kFewJumps * static_cast<double>(jumps_);
  const Index count =
      useless ? 1 : posterior::ShotBatch(setting_.specimens[specimen], theta_.models[specimen]).at_once();
  const MatrixXd v = normals(kind + 1, count * here.v.size()).reshaped(here.v.size(), count);
  const SpecimenDraws draws =
      specimen_draws(setting_, specimen, theta_, power_, setting_.reference.log_weights[specimen],
                     normals(kind, count).unaryExpr(&normal_probability), v);
  evaluations_ += count;
  const double largest = std::max(draws.log_weights.maxCoeff(), here.weight.value);
  const ArrayXd weights = (draws.log_weights.array() - largest).exp();
  const double own = std::exp(here.weight.value - largest);
  double left = uniform(kind + 2) * (count > 1 ? own + weights.sum() : own);
  Index taken = 0;
  while (taken < count && left >= weights[taken]) left -= weights[taken++];
  if (adapting) ++jumps_;
  if (taken == count) return;
  ChainPoint next{draws.components[static_cast<std::size_t>(taken)], v.col(taken), draws.z.col(taken), {}, {}};
  auto shot = setting_.specimens[specimen].shoot(theta_.models[specimen], next.z);
  ++evaluations_;
  if (!shot) return;
  next.shot = std::move(*shot);
  next.weight = log_weight_of(setting_, specimen, theta_, power_, next.component, next.z, next.shot);
  if (!std::isfinite(next.weight.value)) return;
  here = std::move(next);
  if (adapting) ++jumped_;
}

void Chain::move_theta(int turn, bool adapting) {
  const Index k = setting_.space.count();
  const std::size_t kind =
      kFirstTheta + kKindsOfSpecimen * (setting_.specimens.size() + 1) + 2 * static_cast<std::size_t>(turn);
  const VectorXd eta = normals(kind, k);
  // Draws that fit their data weigh nearly alike for all θ: so φ rotates within a law that is wider than its own, so
  // that it does not stay in tails.
  const bool rotates = setting_.move.fits_data;
  const MatrixXd root = (rotates ? kWider : 1) * root_;
  const auto lower = root.triangularView<Eigen::Lower>();
  const double scale = std::exp(log_scale_);
  const VectorXd white = lower.solve(theta_.phi - centre_);
  const VectorXd turned =
      rotates ? VectorXd(std::cos(scale) * white + std::sin(scale) * eta) : VectorXd(white + scale * eta);
  const VectorXd phi = centre_ + VectorXd(lower * turned);
  double probability = 0;
  std::vector<ChainPoint> next;
  ThetaPoint theta;
  try {
    theta = make_theta(setting_, phi, power_);
    double change = log_standard_normal(phi) - log_standard_normal(theta_.phi);
    if (rotates) change += 0.5 * (turned.squaredNorm() - white.squaredNorm());
    for (std::size_t i = 0; i < points_.size(); ++i) {
      auto moved = point(i, theta, points_[i].component, points_[i].v);
      if (!moved) break;
      change += moved->weight.value - points_[i].weight.value;
      next.push_back(std::move(*moved));
    }
    if (next.size() == points_.size()) probability = std::min(1.0, std::exp(change));
  } catch (const Error&) {
    probability = 0;
  }
  if (uniform(kind + 1) < probability) {
    theta_ = std::move(theta);
    points_ = std::move(next);
  }
  if (adapting) {
    log_scale_ += (probability - kThetaAcceptance) / std::pow(static_cast<double>(iteration_ + 1), kAdaptation);
    if (rotates) log_scale_ = std::min(log_scale_, std::log(kQuarterTurn));
  } else {
    theta_accepted_ += probability;
    ++theta_moves_;
  }
}

// Halfway through the warm-up the moves of φ take the mean and covariance of the second quarter of it.
void Chain::learn(int warmup) {
  const Index k = setting_.space.count();
  const auto done = static_cast<Index>(iteration_);
  if (visited_.cols() != warmup) visited_.resize(k, warmup);
  if (done < warmup) visited_.col(done) = theta_.phi;
  const Index first = warmup / 4, last = warmup / 2;
  if (done != last || last - first < 20 * k) return;
  const MatrixXd some = visited_.middleCols(first, last - first);
  const VectorXd mean = some.rowwise().mean();
  const MatrixXd centred = some.colwise() - mean;
  const MatrixXd of_reference = setting_.reference.root * setting_.reference.root.transpose();
  const double weight = 5.0 / (5.0 + static_cast<double>(last - first));
  const Eigen::LLT<MatrixXd> factors(MatrixXd(
      (1 - weight) / static_cast<double>(last - first) * centred * centred.transpose() + weight * of_reference));
  if (factors.info() != Eigen::Success) return;
  root_ = factors.matrixL();
  centre_ += (1 - weight) * (mean - centre_);
}

void Chain::advance(int warmup) {
  if (power_ == 0) {
    redraw();
    ++iteration_;
    return;
  }
  const bool adapting = iteration_ < static_cast<std::uint64_t>(warmup);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    move_path(i, adapting);
    jump(i, adapting);
  }
  if (setting_.space.count() > 0) {
    for (int turn = 0; turn < (setting_.move.fits_data ? 1 : kThetaMoves); ++turn) move_theta(turn, adapting);
    if (adapting) learn(warmup);
  }
  ++iteration_;
}

}  // namespace pulson::inference
