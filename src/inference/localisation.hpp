#pragma once

#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/dynamics/noise_model.hpp"

namespace pulson::inference {

/// Which channels of a noise act near which landmark.
struct ChannelSites {
  std::vector<std::vector<Eigen::Index>> of_landmark;  ///< N lists
  std::vector<Eigen::Index> wide;                      ///< that act over more than `reach`
};

/// Channel i acts about the mean of q_a with the weights |∇h_i|² at the landmarks a, with p = 0, over a distance of
/// the standard deviation of it. Both are estimated from sums with random signs, of N numbers each: exact for channels
/// of one coordinate of one landmark. @param reach length units; infinity: all channels are wide
ChannelSites channel_sites(const NoiseModel& noise, const Points& q0, double reach);

}  // namespace pulson::inference
