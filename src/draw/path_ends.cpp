#include "path_ends.hpp"

#include <algorithm>

namespace pulson::picture {
namespace {

constexpr double kFarthest = 6;  // in 90 % quantiles

/// The largest coordinate, in size, of any of the points as seen from the centre.
double distance(const Points& points, const Eigen::VectorXd& centre) {
  return (points.colwise() - centre).cwiseAbs().maxCoeff();
}

}  // namespace

Ends choose_ends(const PathPicture& picture, std::size_t vertices) {
  const std::size_t paths =
      std::clamp<std::size_t>(vertices / static_cast<std::size_t>(picture.start.count()), 1, picture.positions.size());
  const auto [low, high] = bounding_box(picture.start.points);
  const Eigen::VectorXd centre = low + (high - low) / 2;
  std::vector<double> distances;
  for (std::size_t m = 1; m < paths; ++m) distances.push_back(distance(picture.positions[m].back(), centre));
  double limit = 0;
  if (!distances.empty()) {
    std::vector<double> sorted = distances;
    std::sort(sorted.begin(), sorted.end());
    limit = kFarthest * sorted[9 * (sorted.size() - 1) / 10];
    for (const Points& points : picture.positions.front()) limit = std::max(limit, distance(points, centre));
  }

  Ends ends;
  for (std::size_t m = 1; m < paths; ++m)
    if (distances[m - 1] <= limit)
      ends.others.push_back(m);
    else
      ++ends.outside;
  return ends;
}

}  // namespace pulson::picture
