#include "draw/typeface.hpp"

#include <deque>
#include <mutex>
#include <unordered_map>

#include <cairo-ft.h>
#include <fmt/format.h>

#include "core/text.hpp"

namespace pulson::draw {
namespace {

char32_t code_of(std::string_view character) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(character[i]); };
  if (character.size() == 1) return byte(0);
  char32_t code = byte(0) & (0xFFU >> (character.size() + 1));
  for (std::size_t i = 1; i < character.size(); ++i) code = (code << 6U) | (byte(i) & 0x3FU);
  return code;
}

/// Calls `visit` with each character, and with each byte that belongs to none.
template <class Visit>
void for_each_character(std::string_view text, const Visit& visit) {
  for (std::size_t i = 0, length = 0; i < text.size(); i += length) {
    length = std::max<std::size_t>(utf8_length(text, i), 1);
    visit(text.substr(i, length));
  }
}

struct Font {
  cairo_font_face_t* face;
  cairo_scaled_font_t* large;       // without hints, so that widths grow as sizes do
  FcCharSet* characters = nullptr;  // none: all
  std::string family{};

  bool has(char32_t code) const { return characters == nullptr || FcCharSetHasChar(characters, code) != FcFalse; }
};

struct Glyph {
  cairo_font_face_t* face;
  double advance;  // in font sizes
};

/// The fonts and the widths of the characters that were asked for; it lives as long as the program.
class Typeface {
 public:
  static Typeface& instance() {
    static auto* const typeface = new Typeface;
    return *typeface;
  }

  Glyph glyph(std::string_view character) {
    const std::lock_guard lock(mutex_);
    const auto [place, is_new] = glyphs_.try_emplace(std::string(character));
    if (is_new) {
      const Font& font = font_of(code_of(character));
      cairo_text_extents_t extents{};
      cairo_scaled_font_text_extents(font.large, place->first.c_str(), &extents);
      place->second = {font.face, extents.x_advance / kLarge};
    }
    return place->second;
  }

  const std::string& family() const { return fonts_.front().family; }

 private:
  static constexpr double kLarge = 1000;

  Typeface() : fonts_{match('0')} {}

  /// The font of that name or, where it lacks the character, another that has it, if there is one. Without any font,
  /// cairo draws plain letters of its own. Fonts of coloured pictures have no outlines and are left out.
  static Font match(char32_t code) {
    FcPattern* const wanted = FcPatternCreate();
    FcCharSet* const needed = FcCharSetCreate();
    FcCharSetAddChar(needed, code);
    FcPatternAddString(wanted, FC_FAMILY, reinterpret_cast<const FcChar8*>(kFontFamily));
    FcPatternAddCharSet(wanted, FC_CHARSET, needed);
    FcPatternAddBool(wanted, FC_SCALABLE, FcTrue);
    FcPatternAddBool(wanted, FC_COLOR, FcFalse);
    FcConfigSubstitute(nullptr, wanted, FcMatchPattern);
    FcDefaultSubstitute(wanted);
    FcResult result{};
    FcPattern* const found = FcFontMatch(nullptr, wanted, &result);
    FcCharSetDestroy(needed);
    FcPatternDestroy(wanted);

    Font font{};
    FcChar8* family = nullptr;
    const bool is_font = found != nullptr && FcPatternGetString(found, FC_FAMILY, 0, &family) == FcResultMatch;
    if (is_font) font.family = reinterpret_cast<const char*>(family);
    if (is_font) FcPatternGetCharSet(found, FC_CHARSET, 0, &font.characters);
    font.face = is_font ? cairo_ft_font_face_create_for_pattern(found)
                        : cairo_toy_font_face_create(kFontFamily, CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_font_options_t* const options = cairo_font_options_create();
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    const cairo_matrix_t size{kLarge, 0, 0, kLarge, 0, 0}, identity{1, 0, 0, 1, 0, 0};
    font.large = cairo_scaled_font_create(font.face, &size, &identity, options);
    cairo_font_options_destroy(options);
    return font;
  }

  const Font& font_of(char32_t code) {
    for (const Font& font : fonts_)
      if (font.has(code)) return font;
    const Font other = match(code);
    return other.has(code) ? fonts_.emplace_back(other) : fonts_.front();
  }

  std::deque<Font> fonts_;
  std::unordered_map<std::string, Glyph> glyphs_;
  std::mutex mutex_;
};

}  // namespace

std::string printable(std::string_view text) {
  std::string result;
  for_each_character(text, [&](std::string_view c) {
    const char32_t code = is_utf8(c) ? code_of(c) : 0xFFFF;
    if (code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x2028 || code == 0x2029)
      result += ' ';
    else
      result += (code & 0xFFFEU) == 0xFFFE ? "?" : c;  // no characters, and no XML
  });
  return result;
}

double text_width(std::string_view text, double size) {
  double width = 0;
  for_each_character(printable(text), [&](std::string_view c) { width += Typeface::instance().glyph(c).advance; });
  return size * width;
}

std::string fitted(std::string_view text, double size, double room) {
  constexpr std::string_view kEllipsis = "…";
  if (text_width(text, size) <= room * (1 + 1e-9)) return std::string(text);
  double width = text_width(kEllipsis, size);
  std::size_t end = 0;
  for_each_character(text, [&](std::string_view c) {
    width += text_width(c, size);
    if (width <= room) end += c.size();
  });
  return std::string(text.substr(0, end)).append(kEllipsis);
}

std::vector<TextRun> text_runs(std::string_view text) {
  std::vector<TextRun> runs;
  for_each_character(text, [&](std::string_view c) {
    cairo_font_face_t* const face = Typeface::instance().glyph(c).face;
    if (runs.empty() || runs.back().face != face) runs.push_back({face, {}});
    runs.back().text += c;
  });
  return runs;
}

std::string font_note() {
  const std::string& family = Typeface::instance().family();
  if (family == kFontFamily) return {};
  return fmt::format("the font {} is not installed (Debian: fonts-dejavu-core); texts of pictures are drawn {}",
                     kFontFamily, family.empty() ? "in plain letters" : "in " + family);
}

}  // namespace pulson::draw
