#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "canvas.hpp"
#include "layout.hpp"
#include "legend.hpp"
#include "marks.hpp"
#include "pulson/core/landmarks.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson::draw {

/// A group of landmarks that is joined by a line.
struct Outline {
  std::vector<int> members;  // in order; the first again at the end of a closed one
  std::size_t group;         // its place in Figure::groups
  bool dense;                // so many that the line alone is drawn, without a mark at each landmark
};

/// Two landmarks that a wireframe joins.
struct Link {
  int from, to;
  std::size_t group;  // of `from`: its place in Figure::groups
};

/// What is drawn of a shape at one scale.
struct Figure {
  std::vector<std::vector<int>> groups;  // the marked landmarks of each group
  std::vector<std::string> names;        // of the groups, where there are several; else empty
  std::vector<Outline> outlines;         // of the groups that `outline_kind` calls curves
  std::vector<Link> links;               // but for those that outlines draw; none on a line
  std::vector<int> marked;               // landmarks that have a mark: all but those of dense outlines
  std::vector<int> with_path;            // landmarks whose path is drawn: all but some of dense outlines
  double spacing;  // of the marked landmarks: median pixels to the nearest other, infinite for one alone
};

/// Chooses the figure of a shape that is drawn at `scale` pixels per length unit. Landmarks that have a missing
/// coordinate are left out.
Figure plan_figure(const Landmarks& shape, double scale);

/// The figure without marks at some of its landmarks, nor links to them; outlines pass from one of their neighbours to
/// the other. Sizes of marks and the landmarks with paths stay the same.
Figure without(Figure figure, const std::vector<int>& left_out);

/// The lines, 2×M or 3×M, of the dense outlines, or of the others and of links, of one group or of all, through a
/// position d×N of the landmarks.
std::vector<Points> trace(const Figure& figure, bool dense, const Points& points,
                          std::optional<std::size_t> group = {});

/// Sizes of marks and lines, in pixels. They shrink as the landmarks grow in number and in closeness.
struct Marks {
  double dot;      // radius of source and result
  double ring;     // radius of the target
  double stroke;   // of the ring
  double path;     // width
  double outline;  // width

  explicit Marks(const Figure& figure);
};

/// The landmarks, now at `pixels` (2×N), as discs on a narrow white margin with their outlines below them; of `colour`
/// where there is one group, else of their group's. @param most_dot largest radius of the discs, pixels
void draw_shape(Canvas& canvas, const Points& pixels, const Figure& figure, const Colour& colour,
                double most_dot = 1e9);

/// What pictures call the landmarks of a shape: their labels where each has a short one of its own, else their numbers
/// in the file.
std::vector<std::string> mark_names(const Landmarks& shape);

/// These names beside the marks, where they are few enough to be legible: each on the side where it covers the fewest
/// marks, those at `others` (2×M) included, and names. Numbers where labels would not be legible and numbers are.
void draw_names(Canvas& canvas, const Points& pixels, const Figure& figure, const Landmarks& shape,
                const Points& others = Points(2, 0));

/// A text beside a mark: where it is, and how many marks and texts it covers there.
struct TextPlace {
  Box box;
  int covered;
};

/// The first of eight boxes around a mark of radius `ring`, for a text of that width and height, that covers the fewest
/// of `marks` (2×M, of that radius) and of the texts in `taken`.
TextPlace freest_place(const Eigen::Vector2d& mark, double width, double height, double ring, const Points& marks,
                       const std::vector<Box>& taken);

/// The target, at `pixels` (2×N): a ring at each marked landmark, and faint outlines below them.
void draw_target(Canvas& canvas, const Points& pixels, const Figure& figure, const Marks& marks);

/// Paths d×N at each time.
struct Paths {
  const std::vector<Points>& trajectory;
  const std::vector<double>& times;
};

/// The paths of the figure's landmarks, coloured by time from the first to the last; later parts lie above earlier
/// ones. Long ones are thinned by `thin_paths`, to about `vertices` in all.
void draw_paths_by_time(Canvas& canvas, const View& view, const Paths& paths, const Figure& figure, double width,
                        std::size_t vertices);

/// A picture, so pale that what lies above it is seen; none: nothing.
void draw_image(Canvas& canvas, const View& view, const std::optional<PlacedImage>& image);

/// The landmarks where paths start, at `pixels` (2×N), in small marks, and thinly the outlines that have no marks.
void draw_start(Canvas& canvas, const Points& pixels, const Figure& figure);

inline constexpr std::size_t kGroupColours = kLightPalette.groups.size();

/// Of kLightPalette; they repeat after `kGroupColours`.
Colour group_colour(std::size_t group);

/// Discs in the group's colour; where the colours repeat, other shapes.
SeriesLook group_look(std::size_t group);

/// Colour of landmark a where each has its own: of a few as of groups, in their order, as the page has it; of more by
/// their position at the start.
std::vector<Colour> colours_by_position(const Points& source);

/// The groups where the figure has several, else the shape: a dot, or a line where no landmark is marked.
std::vector<LegendEntry> legend_of_shape(const Figure& figure, const Colour& colour, const std::string& text);
LegendEntry legend_of_time(const std::vector<double>& times);

}  // namespace pulson::draw
