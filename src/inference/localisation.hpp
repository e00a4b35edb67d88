#pragma once

#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/dynamics/noise_model.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::inference {

/// Rows of the residual near a point, and the roots of their weights.
struct LocalData {
  std::vector<Eigen::Index> rows;
  Eigen::VectorXd roots;
};

/// The data of landmarks, weighted by gaspari_cohn() of their distances at the source.
class LocalWeights {
 public:
  /// @param count of the rows of the residual
  LocalWeights(const matching::LandmarkTerm& data, Points q0, double radius);

  LocalData near(Eigen::Index landmark) const;
  LocalData all(double weight) const;  ///< each with this weight

 private:
  Points q0_;
  double radius_;
  std::vector<Eigen::Index> first_;  ///< of the rows of each landmark, and their number
};

/// What the weights of the data near a landmark should add up to: a twelfth of the members, or the data of two
/// landmarks where that is more. With more data the sample shrinks by fitting its own noise; with fewer, information is
/// lost.
double local_weight(int members, Eigen::Index dimension);

/// The radius where the weights of the data near a landmark add up to local_weight(), on average over up to 200
/// landmarks; infinity where all data are no more.
double automatic_localisation(const Points& q0, Eigen::Index data, int members);

/// Which channels of a noise act near which landmark.
struct ChannelSites {
  std::vector<std::vector<Eigen::Index>> of_landmark;  ///< N lists
  std::vector<Eigen::Index> wide;                      ///< that act over more than `reach`
};

/// Channel i acts about the mean of q_a with the weights |∇h_i|² at the landmarks a, for p = 0, over the standard
/// deviation of that. Both are estimated from sums over the landmarks with random signs, which is exact for channels of
/// one coordinate of one landmark. @param reach length units; infinity: all channels are wide
ChannelSites channel_sites(const NoiseModel& noise, const Points& q0, double reach);

}  // namespace pulson::inference
