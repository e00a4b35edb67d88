#pragma once

#include <functional>
#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::view {

struct LiveMapOptions {
  std::string noise = "none";  ///< as --noise
  int columns = 40;            ///< of the grid over the first picture, from 2
  int rows = 30;
  int frames = 8;  ///< besides that at time 0, at most
};

/// What a match leaves for the next, which is near it while a landmark is dragged.
struct NearMatch {
  std::vector<int> landmarks;  ///< that took part, from 0
  std::string noise;           ///< as LiveMapOptions::noise
  std::string kernel;
  double lambda = 0;
  std::vector<Points> path;  ///< of the landmarks, 2×n each
};

/// The match of the landmarks of two pictures, and what it does to a grid over the first.
struct LiveMap {
  std::vector<double> times;   ///< from 0 to 1
  std::vector<Points> frames;  ///< for each, the nodes of the grid row by row, 2×(columns·rows), pixels of the second
  std::vector<Points> paths;   ///< for each, the landmarks that took part, 2×n
  Eigen::VectorXd jacobians;   ///< of the whole map at the nodes, over that of the alignment
  std::vector<int> landmarks;  ///< that took part, from 0
  Eigen::VectorXd residuals;   ///< n, pixels
  std::vector<int> unmatched;  ///< of all landmarks, from 0
  Eigen::VectorXd noise_share;  ///< n, the part of each landmark's displacement that is the noise's; empty without
  std::string kernel;
  double ridge = 0;          ///< σ²λ
  bool is_linear = false;    ///< of linear_map()
  bool is_followed = false;  ///< of followed_map()
  double rms = 0;
  double folded_fraction = 0;
  bool converged = false;
  double seconds = 0;
  NearMatch near{};  ///< of live_map() and followed_map()
};

/// Why live_map() has no result: what was asked for is no longer wanted.
struct Superseded {};

/// @param source, target 2×N, NaN where not placed @param width, height of the first picture
/// @param is_unwanted asked between iterations: whether to end. The answer must stay yes
/// @throws InputError for fewer than three common landmarks, and as register_shapes(); Superseded
LiveMap live_map(const Points& source, const Points& target, int width, int height, const LiveMapOptions& options,
                 const std::function<bool()>& is_unwanted = {});

/// Whether followed_map() can begin there: of the same landmarks and noise.
bool can_follow(const NearMatch& near, const Points& source, const Points& target, const LiveMapOptions& options);

/// The match with the kernel and λ of one nearby, from its path on: see matching::register_near(). Jacobians are those
/// of the grid. Of 50 landmarks a third of the time of live_map(), whose result differs a little, as the kernel is
/// fitted to each pair anew. @throws InputError as live_map()
LiveMap followed_map(const Points& source, const Points& target, int width, int height, const LiveMapOptions& options,
                     const NearMatch& near);

/// The linear model in place of the match, where that takes longer than a move of the mouse: displacements of the
/// aligned landmarks interpolated by the kernel of an earlier match, u = K(·, q0) c, (K(q0, q0) + ridge I) c = y − q0;
/// the only frames are its beginning and its end. Jacobians are those of the grid. O(N³ + N·nodes).
/// @throws InputError as live_map(), and for what is no kernel
LiveMap linear_map(const Points& source, const Points& target, int width, int height, const LiveMapOptions& options,
                   const std::string& kernel, double ridge);

/// As bytes for the page: the length of a JSON head in four bytes, little endian; the head, padded with blanks to a
/// multiple of four; then 32-bit numbers: frames, paths, Jacobians.
std::string bytes_of(const LiveMap& map, const LiveMapOptions& options);

}  // namespace pulson::view
