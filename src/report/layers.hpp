#pragma once

#include <string>
#include <vector>

#include "canvas.hpp"
#include "outline.hpp"
#include "pulson/report/registration_picture.hpp"
#include "view.hpp"

namespace pulson::picture {

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
/// where there is one group, else of their group's.
void draw_shape(Canvas& canvas, const Points& pixels, const Figure& figure, const Colour& colour);

/// The numbers of the landmarks, from 1, beside their marks, where these are few enough to be told apart.
void draw_numbers(Canvas& canvas, const Points& pixels, const Figure& figure);

/// The target, at `pixels` (2×N): a ring at each marked landmark, and faint outlines below them.
void draw_target(Canvas& canvas, const Points& pixels, const Figure& figure);

/// Paths, 2×N at each time, coloured by time from the first to the last; later parts lie above earlier ones. Long
/// trajectories are thinned to what can be seen.
void draw_paths_by_time(Canvas& canvas, const std::vector<Points>& trajectory, const std::vector<double>& times,
                        const Figure& figure);

enum class Sample { kDot, kRing, kLine, kTimeBar };

/// One entry of the legend: a sample and what it means. A time bar stands between its two texts, which are the ends.
struct LegendEntry {
  Sample sample;
  Colour colour;
  std::string text;
  std::string end_text;
};

/// The entries for source, target and result, as the figure shows them.
std::vector<LegendEntry> legend_of_shapes(const Figure& figure);
LegendEntry legend_of_time(const std::vector<double>& times);
LegendEntry legend_of_grid(const std::string& text);

/// The entries in one row around the middle of the canvas, above its bottom edge.
void draw_legend(Canvas& canvas, const std::vector<LegendEntry>& entries);

/// Title and subtitle from `left`, below the top edge.
void draw_titles(Canvas& canvas, const RegistrationPicture& picture, double left);
double title_height(const RegistrationPicture& picture);

/// Colour of landmark a where each has its own: ordered by position at the start.
std::vector<Colour> colours_by_position(const Points& source);

}  // namespace pulson::picture
