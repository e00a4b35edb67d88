#pragma once

#include <vector>

#include <Eigen/Core>

namespace pulson::compare {

/// The matches of a cohort at the places where they are known, from which those of others are foretold.
class KnownMatches {
 public:
  /// @param of_shapes of each shape momenta and increments, each shape as many numbers at every place
  void add(const Eigen::VectorXd& x, std::vector<Eigen::VectorXd> of_shapes);

  /// By interpolation from the latest places (see ResponseSurface); none where these are too few or too far from it.
  std::vector<Eigen::VectorXd> at(const Eigen::VectorXd& x) const;

 private:
  std::vector<Eigen::VectorXd> places_;
  std::vector<std::vector<Eigen::VectorXd>> of_shapes_;
};

}  // namespace pulson::compare
