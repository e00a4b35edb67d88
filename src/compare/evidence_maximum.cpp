#include "evidence_maximum.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Nats of Laplace's evidence that draws may take off again: what they add is alike (12.0 and 12.2 nats of 20 shapes
// without noise and with much, of 10 shapes 1.0 and 1.3).
constexpr double kNotMadeUp = 2;
constexpr double kStencil = 0.7;  // standard deviations: a third derivative enters by its half, draws' errors by 1/0.7
constexpr double kLeastStencil = 1e-3;  // of x, whatever the metric has: it is of logarithms, at most kStencil
// Of the metric's: the linear models' curvature is right to a factor of a few, or the number is not determined.
constexpr double kLeastOfMetric = 0.1, kMostOfMetric = 100;
// Eight steps cross a factor e⁸ of any number; where an eighth of one does not rise, the draws' errors are its slope.
constexpr int kMostSteps = 8, kMostHalvings = 4;
// Nats that the slope may promise where the evidence itself no longer rises: a second derivative, of which differences
// have some, promised 0.02 of six shapes of five landmarks about their mean, whose width is hardly determined.
constexpr double kPromised = 0.1;
constexpr int kMostOutward = 6;  // places at which an end is sought
constexpr double kAtEnd = 0.1;   // nats: within 0.05 deviations of an end
constexpr double kFarthest = 3;  // times the distance at which a parabola ends

double upper_tail(double x) { return 0.5 * std::erfc(x / std::numbers::sqrt2); }

MatrixXd inverse_of(const MatrixXd& information) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(information);
  const VectorXd sizes = axes.eigenvalues().cwiseAbs().cwiseMax(1e-9 * axes.eigenvalues().cwiseAbs().maxCoeff());
  return axes.eigenvectors() * sizes.cwiseInverse().asDiagonal() * axes.eigenvectors().transpose();
}

// Variances of the maximum by the draws, each group of which moves it by a Newton step; numbers at a bound stay there.
VectorXd variances_by_draws(const LocalEvidence& local, const Box& box) {
  VectorXd variances = VectorXd::Zero(local.x.size());
  const Index groups = local.gradients_without_group.cols();
  std::vector<Index> free;
  for (Index i = 0; i < local.x.size(); ++i)
    if (local.x[i] > box.least[i] && local.x[i] < box.most[i]) free.push_back(i);
  if (groups < 2 || free.empty()) return variances;
  const MatrixXd moves =
      inverse_of(local.slope.information(free, free)) * local.gradients_without_group(free, Eigen::all);
  variances(free) = (moves.colwise() - moves.rowwise().mean()).rowwise().squaredNorm() *
                    (static_cast<double>(groups - 1) / static_cast<double>(groups));
  return variances;
}

}  // namespace

double reach_of_differences(const MatrixXd& metric, Index number) {
  return std::clamp(kStencil / std::sqrt(std::max(metric(number, number), 1e-6)), kLeastStencil, kStencil);
}

LocalEvidence evidence_about(const EvidenceAt& evidence, const VectorXd& x, const Evidence& here,
                             const MatrixXd& metric, const Box& box) {
  const Index n = x.size(), groups = here.without_group.size();
  LocalEvidence local{
      x, here, {here.value, VectorXd::Zero(n), MatrixXd::Zero(n, n)}, VectorXd::Zero(n), MatrixXd::Zero(n, groups)};
  VectorXd curvatures(n);
  for (Index i = 0; i < n; ++i) {
    const double by_metric = std::max(metric(i, i), 1e-6);
    const double h = reach_of_differences(metric, i);
    const auto beside = [&](double step) -> std::optional<Evidence> {
      const VectorXd to = x + step * VectorXd::Unit(n, i);
      if (to[i] < box.least[i] || to[i] > box.most[i]) return std::nullopt;
      return evidence(to);
    };
    const std::optional<Evidence> above = beside(h), below = beside(-h);
    curvatures[i] = by_metric;
    if (above && below) {
      local.slope.gradient[i] = (above->value - below->value) / (2 * h);
      local.gradients_without_group.row(i) = (above->without_group - below->without_group) / (2 * h);
      local.curvatures[i] = (2 * here.value - above->value - below->value) / (h * h);
      curvatures[i] = std::clamp((2 * here.value - above->value - below->value) / (h * h), kLeastOfMetric * by_metric,
                                 kMostOfMetric * by_metric);
    } else if (above || below) {
      const Evidence& aside = above ? *above : *below;
      const double step = above ? h : -h;
      local.slope.gradient[i] = (aside.value - here.value) / step + 0.5 * step * by_metric;
      local.gradients_without_group.row(i) =
          ((aside.without_group - here.without_group) / step).array() + 0.5 * step * by_metric;
    }
  }
  // The correlations are the metric's.
  const VectorXd scale = curvatures.cwiseQuotient(metric.diagonal().cwiseMax(1e-6)).cwiseSqrt();
  local.slope.information = scale.asDiagonal() * metric * scale.asDiagonal();
  local.slope.information.diagonal() = curvatures;
  return local;
}

namespace {

// B of −∇², updated by the changes of x and of the gradient.
class Information {
 public:
  explicit Information(MatrixXd metric) : b_(std::move(metric)) {}

  const MatrixXd& now() const { return b_; }

  const MatrixXd& at(const VectorXd& x, const VectorXd& gradient) {
    if (x_.size() > 0) update(x - x_, gradient_ - gradient);
    x_ = x;
    gradient_ = gradient;
    return b_;
  }

 private:
  void update(const VectorXd& moved, VectorXd fall) {
    const VectorXd image = b_ * moved;
    const double expected = moved.dot(image), found = moved.dot(fall);
    if (!(expected > 0)) return;
    if (found < kLeastPart * expected) fall += (kLeastPart * expected - found) / (expected - found) * (image - fall);
    b_ += fall * fall.transpose() / fall.dot(moved) - image * image.transpose() / expected;
  }

  static constexpr double kLeastPart = 0.2;  // Powell's
  MatrixXd b_;
  VectorXd x_, gradient_;  // of the last call
};

}  // namespace

std::optional<EvidenceMaximum> maximise_evidence(const EvidenceAt& evidence, const GradientAt& gradient,
                                                 const VectorXd& start, const MatrixXd& metric, const Box& box) {
  // The evidence where it was asked for last: there the gradient is wanted next.
  std::optional<Evidence> last = evidence(box.clipped(start));
  if (!last) return std::nullopt;
  EvidenceMaximum best;
  Information information(metric);
  bool has_gradient = true, any = false, are_known = true;  // the latter two: of what was asked for since
  const auto value = [&](const VectorXd& x) {
    last = evidence(x);
    any = true;
    are_known = are_known && last.has_value();
    return last ? last->value : -std::numeric_limits<double>::infinity();
  };
  const auto model = [&](const VectorXd& x) -> SecondOrder {
    best.x = x;
    best.here = *last;
    any = false;
    are_known = true;
    const std::optional<VectorXd> slope = gradient(x, information.now());
    has_gradient = slope.has_value();
    if (!slope) return {last->value, VectorXd::Zero(x.size()), metric};
    best.information = information.at(x, *slope);
    return {last->value, *slope, best.information};
  };
  const matching::NewtonMaximum found = maximise_by_newton(
      value, model, box, start, {.tolerance = kAtMaximum, .most_steps = kMostSteps, .most_halvings = kMostHalvings});
  if (best.information.size() == 0) best.information = metric;
  best.converged = has_gradient && (found.converged || (any && are_known && found.gain < kPromised));
  return best;
}

BestPlace best_place(const std::vector<PlaceEvidence>& places) {
  std::optional<std::size_t> known, unknown;  // the best of those that draws determine, and by Laplace's of the others
  for (std::size_t i = 0; i < places.size(); ++i) {
    const PlaceEvidence& place = places[i];
    if (place.by_draws) {
      if (!known || *place.by_draws > *places[*known].by_draws) known = i;
    } else if (!unknown || place.laplace > places[*unknown].laplace) {
      unknown = i;
    }
  }
  if (known && (!unknown || places[*unknown].laplace <= places[*known].laplace + kNotMadeUp)) return {*known, true};
  const auto less = [](const PlaceEvidence& a, const PlaceEvidence& b) { return a.laplace < b.laplace; };
  return {static_cast<std::size_t>(std::max_element(places.begin(), places.end(), less) - places.begin()), false};
}

double drop_of_ninety(double from_bound) {
  const double d = std::max(from_bound, 1e-9);
  if (d * d >= 2 * kDropOfNinety) return kDropOfNinety;
  double low = 1.6, high = 2 * kDropOfNinety;
  for (int i = 0; i < 40; ++i) {
    const double c = (low + high) / 2;
    const double second = d * d < c ? (c + d * d) / (2 * d) : std::sqrt(c);
    (upper_tail(std::sqrt(c)) + upper_tail(second) > 0.1 ? low : high) = c;
  }
  return low / 2;
}

Intervals find_intervals(const EvidenceAt& evidence, const LocalEvidence& maximum, const Box& box,
                         const std::vector<char>& near_bound) {
  const Index n = maximum.x.size();
  constexpr double kNowhere = std::numeric_limits<double>::infinity();
  Intervals intervals{VectorXd::Constant(n, -kNowhere), VectorXd::Constant(n, kNowhere)};
  const MatrixXd covariance = inverse_of(maximum.slope.information);
  const VectorXd by_draws = variances_by_draws(maximum, box);
  for (Index i = 0; i < n; ++i)
    for (const int direction : {-1, 1}) {
      const double deviation = std::sqrt(covariance(i, i));
      const VectorXd along = covariance.col(i) / covariance(i, i);
      const double bound = direction < 0 ? box.least[i] : box.most[i];
      const double wider = 1 + by_draws[i] / covariance(i, i);
      const auto wanted = [&](double t) {
        const double distance = (maximum.x[i] + direction * t - box.least[i]) / deviation;
        return wider * (near_bound[static_cast<std::size_t>(i)] ? drop_of_ninety(distance) : kDropOfNinety);
      };
      // How far the evidence has fallen at a distance t, beyond what is wanted.
      const auto excess = [&](double t) -> std::optional<double> {
        VectorXd to = box.clipped(maximum.x + direction * t * along);
        to[i] = std::clamp(maximum.x[i] + direction * t, box.least[i], box.most[i]);
        const std::optional<Evidence> there = evidence(to);
        if (!there) return std::nullopt;
        return maximum.here.value - there->value - wanted(t);
      };
      const double most = direction * (bound - maximum.x[i]);
      const double first = std::sqrt(2 * wanted(0)) * deviation;
      double inside = 0, at_inside = -wanted(0), outside = kNowhere, at_outside = kNowhere;
      double t = std::min(first, most);
      double end = first;
      for (int count = 0; count < kMostOutward; ++count) {
        const std::optional<double> there = excess(t);
        if (!there) break;  // no evidence so far: that of the parabola
        end = t;
        if (std::abs(*there) <= kAtEnd) break;
        (*there < 0 ? inside : outside) = t;
        (*there < 0 ? at_inside : at_outside) = *there;
        if (*there < 0 && t >= most) {
          end = kNowhere;
          break;
        }
        if (std::isfinite(outside)) {
          // The drop is about t²: its root is about a line.
          const double of_inside = std::sqrt(std::max(at_inside + wanted(inside), 0.0));
          const double of_outside = std::sqrt(at_outside + wanted(outside));
          const double root = std::sqrt(wanted(t));
          t = inside + (outside - inside) * std::clamp((root - of_inside) / (of_outside - of_inside), 0.1, 0.9);
          end = t;
        } else {
          t = std::min({1.6 * t, most, kFarthest * first});
          if (t <= inside) break;
        }
      }
      if (std::isfinite(end)) (direction < 0 ? intervals.low : intervals.high)[i] = maximum.x[i] + direction * end;
    }
  return intervals;
}

}  // namespace pulson::compare
