#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "profile.hpp"

namespace pulson::compare {

/// Σ_s log of the mean over sets of draws of e^excess, and half of the variance that the logarithm takes off.
/// @param left_out the sets of that group are left out; −1: none. Set i of shape s with n sets is in group
/// (i + ns) mod EvidenceMap::kGroups, so that each group has as many where shapes have few sets.
double sum_of_log_means(const std::vector<Eigen::VectorXd>& excess, int left_out = -1);

/// The evidence of a cohort about a place: Laplace's approximation at many places, and what the samples add to it at
/// some of them, each continued by a ResponseSurface: through the former, and, as the samples have errors, near the
/// latter, the nearer the greater the evidence.
class EvidenceMap {
 public:
  static constexpr int kGroups = 8;  ///< of draws, of which one may be left out

  void add(const Eigen::VectorXd& x, double laplace);
  /// @param excess of each shape, for each set of draws, log of its mean weight over Laplace's evidence
  void add_samples(const Eigen::VectorXd& x, std::vector<Eigen::VectorXd> excess);
  /// Of a known place, by the samples where any place has some.
  std::optional<double> evidence_at(const Eigen::VectorXd& x) const;
  bool has_samples() const { return !sampled_.empty(); }
  /// The known place that is the likeliest, of the sampled ones where there are any.
  const Eigen::VectorXd& best_place(const Likelihood& likelihood) const;
  /// The known places that are at most so many nats less likely than the maximum, of the sampled ones where there are
  /// any.
  std::vector<Eigen::VectorXd> likely_places(const Likelihood& likelihood, double nats) const;
  /// Whether there is a place within so many deviations: within a sixth another says nothing more.
  bool is_known(const Eigen::VectorXd& x, bool sampled, const Eigen::MatrixXd& metric,
                double deviations = 1.0 / 6) const;

  /// @param metric the scale of distances @param left_out group of draws, or −1
  Likelihood likelihood(const Eigen::MatrixXd& metric, const Box& box, int left_out = -1) const;

 private:
  std::optional<double> laplace_at(const Eigen::VectorXd& x) const;

  std::vector<Eigen::VectorXd> places_, sampled_;
  std::vector<double> laplace_;
  std::vector<std::vector<Eigen::VectorXd>> excess_;
};

}  // namespace pulson::compare
