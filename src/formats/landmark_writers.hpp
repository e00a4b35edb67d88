#pragma once

// What the writers of landmark formats share: which shapes they refuse, what they report of the rest, and texts of
// points.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {

/// What messages name: the file that is written, and its format.
struct Target {
  const std::string& path;
  std::string_view format;
};

/// What a format holds besides the points.
struct HeldParts {
  bool names = false;
  bool labels = false;
  bool groups = false;
  bool images = false;
  bool scales = false;
  bool properties = false;
  bool lines = false;  ///< curves and outlines
  bool links = false;
  bool units = false;
  bool axes = false;
  bool directions = false;  ///< of y in the plane
  bool frames = false;      ///< units per pixel, origins
  bool absent = false;      ///< which landmarks are absent; else they are missing ones
};

// ---- notes

/// "a.tps: tps cannot hold labels"
std::string cannot_hold(const Target& target, std::string_view what);

/// "a.tps: tps cannot hold labels (2 of 3 shapes)", without the count for the only shape
std::string cannot_hold(const Target& target, std::string_view what, std::size_t count, std::size_t shapes);

/// A line for each part that `file` has and the format does not hold. A name that was made from that of the file it was
/// read from, or that reading gives again, is no part.
std::vector<std::string> losses_of(const Target& target, const LandmarkFile& file, const HeldParts& held);

/// Adds a line that is not there yet.
void add_once(std::vector<std::string>& losses, const std::string& line);

/// `text` with blanks for line breaks and zero bytes, and without blanks at its ends; sets `is_changed` where it
/// differs.
std::string one_line(std::string text, bool& is_changed);

/// The note where one_line changed a text.
std::string cannot_hold_breaks(const Target& target);

// ---- what is refused, by an InputError

void require_shapes(const Target& target, const LandmarkFile& file);

/// The only shape.
const Landmarks& require_one_shape(const Target& target, const LandmarkFile& file);

void require_landmarks(const Target& target, const Landmarks& shape);
void require_plane_or_space(const Target& target, const Landmarks& shape);

/// Refuses landmarks that have a missing coordinate.
void require_complete(const Target& target, const Landmarks& shape);

// ---- points

/// The points in space, with z = 0 for those of the plane, which adds a line to `losses`; refuses those of the line.
Points points_in_space(const Target& target, const Landmarks& shape, std::vector<std::string>& losses);

/// A line for each point: its coordinates in the fewest digits that read back to the same bits, between blanks.
void append_points(std::string& text, const Points& points, std::string_view missing_mark);

}  // namespace pulson::formats
