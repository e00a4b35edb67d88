#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "matching/maximum.hpp"

namespace pulson::compare {

using matching::Box, matching::SecondOrder;

/// The log evidence of a cohort at a place x: a number, and where it was sampled what each group of the draws would
/// make of it if it were left out, from which the error of differences follows.
struct Evidence {
  double value = 0;
  Eigen::VectorXd without_group;  ///< of no size where nothing was sampled
};

/// The variance of a number by what it would be if one group of draws were left out; 0 of fewer than two groups.
double jackknife_variance(const Eigen::VectorXd& without_group);

/// By how much an evidence is below another, as far as draws distinguish them. Draws that give the evidence a slope of
/// variance γ² in standard deviations make the variance of the estimate 1 + γ² times as much, so that a fall counts
/// that much less: d, the error of a fall f by the draws, is γ√(2f), and what counts f/(1 + d²/(2f)).
double fall_between(const Evidence& greatest, const Evidence& there);

/// None where there is no evidence, as where some shape has no path or too few draws are effective.
using EvidenceAt = std::function<std::optional<Evidence>(const Eigen::VectorXd& x)>;

/// The evidence to second order about a place, by central differences over most of a standard deviation along the axes
/// of the metric, so that the errors of the draws are small beside them. What neighbours that have no evidence leave
/// open is the metric's.
struct LocalEvidence {
  Eigen::VectorXd x;
  Evidence here;
  SecondOrder slope;
  Eigen::VectorXd curvatures;               ///< of numbers whose directions were all measured, else 0
  Eigen::MatrixXd gradients_without_group;  ///< a column each
};

/// @param here the evidence at x @param metric about the information: that of the linear models
LocalEvidence evidence_about(const EvidenceAt& evidence, const Eigen::VectorXd& x, const Evidence& here,
                             const Eigen::MatrixXd& metric, const Box& box);

/// Nats that a step would still gain at a maximum: within 0.14 standard deviations of it.
inline constexpr double kAtMaximum = 0.01;

/// By how much the log-likelihood of a number may be below its maximum for the number to be in the interval of 90 %:
/// half of 2.706, the quantile of χ² of one degree, but near the least value that the number can have. There, at a
/// distance of `from_bound` standard deviations, the maximum cannot lie where it would without the bound, and c with
///
///     Q(√c) + Q((c + d²)/(2d)) = 0.1   where d = from_bound < √c
///
/// covers 90 %, 1.642 at the bound; Q is the normal distribution's upper tail (G. Feldman and R. Cousins 1998).
double drop_of_ninety(double from_bound);

/// The evidence of a place from where numbers may be sought.
struct PlaceEvidence {
  double laplace = 0;
  std::optional<double> by_draws{};  ///< none where draws do not determine it
};

/// The best of some places, by draws where these determine it; by Laplace's approximation where they do so for none, or
/// not that of one which is far better by the latter.
struct BestPlace {
  std::size_t index = 0;
  bool by_draws = false;
};
BestPlace best_place(const std::vector<PlaceEvidence>& places);

/// Standard deviations of a normal law on either side, within which 90 % is; and the drop far from any bound.
inline constexpr double kNinety = 1.644854;
inline constexpr double kDropOfNinety = kNinety * kNinety / 2;

/// The numbers where one is held and the evidence is greatest, and that; none where there is none.
struct ProfilePlace {
  Eigen::VectorXd x;
  Evidence evidence;
};
using ProfileAt = std::function<std::optional<ProfilePlace>(Eigen::Index held, double place)>;

/// The interval of 90 % of each number by the profile of the evidence, ±∞ where it does not fall before a bound. As the
/// evidence may have several maxima, each has what the places have that are found for the others' ends.
/// @param near_bound of which numbers the drop is that near a bound
struct Intervals {
  Eigen::VectorXd low, high;
};
Intervals find_intervals(const ProfileAt& profile, const LocalEvidence& maximum, const Box& box,
                         const std::vector<char>& near_bound);

}  // namespace pulson::compare
