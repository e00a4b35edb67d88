#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "pulson/core/frame.hpp"

namespace pulson {

/// N points, or N vectors attached to points, in R^d: a d×N matrix with one column per landmark.
using Points = Eigen::MatrixXd;

/// One shape: an ordered set of landmarks in R^d, d = 1, 2, 3.
struct Landmarks {
  Points points;                    ///< d×N, length units of the file; a missing coordinate is NaN
  std::vector<std::string> labels;  ///< N names, or empty: then landmarks are known by their number from 1
  std::vector<std::string> groups;  ///< N outline (group) names, or empty: all belong to one outline
  std::string name;                 ///< specimen name, may be empty
  std::string image{};              ///< name of the image that it was digitised on, may be empty
  std::optional<double> scale{};    ///< length units per unit of the coordinates, where the file says so; not applied
  /// What else a file says of the shape, as `COMMENT` → text, in its order.
  std::vector<std::pair<std::string, std::string>> properties{};
  std::vector<Points> curves{};              ///< further points along open lines, d×n each, that are no landmarks
  std::vector<Points> outlines{};            ///< the same of closed ones
  std::vector<std::pair<int, int>> links{};  ///< landmarks, counted from 0, that a wireframe joins; for pictures alone
  std::vector<int> numbers{};  ///< in the file, from 1, where it numbers them or some were left out; empty: 1, 2, …
  /// Landmarks, counted from 0 and rising, of structures that the specimen does not have, as a bone that its species
  /// lacks. Their coordinates are NaN; nothing is aligned by them, matched to them or predicted of them.
  std::vector<int> absent{};
  std::string units{};           ///< of length, as its file names them (`mm`), or `voxels`; empty: it does not
  std::string axes{};            ///< where the axes point, as its file says: `LPS`, `RAS`; empty: it does not
  Frame frame{.y_down = false};  ///< d = 2: how its points lie on the image; pictures show y in its direction
  std::string source;            ///< where it came from, as a user would address it: `file.tps#3`

  int dimension() const { return static_cast<int>(points.rows()); }
  int count() const { return static_cast<int>(points.cols()); }

  /// The number, from 1, of landmark `index` (from 0) in the file.
  int number(int index) const { return numbers.empty() ? index + 1 : numbers[static_cast<std::size_t>(index)]; }

  /// What a message calls landmark `index` (from 0): its label in quotes or its number from 1.
  std::string describe(int index) const;
};

/// Indices of the landmarks of each group, in order of first appearance; one list of all if there are no groups.
std::vector<std::vector<int>> landmarks_by_group(const Landmarks& shape);

/// Indices of the points that have a missing coordinate (it is NaN), in their order.
std::vector<int> incomplete_points(const Points& points);

/// The landmarks that have a missing coordinate and are not absent: what a prediction may tell.
std::vector<int> missing_landmarks(const Landmarks& shape);

// The measures below leave out the points that have a missing coordinate, as if they were not there.

/// The largest distance between two of the points; 0 for fewer than two.
double diameter(const Points& points);

/// The median of all distances between two different points, the lower one of the two middle values; 0 for fewer than
/// two points.
double median_distance(const Points& points);

/// The median over the points of the distance to the nearest other point, the lower one of two middle values; 0 for
/// fewer than two points.
double median_nearest_distance(const Points& points);

/// The first pair of landmarks (a < b) at the same position, that is at most `tolerance` times the diameter apart.
/// The indices count all points.
std::optional<std::pair<int, int>> find_coincident(const Points& points, double tolerance = 1e-12);

/// The smallest axis-aligned box that holds all points, as {lower corner, upper corner}; NaN where there are none.
std::pair<Eigen::VectorXd, Eigen::VectorXd> bounding_box(const Points& points);

/// A point (q, p) of phase space: positions and momenta of N landmarks, both d×N.
struct PhaseState {
  Points q;
  Points p;
};

/// A node of a rooted tree of shapes, as a phylogeny is one.
struct TreeNode {
  std::string name;
  int parent = -1;    ///< −1: it is the root
  double length = 0;  ///< of the branch that leads to it
};

/// How Eigen allocates its matrices, which -mavx, -march=native and -fsanitize=address change. Declared for every
/// layout but defined only for the one pulson was compiled with: a program that would free memory differently from how
/// pulson allocated it does not link. Compile it with the same of these options.
template <int alignment, bool by_malloc>
int eigen_layout();

inline const int kEigenLayout = eigen_layout<EIGEN_DEFAULT_ALIGN_BYTES, EIGEN_MALLOC_ALREADY_ALIGNED != 0>();

}  // namespace pulson
