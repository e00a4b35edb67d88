#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include <libqhull_r/qhull_ra.h>

#include "core/text.hpp"
#include "pulson/warp/sampled_map.hpp"

namespace pulson::warp {
namespace {

double twice_area(const Points& x, const std::array<int, 3>& t) {
  const Eigen::Vector2d u = x.col(t[1]) - x.col(t[0]);
  const Eigen::Vector2d v = x.col(t[2]) - x.col(t[0]);
  return u.x() * v.y() - u.y() * v.x();
}

// Qhull's state for one triangulation, with its memory and a place for what it prints.
class DelaunayHull {
 public:
  explicit DelaunayHull(const Points& points) : coordinates_(points), sink_(std::tmpfile()) {
    if (!sink_) return;
    qh_zero(&qh_, sink_.get());
    // d: Delaunay; Qt: split cocircular polygons into triangles; Qbb: scale the paraboloid; Qc: keep coplanar points;
    // Qz: a point at infinity, without which three points and cocircular ones have no hull.
    std::string command = "qhull d Qt Qbb Qc Qz";
    failed_ = qh_new_qhull(&qh_, 2, static_cast<int>(points.cols()), coordinates_.data(), 0, command.data(),
                           sink_.get(), sink_.get()) != 0;
  }
  DelaunayHull(const DelaunayHull&) = delete;
  DelaunayHull& operator=(const DelaunayHull&) = delete;
  ~DelaunayHull() {
    if (!sink_) return;
    qh_freeqhull(&qh_, qh_ALL);
    int current_long = 0;
    int total_long = 0;
    qh_memfreeshort(&qh_, &current_long, &total_long);
  }

  // Corners of the lower facets of the paraboloid's hull.
  std::vector<std::array<int, 3>> triangles() {
    std::vector<std::array<int, 3>> list;
    if (failed_) return list;
    qhT* qh = &qh_;  // the macros below use this name
    for (facetT* facet = qh->facet_list; facet != nullptr && facet->next != nullptr; facet = facet->next) {
      if (facet->upperdelaunay) continue;
      std::array<int, 3> corners{};
      std::size_t corner = 0;
      vertexT* vertex = nullptr;
      vertexT** vertexp = nullptr;
      FOREACHvertex_(facet->vertices) corners.at(corner++) = qh_pointid(qh, vertex->point);
      list.push_back(corners);
    }
    return list;
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  qhT qh_{};
  Points coordinates_;
  std::unique_ptr<std::FILE, Close> sink_;
  bool failed_ = true;
};

}  // namespace

std::vector<std::array<int, 3>> delaunay_triangles(const Points& points) {
  require_size("the points of a triangulation", points, 2, points.cols());
  std::vector<std::array<int, 3>> triangles;
  if (points.cols() < 3) return triangles;
  for (std::array<int, 3> triangle : DelaunayHull(points).triangles()) {
    const double area = twice_area(points, triangle);
    if (area < 0) std::swap(triangle[1], triangle[2]);
    if (area != 0) triangles.push_back(triangle);
  }
  return triangles;
}

std::vector<std::array<int, 3>> flipped_of(const std::vector<std::array<int, 3>>& triangles, const Points& after) {
  std::vector<std::array<int, 3>> flipped;
  for (const std::array<int, 3>& triangle : triangles)
    if (twice_area(after, triangle) < 0) flipped.push_back(triangle);
  return flipped;
}

int flipped_triangles(const Points& before, const Points& after) {
  require_size("the points of a triangulation", after, 2, before.cols());
  return static_cast<int>(std::ssize(flipped_of(delaunay_triangles(before), after)));
}

}  // namespace pulson::warp
