#pragma once

#include <string>
#include <string_view>
#include <vector>

struct _cairo_font_face;  // cairo_font_face_t, whose header only .cpp files include

namespace pulson::draw {

inline constexpr const char* kFontFamily = "DejaVu Sans";

/// The text without what cannot be drawn: control characters become spaces, bytes that are not UTF-8 become '?'.
std::string printable(std::string_view text);

/// Width of the printable text in the font of all pictures. Safe to call from several threads, as is all of this.
double text_width(std::string_view text, double size);

/// The printable text, cut after a character and closed by an ellipsis where it would be wider than `room`.
std::string fitted(std::string_view text, double size, double room);

/// A part of a text whose characters one font has.
struct TextRun {
  _cairo_font_face* face;
  std::string text;
};

/// The printable text in kFontFamily and, for characters that it lacks, in other fonts that are installed.
std::vector<TextRun> text_runs(std::string_view text);

/// Empty, or a sentence that says that kFontFamily is not installed and what replaces it.
std::string font_note();

}  // namespace pulson::draw
