#include "noise_range.hpp"

#include <algorithm>
#include <cmath>

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using posterior::LinearAt;

// Variance of the end points, in units of σ², below which neither momenta nor noise show: of numbers that vanish it is
// 6 millionths each.
constexpr double kDetectable = 100 * kNegligible;

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

double greatest_noise_share(const CohortModel& cohort, const Matches& about, const std::vector<FittedNumber>& fitted) {
  double greatest = 0;
  for (Index g = 0; g < cohort.count(); ++g) {
    const ModelNumber& number = cohort.open()[at(g)];
    if (number.kind != ModelNumber::Kind::kAmplitude) continue;
    const double high = fitted[at(g)].high, most = cohort.box().most[g];
    VectorXd x = about.x;
    x[g] = std::isfinite(high) ? std::clamp(number.place(high), x[g], most) : most;
    greatest = std::max(greatest, noise_share(cohort, about, x));
  }
  return greatest;
}

}  // namespace pulson::compare
