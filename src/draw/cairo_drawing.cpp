// Drawings as PNG and as PDF, by cairo.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <numbers>

#include <cairo-pdf.h>
#include <fmt/format.h>
#include <png.h>

#include "drawing.hpp"
#include "pulson/core/errors.hpp"
#include "typeface.hpp"

namespace pulson::draw {
namespace {

constexpr double kPointsPerPixel = 0.75;

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

void require_success(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS)
    throw InputError(fmt::format("a picture cannot be drawn: {}", cairo_status_to_string(status)));
}

/// Colours as cairo has them: one number of four bytes, whose colours are multiplied by the opacity.
std::vector<std::uint32_t> premultiplied(const Raster& raster) {
  std::vector<std::uint32_t> pixels(raster.rgba.size() / 4);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const std::uint8_t* const rgba = &raster.rgba[4 * i];
    const std::uint32_t opacity = rgba[3];
    const auto part = [&](std::size_t c) { return (rgba[c] * opacity + 127) / 255; };
    pixels[i] = opacity << 24U | part(0) << 16U | part(1) << 8U | part(2);
  }
  return pixels;
}

/// Draws the parts of a drawing.
class Painter {
 public:
  /// @param least width of a line: less than a pixel of a raster would be pale, or lost
  Painter(cairo_surface_t* surface, const Drawing& drawing, double scale, double least = 0)
      : context_(cairo_create(surface), &cairo_destroy), cairo_(context_.get()), top_(drawing.top), least_(least) {
    set_colour(colour::kPaper);
    cairo_paint(cairo_);
    cairo_scale(cairo_, scale, scale);
    cairo_set_line_cap(cairo_, CAIRO_LINE_CAP_ROUND);
    cairo_set_line_join(cairo_, CAIRO_LINE_JOIN_ROUND);
    cairo_font_options_t* const options = cairo_font_options_create();
    cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    cairo_set_font_options(cairo_, options);
    cairo_font_options_destroy(options);
    for (const Layer& layer : drawing.layers) {
      cairo_save(cairo_);
      if (layer.window) clip_to(*layer.window);
      std::visit(*this, layer.shape);
      cairo_restore(cairo_);
    }
    for (const Text& text : drawing.texts) draw(text);
    require_success(cairo_status(cairo_));
  }

  void operator()(const Lines& layer) {
    set_colour(layer.stroke.colour);
    cairo_set_line_width(cairo_, std::max(layer.stroke.width, least_));
    cairo_set_dash(cairo_, layer.stroke.dashes.data(), static_cast<int>(layer.stroke.dashes.size()), 0);
    const bool is_opaque = layer.stroke.colour.opacity >= 1;  // then one by one, which takes less time
    for (const Points& line : layer.lines) {
      trace(line);
      if (is_opaque) cairo_stroke(cairo_);
    }
    cairo_stroke(cairo_);
  }

  void operator()(const Areas& layer) {
    set_colour(layer.colour);
    for (const Points& outline : layer.outlines) {
      trace(outline);
      cairo_close_path(cairo_);
    }
    cairo_fill(cairo_);
  }

  void operator()(const Circles& layer) {
    set_colour(layer.colour);
    cairo_set_line_width(cairo_, std::max(layer.ring, least_));
    for (const auto& centre : layer.centres.colwise()) {
      if (!centre.allFinite()) continue;
      cairo_new_sub_path(cairo_);
      cairo_arc(cairo_, near(centre.x()), near(top_ - centre.y()), layer.radius, 0, 2 * std::numbers::pi);
      cairo_close_path(cairo_);
    }
    layer.ring > 0 ? cairo_stroke(cairo_) : cairo_fill(cairo_);
  }

  void operator()(const Picture& layer) {
    const auto& [raster, box] = layer;
    std::vector<std::uint32_t> pixels = premultiplied(raster);
    const Surface surface(
        cairo_image_surface_create_for_data(reinterpret_cast<unsigned char*>(pixels.data()), CAIRO_FORMAT_ARGB32,
                                            raster.width, raster.height, 4 * raster.width),
        &cairo_surface_destroy);
    clip_to(box);
    cairo_translate(cairo_, box.left, top_ - box.top());
    cairo_scale(cairo_, box.width / raster.width, box.height / raster.height);
    cairo_set_source_surface(cairo_, surface.get(), 0, 0);
    cairo_pattern_set_extend(cairo_get_source(cairo_), CAIRO_EXTEND_PAD);  // whole pixels at the edges too
    cairo_paint(cairo_);
    set_colour(colour::kPaper);  // lets go of the pixels
    cairo_surface_finish(surface.get());
  }

 private:
  static double near(double pixel) { return std::clamp(pixel, -kFarAway, kFarAway); }

  void clip_to(const Box& box) {
    cairo_rectangle(cairo_, box.left, top_ - box.top(), box.width, box.height);
    cairo_clip(cairo_);
  }

  void set_colour(const Colour& colour) {
    const auto part = [&](std::size_t i) { return colour.rgb.at(i) / 255.0; };
    cairo_set_source_rgba(cairo_, part(0), part(1), part(2), colour.opacity);
  }

  void trace(const Points& line) {
    cairo_new_sub_path(cairo_);
    for (const auto& vertex : line.colwise())
      if (vertex.allFinite())
        cairo_line_to(cairo_, near(vertex.x()), near(top_ - vertex.y()));
      else
        cairo_new_sub_path(cairo_);
  }

  void draw(const Text& text) {
    double x = text.x - (text.align == Align::kLeft ? 0 : text.align == Align::kCentre ? 0.5 : 1) * text.width;
    cairo_set_font_size(cairo_, text.size);
    cairo_set_line_width(cairo_, 2 * text.margin);
    for (const TextRun& run : text_runs(text.text)) {
      cairo_set_font_face(cairo_, run.face);
      for (const bool margin : {true, false}) {
        if (margin && text.margin == 0) continue;
        set_colour(margin ? colour::kPaper : text.colour);
        cairo_move_to(cairo_, x, top_ - text.y + kTextMiddle * text.size);
        margin ? cairo_text_path(cairo_, run.text.c_str()) : cairo_show_text(cairo_, run.text.c_str());
        margin ? cairo_stroke(cairo_) : cairo_new_path(cairo_);
      }
      x += text_width(run.text, text.size);
    }
  }

  Context context_;
  cairo_t* cairo_;
  double top_;
  double least_;
};

cairo_status_t append(void* file, const unsigned char* bytes, unsigned count) {
  static_cast<std::string*>(file)->append(reinterpret_cast<const char*>(bytes), count);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

std::string encode_png(int width, int height, int bytes_of_pixel, const std::vector<std::uint8_t>& pixels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = bytes_of_pixel == 4 ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
  image.flags = PNG_IMAGE_FLAG_FAST;  // no filters: of drawings as small as with them, in a third of the time
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  const auto file = std::make_unique_for_overwrite<char[]>(size);
  if (png_image_write_to_memory(&image, file.get(), &size, 0, pixels.data(), 0, nullptr) == 0)
    throw InputError(fmt::format("a picture cannot be compressed: {}", image.message));
  return {file.get(), size};
}

std::string png_of(const Drawing& drawing, double scale) {
  constexpr double kMost = 32767;  // cairo's
  const double columns = std::round(drawing.width * scale), rows = std::round(drawing.height() * scale);
  if (!(columns <= kMost && rows <= kMost))
    throw InputError(
        fmt::format("a png of {:.0f} × {:.0f} pixels cannot be drawn; {:.0f} are the most: lower its resolution",
                    columns, rows, kMost));
  const int width = std::max(1, static_cast<int>(columns)), height = std::max(1, static_cast<int>(rows));
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height), &cairo_surface_destroy);
  require_success(cairo_surface_status(surface.get()));
  Painter(surface.get(), drawing, scale, 1 / scale);
  cairo_surface_flush(surface.get());
  const unsigned char* row = cairo_image_surface_get_data(surface.get());
  std::vector<std::uint8_t> pixels(std::size_t{3} * width * height);
  std::uint8_t* next = pixels.data();
  for (int y = 0; y < height; ++y, row += cairo_image_surface_get_stride(surface.get()))
    for (int x = 0; x < width; ++x) {
      std::uint32_t pixel = 0;
      std::memcpy(&pixel, row + std::ptrdiff_t{4} * x, 4);
      for (const unsigned shift : {16U, 8U, 0U}) *next++ = static_cast<std::uint8_t>(pixel >> shift);
    }
  return encode_png(width, height, 3, pixels);
}

std::string pdf_of(const Drawing& drawing, double scale) {
  std::string file;
  const double points = scale * kPointsPerPixel;
  const Surface surface(
      cairo_pdf_surface_create_for_stream(&append, &file, drawing.width * points, drawing.height() * points),
      &cairo_surface_destroy);
  require_success(cairo_surface_status(surface.get()));
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, "");  // the same file at any time
  Painter(surface.get(), drawing, points);
  cairo_surface_finish(surface.get());
  require_success(cairo_surface_status(surface.get()));
  return file;
}

}  // namespace pulson::draw
