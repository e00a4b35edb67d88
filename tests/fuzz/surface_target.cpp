#include <string>

#include <fmt/format.h>

#include "formats/surfaces/surface_files.hpp"
#include "fuzz_targets.hpp"
#include "fuzzing.hpp"

namespace pulson::fuzz {
namespace {

using formats::Surface;

void check_surface(const formats::Surface& surface) {
  const Points& vertices = surface.vertices.points;
  require(vertices.rows() == 3 && vertices.allFinite(), "a surface has finite vertices in space");
  require(!surface.triangles.empty(), "a surface has a triangle");
  for (const auto& triangle : surface.triangles)
    for (const int corner : triangle)
      require(corner >= 0 && corner < vertices.cols(), "a corner is a vertex that is not there");
}

std::string as_obj(const formats::Surface& surface) {
  std::string text;
  for (const auto& vertex : surface.vertices.points.colwise())
    text += fmt::format("v {:.17g} {:.17g} {:.17g}\n", vertex.x(), vertex.y(), vertex.z());
  for (const auto& [a, b, c] : surface.triangles) text += fmt::format("f {} {} {}\n", a + 1, b + 1, c + 1);
  return text;
}

void check_coarsened(const formats::Surface& surface) {
  constexpr int kMost = 4;
  const formats::Surface coarse = coarsened(surface, kMost);
  require(coarse.vertices.points.cols() <= kMost, "a coarse surface has too many vertices");
  require(coarse.triangles.size() <= surface.triangles.size(), "a coarse surface has more triangles");
  if (!coarse.triangles.empty()) check_surface(coarse);
}

}  // namespace

bool surfaces(std::string_view input) {
  const std::size_t end = input.find('\n');
  const std::string kind(input.substr(0, end));
  if (end == std::string_view::npos || (kind != "ply" && kind != "stl" && kind != "obj")) return false;
  const std::string_view text = input.substr(end + 1);
  const auto surface = attempt([&] { return formats::surface_of_text("f." + kind, text); });
  if (!surface) return true;
  check_surface(*surface);
  // What is kept is bounded by the size of the file, whatever numbers its head claims.
  require(static_cast<std::size_t>(surface->vertices.points.cols()) <= text.size() &&
              surface->triangles.size() <= text.size(),
          "a surface has more vertices or triangles than its file has bytes");
  const formats::Surface back = demand("a surface that is written is not read",
                                       [&] { return formats::surface_of_text("f.obj", as_obj(*surface)); });
  require(back.vertices.points == surface->vertices.points && back.triangles == surface->triangles,
          "a surface changes when it is written and read");
  check_coarsened(*surface);
  return true;
}

}  // namespace pulson::fuzz
