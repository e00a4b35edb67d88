#pragma once

#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::picture {

/// A group of landmarks that is joined by a line.
struct Outline {
  std::vector<int> members;  // in order; the first again at the end of a closed one
  std::size_t group;         // its place in Figure::groups
  bool dense;                // so many that the line alone is drawn, without a mark at each landmark
};

/// What is drawn of a shape at one scale.
struct Figure {
  std::vector<std::vector<int>> groups;  // the marked landmarks of each group
  std::vector<std::string> names;        // of the groups, where there are several; else empty
  std::vector<Outline> outlines;         // of the groups that `outline_kind` calls curves
  std::vector<int> marked;               // landmarks that have a mark: all but those of dense outlines
  std::vector<int> with_path;            // landmarks whose path is drawn: all but some of dense outlines
  double spacing;  // of the marked landmarks: median pixels to the nearest other, infinite for one alone
};

/// Chooses the figure of a shape that is drawn at `scale` pixels per length unit. Landmarks that have a missing
/// coordinate are left out.
Figure plan_figure(const Landmarks& shape, double scale);

/// The figure without marks at some of its landmarks; outlines pass from one of their neighbours to the other. Sizes of
/// marks and the landmarks with paths stay the same.
Figure without(Figure figure, const std::vector<int>& left_out);

/// The lines, 2×M or 3×M, of the dense or of the other outlines of one group through a position d×N of the landmarks.
std::vector<Points> trace(const Figure& figure, bool dense, const Points& points, std::size_t group);

/// The lines, 2×M or 3×M, of the dense or of the other outlines through a position d×N of the landmarks.
std::vector<Points> trace(const Figure& figure, bool dense, const Points& points);

}  // namespace pulson::picture
