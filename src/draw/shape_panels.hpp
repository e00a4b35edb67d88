#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson::draw {

/// One shape of a picture of several.
struct ShapePanel {
  std::string heading;                    ///< one line
  Points shape;                           ///< d×N, may be empty
  std::vector<Points> grid = {};          ///< d = 2: lines 2×M below it
  std::vector<Points> cloud = {};         ///< d×N each, small dots below it; may miss coordinates (NaN)
  std::optional<PlacedImage> image = {};  ///< d = 2: below all
};

/// Shapes of one scale in rows and columns, d = 2 or 3; in space two coordinate planes of each.
struct ShapePanels {
  Landmarks reference;         ///< d×N: faint in every panel, joined to the shape; its groups and outlines are theirs
  std::string reference_name;  ///< in the legend
  std::string shape_name;      ///< in the legend, may be empty
  std::string cloud_name;      ///< in the legend, may be empty
  std::vector<std::vector<ShapePanel>> rows;
  std::string title;     ///< one line, may be empty
  std::string subtitle;  ///< one line, may be empty
};

/// @throws InputError on a value that is not finite, except for those of clouds, and where a file cannot be
/// written; no file is then written
void write_shape_panels(const ShapePanels& picture, const PictureFiles& files);

/// A scatter plot of shapes.
struct ScorePlot {
  struct Group {
    std::string name;                      ///< empty: none, and no entry in the legend
    Points scores;                         ///< 2×n
    std::vector<std::string> labels = {};  ///< n, beside the dots, where they are few enough to be legible
  };

  std::vector<Group> groups;       ///< each in a colour with its convex hull
  std::vector<Points> lines = {};  ///< 2×M each, dark
  std::string x_label, y_label;
  std::string title;       ///< one line, may be empty
  std::string subtitle;    ///< one line, may be empty
  bool same_scale = true;  ///< of both axes
};

/// @throws InputError as write_shape_panels()
void write_score_plot(const ScorePlot& plot, const PictureFiles& files);

/// The corners of the convex hull of points in the plane, in order (A. Andrew 1979). @param points 2×n @return 2×m
Points convex_hull(const Points& points);

}  // namespace pulson::draw
