// The search for the numbers of a model of greatest evidence by Laplace's approximation.

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Cholesky>

#include "fitter.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kGroupRange = 8;    // of logarithms of variances
constexpr double kWidthRange = 2.1;  // of the logarithm of the kernel's width: a factor of 8
constexpr double kOtherRange = 3.4;  // of other logarithms: a factor of 30
// Of coordinates for differences: a part of a standard deviation, within limits.
constexpr double kPart = 0.2, kFirstDifference = 0.05, kLeastDifference = 0.01, kMostDifference = 0.25;
constexpr double kLevels[] = {1.5, 2.7, 0.5, 0};  // of noise, of log(1 + v/v₀): amplitudes of 4.6, 9, 2 and 0 σ
constexpr int kRoundsOfWidth = 5;                 // of the alternation, by which widths are compared
constexpr double kNear = 0.05;                    // nats, at which a climb ends: a chart of the evidence finds the rest
constexpr double kLongest = 1;                    // of a step of Newton's method, in each coordinate

// Momenta and increments, of any numbers of the model.
VectorXd joined(const matching::MatchingObjective& objective, const VectorXd& z) {
  const Points momenta = objective.momenta(z);
  const MatrixXd increments = objective.increments(z);
  VectorXd all(momenta.size() + increments.size());
  all << momenta.reshaped(), increments.reshaped();
  return all;
}

VectorXd unknowns_of(const matching::MatchingObjective& objective, const VectorXd& joined) {
  const Points& source = objective.problem().source;
  const int steps = objective.problem().grid.steps;
  return objective.white(
      joined.head(source.size()).reshaped(source.rows(), source.cols()),
      joined.tail(joined.size() - source.size()).reshaped((joined.size() - source.size()) / steps, steps));
}

MatrixXd covariance_of(const Linearised& match) {
  return squared(match.jacobian) + MatrixXd::Identity(match.jacobian.rows(), match.jacobian.rows());
}

}  // namespace

double Fitter::variance(const State& state, Index group) const {
  if (lambda_open_ && group == 0) return 1 / state.lambda;
  return std::pow(state.parameters[amplitudes_[at(group - (lambda_open_ ? 1 : 0))]], 2);
}

// Each number of the model on a scale on which the evidence is nearly quadratic: log(1 + v/v₀) of variances, with
// v₀ a few times that of σ², from 0 where noise vanishes; the logarithm of others.
VectorXd Fitter::place(const State& state) const {
  VectorXd x(numbers_open());
  Index i = 0;
  for (; i < groups(); ++i) x[i] = std::log1p(variance(state, i) / units_[i]);
  if (settings_.fit_width) x[i++] = std::log(state.width);
  for (const Index other : others_) x[i++] = std::log(state.parameters[other]);
  return x;
}

// The numbers at another place, and the matches there. @throws Error where there is none
Fitter::State Fitter::moved(const State& from, const VectorXd& to) {
  State state = from;
  VectorXd u(groups());
  Index i = 0;
  for (; i < groups(); ++i) u[i] = std::log(units_[i] * std::max(std::expm1(to[i]), kNegligible) / variance(from, i));
  std::vector<VectorXd> z = rescale(state, u);
  if (settings_.fit_width) {
    const matching::MatchingObjective before = objective(state);
    state.width = std::exp(to[i++]);
    if (state.width != from.width) {
      const matching::MatchingObjective after = objective(state);
      const auto to_new_basis = [&](VectorXd& of_shape) {
        of_shape = after.white(before.momenta(of_shape), before.increments(of_shape));
      };
      std::for_each(z.begin(), z.end(), to_new_basis);
      for (Linearised& match : state.matches) to_new_basis(match.at.z);
    }
  }
  for (const Index other : others_) state.parameters[other] = std::exp(to[i++]);
  const matching::MatchingObjective here = objective(state);
  std::vector<VectorXd> foretold = known_.at(to);
  for (VectorXd& of_shape : foretold) of_shape = unknowns_of(here, of_shape);
  match(state, z, false, foretold);
  std::vector<VectorXd> of_shapes;
  for (const Linearised& found : state.matches) of_shapes.push_back(joined(here, found.at.z));
  known_.add(to, std::move(of_shapes));
  return state;
}

Box Fitter::everywhere(const State& start) const {
  const VectorXd x = place(start);
  Box box{x.array() - kOtherRange, x.array() + kOtherRange};
  box.least.head(groups()).setConstant(std::log1p(kNegligible));
  box.most.head(groups()).array() = x.head(groups()).array() + kGroupRange;
  if (settings_.fit_width) {
    box.least[groups()] = -kWidthRange;
    box.most[groups()] = kWidthRange;
  }
  return box;
}

// The gradient of the evidence, and Fisher's information of the model linear about the matches, in the coordinates of
// place(), by differences to one side: with C_i the derivative of C, Σ ½ tr C⁻¹C_i C⁻¹C_j over the shapes.
SecondOrder Fitter::second_order(const State& here, const Box& box, const VectorXd& steps) {
  const VectorXd x = place(here);
  const Index n = x.size();
  const auto shapes = static_cast<int>(here.matches.size());
  SecondOrder model{VectorXd(n), MatrixXd(n, n)};
  std::vector<MatrixXd> parts(at(n * shapes));  // L⁻¹ C_i L⁻ᵀ with C = LLᵀ
  for (Index i = 0; i < n; ++i) {
    const double h = x[i] + steps[i] <= box.most[i] ? steps[i] : -steps[i];
    const State aside = moved(here, x + h * VectorXd::Unit(n, i));
    model.gradient[i] = (aside.log_evidence() - here.log_evidence()) / h;
    parallel_for(shapes, [&](int s) {
      const MatrixXd middle = covariance_of(here.matches[at(s)]);
      const auto lower = middle.llt();
      const MatrixXd half = lower.matrixL().solve(MatrixXd(covariance_of(aside.matches[at(s)]) - middle));
      parts[at(i * shapes + s)] = lower.matrixL().solve(MatrixXd(half.transpose())) / h;
    });
  }
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j <= i; ++j) {
      double both = 0;
      for (Index s = 0; s < shapes; ++s)
        both += 0.5 * parts[at(i * shapes + s)].cwiseProduct(parts[at(j * shapes + s)]).sum();
      model.information(i, j) = model.information(j, i) = both;
    }
  return model;
}

// Fisher scoring.
Fitter::State Fitter::climb(const State& from, const Box& box, NewtonOptions options) {
  State best = from;
  double greatest = from.log_evidence();
  const auto value = [&](const VectorXd& x) {
    try {
      State state = x == place(best) ? best : moved(best, x);
      const double here = state.log_evidence();
      if (here > greatest) {
        greatest = here;
        best = std::move(state);
      }
      return here;
    } catch (const Error&) {
      return -std::numeric_limits<double>::infinity();
    }
  };
  VectorXd steps = VectorXd::Constant(numbers_open(), kFirstDifference);
  const auto model = [&](const VectorXd& /*x*/) {
    SecondOrder here = second_order(best, box, steps);
    steps = (kPart * here.information.diagonal().cwiseSqrt().cwiseInverse())
                .cwiseMax(kLeastDifference)
                .cwiseMin(kMostDifference);
    return here;
  };
  options.longest_step = kLongest;
  options.tolerance = kNear;
  bool converged = false;
  try {
    converged = maximise_in_box(value, model, box, place(from), options).converged;
  } catch (const Error&) {
    // no path at some place beside the best
  }
  best.converged = converged && best.all_matched();
  return best;
}

// Alternating between matches and amplitudes, which holds the matches' slopes fixed, comes near the maximum of the
// evidence. Where the kernel is much too wide, matches do not converge and no slope leads to a better width, so that
// the best of those a factor of 2 apart is taken.
Fitter::State Fitter::best_start() const {
  const auto improved = [&](State state) { return improve(state) ? alternate(state, kMostAlternations) : state; };
  if (!settings_.fit_width) return improved(alternate(start(1), kMostAlternations));
  const auto at_width = [&](double width) -> std::optional<State> {
    try {
      return alternate(start(width), kRoundsOfWidth);
    } catch (const NumericalError&) {
      return std::nullopt;
    }
  };
  std::optional<State> best = at_width(1);
  for (const double factor : {0.5, 2.0})
    for (double width = factor; std::abs(std::log(width)) < kWidthRange; width *= factor) {
      std::optional<State> next = at_width(width);
      if (best && (!next || !(next->log_evidence() > best->log_evidence()))) break;
      if (next) best = std::move(next);
    }
  return improved(best ? *best : alternate(start(1), kMostAlternations));
}

// Where the evidence may be greatest: near the start, and, as Laplace's evidence falls with the noise where that of the
// samples does not, at the best of each of some levels of noise, from none up to ten times sigma.
std::vector<Fitter::State> Fitter::climbed(const State& start) {
  const Box box = everywhere(start);
  std::vector<State> found{climb(start, box)};
  if (amplitudes_.empty()) return found;
  double greatest = found.front().log_evidence();
  const Index first = lambda_open_ ? 1 : 0;
  State nearest = start;
  for (const double level : kLevels) {
    Box held = box;
    held.least.segment(first, groups() - first) = box.least.segment(first, groups() - first).cwiseMax(level);
    held.most.segment(first, groups() - first) = held.least.segment(first, groups() - first);
    if (place(found.front()) == held.clipped(place(found.front()))) continue;  // where no noise is the likeliest
    try {
      NewtonOptions options;
      options.least = greatest - kHopeless;
      nearest = climb(moved(nearest, held.clipped(place(nearest))), held, options);
      greatest = std::max(greatest, nearest.log_evidence());
      found.push_back(nearest);
    } catch (const Error&) {
      // no path with so much noise
    }
  }
  return found;
}

bool Fitter::is_large() const { return std::ssize(observations_) >= 2 * kFew; }

// kFew of the shapes, evenly spaced.
Cohort Fitter::part() const {
  Cohort part{cohort_.source, {}, cohort_.alignment};
  for (int i = 0; i < kFew; ++i) part.targets.push_back(cohort_.targets[at(i * std::ssize(cohort_.targets) / kFew)]);
  return part;
}

// Of all shapes, with the numbers of some.
Fitter::State Fitter::with_numbers_of(const State& of_few) const {
  State state;
  state.lambda = of_few.lambda;
  state.width = of_few.width;
  state.parameters = of_few.parameters;
  match(state, std::vector<VectorXd>(observations_.size(), VectorXd::Zero(objective(state).unknowns())), true);
  return state;
}

// Where a large cohort's numbers are is first asked of a part of it.
std::vector<Fitter::State> Fitter::candidates() {
  if (!is_large()) {
    State start = best_start();
    if (numbers_open() == 0) return {start};
    find_variances(start);
    find_units(start);
    return climbed(start);
  }
  const Cohort few = part();
  Fitter of_few(few, noise_, settings_);
  std::vector<State> of_part = of_few.candidates();
  units_ = of_few.units_;
  std::sort(of_part.begin(), of_part.end(),
            [](const State& a, const State& b) { return a.log_evidence() > b.log_evidence(); });
  const State start = with_numbers_of(of_part.front());
  if (numbers_open() == 0) return {start};
  std::vector<State> found{climb(start, everywhere(start))};
  // The part's numbers are deviations of its own from those of all, so the likeliest are climbed from.
  std::size_t greatest = 0;
  const double least = of_part.front().log_evidence() - kHopeless;
  for (std::size_t i = 1; i < of_part.size() && of_part[i].log_evidence() > least; ++i) try {
      found.push_back(moved(start, of_few.place(of_part[i])));
      if (found.back().log_evidence() > found[greatest].log_evidence()) greatest = found.size() - 1;
    } catch (const Error&) {
      // no path for one of the others
    }
  if (greatest > 0) found[greatest] = climb(found[greatest], everywhere(start));
  return found;
}

}  // namespace pulson::compare
