#include "noise_range.hpp"

#include <algorithm>
#include <cmath>

#include "evidence_maximum.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using posterior::LinearAt;

// Variance of the end points, in units of σ², below which neither momenta nor noise show: of numbers that vanish it is
// 6 millionths each.
constexpr double kDetectable = 100 * kNegligible;

constexpr int kMostPlaces = 30;
constexpr double kAtRangeEnd = 0.02;  // nats: within 1 % of an end

// The evidence of the linear models with one number held, at its best in the others.
struct Profile {
  const CohortModel& cohort;
  const Matches& about;
  Index held;

  BoxMaximum at(double place, const VectorXd& near) const {
    Box box = cohort.box();
    box.least[held] = box.most[held] = place;
    return maximise_in_box([&](const VectorXd& x) { return cohort.linear_value(about, x); },
                           [&](const VectorXd& x) { return cohort.linear_evidence(about, x).slope; }, box, near);
  }
};

// Where the profile has fallen by what is wanted at that distance, by bisection between there and the maximum.
VectorXd upper_end(const Profile& profile, const BoxMaximum& best, double deviation) {
  const Index g = profile.held;
  const Box& box = profile.cohort.box();
  const double drop = drop_of_ninety((best.x[g] - box.least[g]) / deviation);
  double inside = best.x[g], outside = box.most[g];
  VectorXd at_inside = best.x;
  double step = std::max(std::sqrt(2 * drop) * deviation, 1e-3);
  for (int count = 0; count < kMostPlaces; ++count) {
    const bool is_open = outside >= box.most[g];
    const double place = is_open ? std::min(inside + step, box.most[g]) : (inside + outside) / 2;
    const BoxMaximum there = profile.at(place, at_inside);
    const double excess = best.value - there.value - drop;
    if (std::abs(excess) < kAtRangeEnd) return there.x;
    if (excess > 0) {
      outside = place;
      continue;
    }
    inside = place;
    at_inside = there.x;
    if (place >= box.most[g]) break;
  }
  return at_inside;
}

}  // namespace

double noise_share(const CohortModel& cohort, const Matches& about, const VectorXd& x) {
  const posterior::Specimen::Model model = cohort.model(x);
  double of_momenta = 0, of_noise = 0;
  Index data = 0;
  for (int s = 0; s < cohort.shapes(); ++s) {
    const LinearAt linear(*about.minima[at(s)].linear, model);
    of_momenta += linear.momentum_share();
    of_noise += linear.noise_share();
    data += cohort.specimen(s).data();
  }
  return of_noise + of_momenta > kDetectable * static_cast<double>(data) ? of_noise / (of_noise + of_momenta) : 0;
}

double greatest_noise_share(const CohortModel& cohort, const Matches& about) {
  double greatest = 0;
  const CohortModel::LinearEvidence here = cohort.linear_evidence(about, about.x);
  for (Index g = 0; g < cohort.count(); ++g) {
    if (cohort.open()[at(g)].kind != ModelNumber::Kind::kAmplitude) continue;
    const BoxMaximum best = maximise_in_box([&](const VectorXd& x) { return cohort.linear_value(about, x); },
                                            [&](const VectorXd& x) { return cohort.linear_evidence(about, x).slope; },
                                            cohort.box(), about.x);
    const double deviation = 1 / std::sqrt(std::max(here.slope.information(g, g), 1e-6));
    greatest = std::max(greatest, noise_share(cohort, about, upper_end({cohort, about, g}, best, deviation)));
  }
  return greatest;
}

}  // namespace pulson::compare
