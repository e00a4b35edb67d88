#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "canvas.hpp"
#include "layout.hpp"
#include "outline.hpp"

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

/// The numbers of the landmarks, from 1, beside their marks, where they are few enough to be legible: each on the side
/// where it covers the fewest marks, those at `others` (2×M) included, and numbers.
void draw_numbers(Canvas& canvas, const Points& pixels, const Figure& figure, const std::vector<int>& numbers = {},
                  const Points& others = Points(2, 0));

/// The target, at `pixels` (2×N): a ring at each marked landmark, and faint outlines below them.
void draw_target(Canvas& canvas, const Points& pixels, const Figure& figure, const Marks& marks);

inline constexpr int kTimeColours = 48;

/// Paths d×N at each time.
struct Paths {
  const std::vector<Points>& trajectory;
  const std::vector<double>& times;
};

/// The paths of the figure's landmarks, coloured by time from the first to the last; later parts lie above earlier
/// ones. Long ones are thinned by `thin_paths`, to about `vertices` in all.
void draw_paths_by_time(Canvas& canvas, const View& view, const Paths& paths, const Figure& figure, double width,
                        std::size_t vertices);

/// The landmarks where paths start, at `pixels` (2×N), in small marks, and thinly the outlines that have no marks.
void draw_start(Canvas& canvas, const Points& pixels, const Figure& figure);

inline constexpr std::size_t kGroupColours = kLightPalette.groups.size();

/// Of kLightPalette; they repeat after `kGroupColours`.
const Colour& group_colour(std::size_t group);

/// Colour of landmark a where each has its own: of a few as of groups, in their order, as the page has it; of more by
/// their position at the start.
std::vector<Colour> colours_by_position(const Points& source);

}  // namespace pulson::picture
