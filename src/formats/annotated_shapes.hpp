#pragma once

// What the readers of annotation programs share: points with labels, gathered one by one, and names by images.

#include <string>
#include <vector>

#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {

/// Landmarks of one shape that are gathered one by one, in the plane or in space.
class GatheredPoints {
 public:
  explicit GatheredPoints(int dimension = 2) : dimension_(dimension) {}

  int dimension() const { return dimension_; }
  std::size_t count() const { return labels_.size(); }

  /// @param point of the dimension
  void add(const Eigen::VectorXd& point, std::string label = {}, std::string group = {});
  /// A landmark of which each coordinate is missing.
  void add_missing(std::string label = {}, std::string group = {});

  /// Moves points, labels and groups into the shape.
  void move_to(Landmarks& shape);

 private:
  int dimension_;
  std::vector<double> coordinates_;
  std::vector<std::string> labels_;
  std::vector<std::string> groups_;
};

/// Names each shape without a name by its image, `a.jpg` → `a`, or `a_1`, `a_2`, ... where an image has several.
void name_by_images(std::vector<Landmarks>& shapes);

/// Takes labels off all shapes where one repeats within a group of a shape, since then they identify nothing, with a
/// warning.
void drop_repeated_labels(const std::string& path, LandmarkFile& file);

/// The points of a closed line without the last one where that repeats the first.
Points without_closing_point(const Points& line);

/// Takes lines as landmarks in all shapes where none has landmarks, with a warning.
void take_lines_where_alone(const std::string& path, LandmarkFile& file);

}  // namespace pulson::formats
