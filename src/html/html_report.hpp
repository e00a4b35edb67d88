#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::html {

/// The verdict on a claim.
enum class Verdict { kHolds, kDoesNotHold, kNotTested };

struct ReportParagraph {
  std::string text;
};

enum class MediaType { kSvg, kPng, kJpeg };

/// A picture as the bytes of its file.
struct EncodedPicture {
  MediaType type;
  std::string bytes;
};

/// A picture that the page contains: in memory, or a file of SVG, PNG or JPEG, recognised by its contents.
using EmbeddedPicture = std::variant<std::filesystem::path, EncodedPicture>;

/// A picture on the page.
struct ReportPicture {
  EmbeddedPicture picture;
  std::string caption = {};                   ///< may be empty; screen readers read it in place of the picture
  bool has_photograph = false;                ///< which a dark page shows as it is; drawings become dark there
  std::optional<EncodedPicture> narrow = {};  ///< in its place on screens as narrow as a phone's
};

/// A small drawing of a shape that moves; in space, its view along the axis of the least extent.
struct ReportSketch {
  Landmarks source;    ///< d×N; its curves are lines (outline_kind)
  Points target = {};  ///< d×N as rings, may miss coordinates; empty: none
  Points result = {};  ///< d×N
};

struct ReportCell {
  std::string text;
  std::optional<Verdict> verdict = {};      ///< shown as a coloured mark before the text
  bool outlier = false;                     ///< shown as a mark before the text
  std::optional<ReportSketch> sketch = {};  ///< above the text
};

/// A table that sorts by a click on a column heading; numbers sort as numbers.
struct ReportTable {
  std::vector<std::string> header;
  std::vector<std::vector<ReportCell>> rows;  ///< each as long as the header
  std::string caption = {};                   ///< may be empty
  bool has_facts = false;  ///< whether it lists names and values, which are not sorted; two of these stand side by side
};

/// One claim, the verdict, and what was measured.
struct ReportClaim {
  std::string claim;
  Verdict verdict;
  std::string measured = {};  ///< may be empty
};

using ReportClaims = std::vector<ReportClaim>;

/// A picture below landmarks in the plane, which moves with their grid.
struct MotionImage {
  EmbeddedPicture picture;
  Eigen::Vector2d first;  ///< where the first corner of the mesh is in it: parts of its width and, from the top,
  Eigen::Vector2d last;   ///< height; and the last one. What is between lies evenly between
  int columns = 0;  ///< the first so many lines of the grid lie side by side, and every `step`-th of their points is a
  int step = 1;     ///< corner of the mesh that carries the picture
};

/// Lines of a motion that stay where they are.
struct MotionLines {
  std::string name;           ///< in the key
  std::vector<Points> lines;  ///< d×M each
};

/// Landmarks that move, with a slider for the time: in 1D position over time, in 2D the plane with a grid, in 3D a view
/// that is rotated by dragging or with the arrow keys. What is drawn can be switched off and on, one by one; the view
/// is zoomed by buttons, wheel, two fingers and keys. d = 1, 2 or 3; N landmarks; F frames.
struct ReportMotion {
  Landmarks source;               ///< d×N; its groups have a colour each, those that are curves (outline_kind) a line
  Landmarks target = {};          ///< d×M, may miss coordinates (NaN); none: no points
  bool corresponds = true;        ///< whether the target has the source's groups and outlines
  std::vector<double> times;      ///< F ≥ 2, increasing
  std::vector<Points> frames;     ///< F entries d×N: the landmarks at `times`
  std::vector<int> lines = {};    ///< of the grid: the number of points of each, L in all; for d = 1, 1 each
  std::vector<Points> grid = {};  ///< F entries d×L, or none: the points of all lines, one line after the other
  std::optional<MotionImage> image = {};
  /// d = 3: a surface below the landmarks, each triangle three of its vertices, from 0; may be empty
  std::vector<std::array<int, 3>> triangles = {};
  std::vector<Points> surface = {};              ///< its vertices, 3×V, at the following times
  std::vector<double> surface_times = {};        ///< increasing, from the first of `times` to the last
  std::vector<int> outliers = {};                ///< landmarks that are marked
  std::string others_name = {};                  ///< what the key calls the other paths
  std::vector<std::vector<Points>> others = {};  ///< [path]: F entries d×N each, drawn faintly; may be empty
  MotionLines extra = {};                        ///< d > 1; may be empty
  std::string caption = {};                      ///< may be empty
};

/// The shapes about a template by their scores s, as a polynomial that the page evaluates: landmarks are
///
///     Σ_t terms[t] Π_k s_k^powers[t][k],
///
/// and so are the points of the grid. A slider for each score; a map of the first two scores, on which a click shows
/// the shape there, or that of a specimen with its picture.
struct ReportShapeSpace {
  struct Specimen {
    std::string name;
    std::string group;                       ///< may be empty
    std::vector<double> scores;              ///< K
    std::optional<EmbeddedPicture> picture;  ///< on the template, of the size of `shapes.image`; may be none
  };

  ReportMotion shapes;                   ///< the template at its first time, at the others what the figure has room for
  std::vector<std::string> axes;         ///< names of the K ≥ 1 scores
  double range = 3;                      ///< of each, from −range to range
  std::vector<std::vector<int>> powers;  ///< T of K; the first are 0
  std::vector<Points> terms;             ///< T, d×N
  std::vector<Points> grid_terms;        ///< T, d×L; none where there is no grid
  std::vector<Specimen> specimens;
  std::string caption = {};  ///< may be empty
};

/// Two pictures of one size, which the reader lays over one another: mixed, wiped, in squares or as their difference.
struct ReportStack {
  EmbeddedPicture below;
  EmbeddedPicture above;
  std::string below_name;
  std::string above_name;
  std::string caption = {};  ///< may be empty
};

using ReportBlock = std::variant<ReportParagraph, ReportPicture, ReportTable, ReportClaims, ReportMotion, ReportStack,
                                 ReportShapeSpace>;

struct ReportSection {
  std::string heading;
  std::vector<ReportBlock> blocks;
};

/// A report on a run; every text is plain.
struct HtmlReport {
  std::string title;
  std::string lead = {};  ///< a paragraph below the title, may be empty
  std::vector<ReportSection> sections = {};
  std::string command = {};  ///< the command line that made it, may be empty
  std::string version = {};  ///< of the program, may be empty
};

/// The report as one HTML5 page that needs no other files: style, script and pictures are within it. It follows
/// the reader's choice of light or dark and fits narrow screens.
///
/// @throws InputError where a picture cannot be read or is not SVG, PNG or JPEG, on a table whose rows differ in length
/// from its header, and on a motion whose sizes disagree or that has a number that is not finite.
std::string html_report(const HtmlReport& report);

}  // namespace pulson::html
