#include "evidence_maximum.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Nats of Laplace's evidence that draws may take off again: what they add is alike (12.0 and 12.2 nats of 20 shapes
// without noise and with much, of 10 shapes 1.0 and 1.3).
constexpr double kNotMadeUp = 2;
constexpr double kStencil = 0.7;  // standard deviations: a third derivative enters by its half, draws' errors by 1/0.7
// Nats on both sides together, four times those of that many deviations: the metric has the number less determined than
// it is, so that the step is shortened, to no less than a part. (Of six shapes of five landmarks an evidence falls by
// 20 where the width doubles, of which linear models know nothing.)
constexpr double kMostFall = 4 * kStencil * kStencil, kLeastOfStencil = 0.1;
constexpr double kNearer = 0.3;  // of the step, where one side has no evidence
// Of the metric's: the linear models' curvature is right to a factor of a few, or the number is not determined.
constexpr double kLeastOfMetric = 0.1, kMostOfMetric = 100;
constexpr int kMostOutward = 6;  // places at which an end is sought
constexpr double kAtEnd = 0.5;   // nats: within 0.2 deviations of an end; of log cosh a line leaves a quarter of that
constexpr double kFarthest = 3;  // times the distance at which a parabola ends

}  // namespace

double jackknife_variance(const VectorXd& without_group) {
  const auto count = static_cast<double>(without_group.size());
  if (count < 2) return 0;
  return (count - 1) / count * (without_group.array() - without_group.mean()).square().sum();
}

double fall_between(const Evidence& greatest, const Evidence& there) {
  const double fall = greatest.value - there.value;
  if (!(fall > 0) || greatest.without_group.size() == 0 || there.without_group.size() == 0) return fall;
  return fall / (1 + jackknife_variance(greatest.without_group - there.without_group) / (2 * fall));
}

namespace {

double upper_tail(double x) { return 0.5 * std::erfc(x / std::numbers::sqrt2); }

MatrixXd inverse_of(const MatrixXd& information) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(information);
  const VectorXd sizes = axes.eigenvalues().cwiseAbs().cwiseMax(1e-9 * axes.eigenvalues().cwiseAbs().maxCoeff());
  return axes.eigenvectors() * sizes.cwiseInverse().asDiagonal() * axes.eigenvectors().transpose();
}

// Directions in which differences are taken, a column each of about one deviation: the axes of the metric, of numbers
// that a bound leaves no room for each by itself, no farther than to the bound if that is not near.
MatrixXd axes_of(const MatrixXd& metric, const VectorXd& x, const Box& box) {
  const Index n = x.size();
  MatrixXd axes = MatrixXd::Zero(n, n);
  std::vector<Index> inside;
  for (Index i = 0; i < n; ++i) {
    const double deviation = std::min(1 / std::sqrt(metric(i, i)), 1.0);
    const double room = std::min(x[i] - box.least[i], box.most[i] - x[i]);
    axes(i, i) = deviation;
    if (room > kStencil * deviation)
      inside.push_back(i);
    else if (room > kNearer * kStencil * deviation)
      axes(i, i) = 0.999 * room / kStencil;  // of which rounding leaves both sides inside
  }
  if (inside.empty()) return axes;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(metric(inside, inside));
  MatrixXd of_inside = solver.eigenvectors() * solver.eigenvalues().cwiseSqrt().cwiseInverse().asDiagonal();
  for (auto axis : of_inside.colwise()) axis /= std::max(axis.cwiseAbs().maxCoeff(), 1.0);
  axes(inside, inside) = of_inside;
  return axes;
}

}  // namespace

LocalEvidence evidence_about(const EvidenceAt& evidence, const VectorXd& x, const Evidence& here,
                             const MatrixXd& metric, const Box& box) {
  const Index n = x.size(), groups = here.without_group.size();
  const MatrixXd axes = axes_of(metric, x, box);
  const MatrixXd expected = axes.transpose() * metric * axes;
  VectorXd slopes = VectorXd::Zero(n), bends = expected.diagonal();
  MatrixXd slopes_without_group = MatrixXd::Zero(n, groups);
  std::vector<char> is_measured(static_cast<std::size_t>(n));
  for (Index i = 0; i < n; ++i) {
    double h = kStencil;
    const auto place = [&](double step) -> VectorXd { return x + step * axes.col(i); };
    const auto is_inside = [&](double step) { return box.clipped(place(step)) == place(step); };
    const auto beside = [&](double step) { return is_inside(step) ? evidence(place(step)) : std::nullopt; };
    std::optional<Evidence> above = beside(h), below = beside(-h);
    const auto fall = [&] { return 2 * here.value - above->value - below->value; };
    const bool is_missing = is_inside(h) && is_inside(-h) && above.has_value() != below.has_value();
    if (is_missing || (above && below && fall() > kMostFall)) {
      h *= is_missing ? kNearer : std::max(kStencil / std::sqrt(fall()), kLeastOfStencil);
      above = beside(h);
      below = beside(-h);
    }
    if (above && below) {
      slopes[i] = (above->value - below->value) / (2 * h);
      slopes_without_group.row(i) = (above->without_group - below->without_group) / (2 * h);
      bends[i] = std::clamp(fall() / (h * h), kLeastOfMetric * bends[i], kMostOfMetric * bends[i]);
      is_measured[static_cast<std::size_t>(i)] = 1;
    } else if (above || below) {
      const Evidence& aside = above ? *above : *below;
      const double step = above ? h : -h;
      slopes[i] = (aside.value - here.value) / step + 0.5 * step * bends[i];
      slopes_without_group.row(i) = ((aside.without_group - here.without_group) / step).array() + 0.5 * step * bends[i];
    }
  }
  // Correlations between the directions are the metric's.
  const VectorXd scale = bends.cwiseQuotient(expected.diagonal()).cwiseSqrt();
  const MatrixXd back = axes.inverse();
  LocalEvidence local{x,
                      here,
                      {here.value, back.transpose() * slopes,
                       back.transpose() * scale.asDiagonal() * expected * scale.asDiagonal() * back},
                      VectorXd::Zero(n),
                      back.transpose() * slopes_without_group};
  for (Index i = 0; i < n; ++i) {
    bool is_known = true;
    for (Index k = 0; k < n; ++k)
      is_known = is_known && (axes(i, k) == 0 || is_measured[static_cast<std::size_t>(k)] != 0);
    if (is_known) local.curvatures[i] = local.slope.information(i, i);
  }
  return local;
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

namespace {

// Of a number along one of its two directions: fall and place are functions of the distance from the maximum.
struct Side {
  std::function<std::optional<double>(double)> fall;  // of the evidence, nats; nothing where there is no evidence
  std::function<double(double)> wanted;               // nats, at the end
  double most = 0;                                    // distance of the bound
  double deviation = 0;                               // by the information at the maximum
};

// The distance at which the fall is the wanted one; infinite where it is not as much within the bound, or where no
// place has evidence. Falls are about t²: lines are through their roots.
double end_of(const Side& side) {
  constexpr double kNowhere = std::numeric_limits<double>::infinity();
  const double first = std::sqrt(2 * side.wanted(0)) * side.deviation;
  double inside = 0, root_inside = 0, outside = kNowhere, root_outside = kNowhere, end = kNowhere;
  double t = std::min(first, side.most);
  for (int count = 0; count < kMostOutward; ++count) {
    const std::optional<double> fall = side.fall(t);
    if (!fall && inside > 0) break;
    if (!fall) {
      t /= 2;
      continue;
    }
    const double wanted = side.wanted(t), root = std::sqrt(wanted);
    const bool is_inside = *fall < wanted;
    (is_inside ? inside : outside) = t;
    (is_inside ? root_inside : root_outside) = std::sqrt(*fall);
    if (is_inside && t >= side.most) return kNowhere;
    if (std::isfinite(outside)) {
      const double part = std::clamp((root - root_inside) / (root_outside - root_inside), 0.0, 1.0);
      end = inside + (outside - inside) * part;
      t = inside + (outside - inside) * std::clamp(part, 0.1, 0.9);
    } else {
      end = t * root / std::max(root_inside, 0.5 * root);
      t = std::min({1.6 * t, side.most, kFarthest * first});
      if (t <= inside) break;
    }
    if (std::abs(*fall - wanted) <= kAtEnd) break;
  }
  return end;
}

}  // namespace

Intervals find_intervals(const ProfileAt& profile, const LocalEvidence& maximum, const Box& box,
                         const std::vector<char>& near_bound) {
  const Index n = maximum.x.size();
  constexpr double kNowhere = std::numeric_limits<double>::infinity();
  Intervals intervals{VectorXd::Constant(n, -kNowhere), VectorXd::Constant(n, kNowhere)};
  const VectorXd deviations = inverse_of(maximum.slope.information).diagonal().cwiseSqrt();
  const auto wanted_at = [&](Index i, double place) {
    const bool is_near = near_bound[static_cast<std::size_t>(i)] != 0;
    return is_near ? drop_of_ninety((place - box.least[i]) / deviations[i]) : kDropOfNinety;
  };
  struct Known {
    VectorXd x;
    double fall = 0;
  };
  std::vector<Known> known;
  for (Index i = 0; i < n; ++i)
    for (const int direction : {-1, 1}) {
      const double most = direction * ((direction < 0 ? box.least[i] : box.most[i]) - maximum.x[i]);
      const auto place = [&](double t) { return std::clamp(maximum.x[i] + direction * t, box.least[i], box.most[i]); };
      const auto fall_at = [&](double t) -> std::optional<double> {
        const std::optional<ProfilePlace> there = profile(i, place(t));
        if (!there) return std::nullopt;
        known.push_back({there->x, std::max(fall_between(maximum.here, there->evidence), 0.0)});
        return known.back().fall;
      };
      const double end = end_of({fall_at, [&](double t) { return wanted_at(i, place(t)); }, most, deviations[i]});
      if (end < most) (direction < 0 ? intervals.low : intervals.high)[i] = place(end);
    }
  // Each place that is not excluded is inside, whichever number's end it was sought for.
  for (const Known& one : known)
    for (Index i = 0; i < n; ++i) {
      if (one.fall > wanted_at(i, one.x[i])) continue;
      intervals.low[i] = std::min(intervals.low[i], one.x[i]);
      intervals.high[i] = std::max(intervals.high[i], one.x[i]);
    }
  return intervals;
}

}  // namespace pulson::compare
