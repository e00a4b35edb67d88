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

/// Calls `visit` with each character of a printable text.
template <class Visit>
void for_each_character(std::string_view text, const Visit& visit) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = std::max<std::size_t>(utf8_length(text, i), 1);
    visit(text.substr(i, length));
    i += length;
  }
}

struct Font {
  cairo_font_face_t* face;
  cairo_scaled_font_t* large;   // without hints, so that widths grow as sizes do
  const FcCharSet* characters;  // nullptr: all

  bool has(char32_t code) const {
    return characters == nullptr || FcCharSetHasChar(characters, static_cast<FcChar32>(code)) != FcFalse;
  }
};

/// The fonts and the widths of the characters that were asked for; it lives as long as the program.
class Typeface {
 public:
  struct Glyph {
    const Font* font;
    double advance;  // in font sizes
  };

  static Typeface& instance() {
    static auto* const typeface = new Typeface;
    return *typeface;
  }

  Glyph glyph(std::string_view character) {
    const std::lock_guard lock(mutex_);
    const auto [place, is_new] = glyphs_.try_emplace(code_of(character));
    if (is_new) place->second = measured(character, place->first);
    return place->second;
  }

  const std::string& family() const { return family_; }

 private:
  static constexpr double kLarge = 1000;

  Typeface() : wanted_(FcPatternCreate()) {
    FcPatternAddString(wanted_, FC_FAMILY, reinterpret_cast<const FcChar8*>(kFontFamily));
    FcPatternAddBool(wanted_, FC_SCALABLE, FcTrue);
    FcConfigSubstitute(nullptr, wanted_, FcMatchPattern);
    FcDefaultSubstitute(wanted_);
    FcResult result{};
    add(FcFontMatch(nullptr, wanted_, &result));
  }

  /// Without a font at all, cairo draws plain letters of its own.
  void add(FcPattern* pattern) {
    FcCharSet* characters = nullptr;
    FcChar8* family = nullptr;
    const bool is_font =
        pattern != nullptr && FcPatternGetCharSet(pattern, FC_CHARSET, 0, &characters) == FcResultMatch;
    if (family_.empty() && is_font && FcPatternGetString(pattern, FC_FAMILY, 0, &family) == FcResultMatch)
      family_ = reinterpret_cast<const char*>(family);
    cairo_font_face_t* const face =
        is_font ? cairo_ft_font_face_create_for_pattern(pattern)
                : cairo_toy_font_face_create(kFontFamily, CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_font_options_t* const options = cairo_font_options_create();
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    cairo_matrix_t identity, size;
    cairo_matrix_init_identity(&identity);
    cairo_matrix_init_scale(&size, kLarge, kLarge);
    fonts_.push_back({face, cairo_scaled_font_create(face, &size, &identity, options), characters});
    cairo_font_options_destroy(options);
  }

  /// Adds the first other font that has the character, if there is one.
  void add_font_with(char32_t code) {
    FcResult result{};
    if (others_ == nullptr) others_ = FcFontSort(nullptr, wanted_, FcTrue, nullptr, &result);
    for (int i = 0; others_ != nullptr && i < others_->nfont; ++i) {
      FcCharSet* characters = nullptr;
      FcBool in_colour = FcFalse;  // pictures of letters, which have no outlines
      FcPatternGetBool(others_->fonts[i], FC_COLOR, 0, &in_colour);
      if (in_colour != FcFalse || FcPatternGetCharSet(others_->fonts[i], FC_CHARSET, 0, &characters) != FcResultMatch ||
          FcCharSetHasChar(characters, static_cast<FcChar32>(code)) == FcFalse)
        continue;
      return add(FcFontRenderPrepare(nullptr, wanted_, others_->fonts[i]));
    }
  }

  const Font& font_of(char32_t code) {
    for (const Font& font : fonts_)
      if (font.has(code)) return font;
    add_font_with(code);
    return fonts_.back().has(code) ? fonts_.back() : fonts_.front();
  }

  Glyph measured(std::string_view character, char32_t code) {
    const Font& font = font_of(code);
    cairo_text_extents_t extents{};
    cairo_scaled_font_text_extents(font.large, std::string(character).c_str(), &extents);
    return {&font, extents.x_advance / kLarge};
  }

  FcPattern* wanted_;
  FcFontSet* others_ = nullptr;
  std::string family_;
  std::deque<Font> fonts_;
  std::unordered_map<char32_t, Glyph> glyphs_;
  std::mutex mutex_;
};

constexpr std::string_view kEllipsis = "…";

}  // namespace

std::string printable(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    const std::string_view character = text.substr(i, std::max<std::size_t>(length, 1));
    const char32_t code = length == 0 ? '?' : code_of(character);
    const bool is_control = code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x2028 || code == 0x2029;
    if (is_control)
      result += ' ';
    else if (length == 0 || (code & 0xFFFEU) == 0xFFFE)  // the latter are no characters, and no XML
      result += '?';
    else
      result += character;
    i += character.size();
  }
  return result;
}

double text_width(std::string_view text, double size) {
  double width = 0;
  for_each_character(text, [&](std::string_view c) { width += Typeface::instance().glyph(c).advance; });
  return size * width;
}

std::string fitted(std::string_view text, double size, double room) {
  if (text_width(text, size) <= room * (1 + 1e-9)) return std::string(text);
  double width = text_width(kEllipsis, size);
  std::size_t end = 0;
  bool is_full = false;
  for_each_character(text, [&](std::string_view c) {
    width += size * Typeface::instance().glyph(c).advance;
    is_full = is_full || width > room;
    if (!is_full) end += c.size();
  });
  return std::string(text.substr(0, end)).append(kEllipsis);
}

std::vector<TextRun> text_runs(std::string_view text) {
  std::vector<TextRun> runs;
  for_each_character(text, [&](std::string_view c) {
    cairo_font_face_t* const face = Typeface::instance().glyph(c).font->face;
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
