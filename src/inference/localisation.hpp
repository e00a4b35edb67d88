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
  LocalWeights(const matching::LandmarkTerm& data, Points q0);

  LocalData near(Eigen::Index landmark, double radius) const;
  LocalData all(double weight) const;  ///< each with this weight
  const Points& source() const { return q0_; }

 private:
  Points q0_;
  std::vector<Eigen::Index> first_;  ///< of the rows of each landmark, and their number
};

/// How many directions of the weighted data the members resolve: tr G(G + I)⁻¹, G the covariance of the predicted data
/// over that of their errors. @param anomalies of the residuals, m×n
double resolved_data(const LocalData& local, const Eigen::MatrixXd& anomalies);

/// What resolved_data() should be near a landmark: an eighth of the members, or the data of two landmarks where that is
/// more. With more the sample shrinks by fitting its own noise; with fewer information is lost.
double wanted_data(Eigen::Index members, Eigen::Index dimension);

/// The radius where resolved_data() is wanted_data(), on average over up to eight landmarks; infinity where all data
/// are no more.
double automatic_localisation(const LocalWeights& data, const Eigen::MatrixXd& anomalies);

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
