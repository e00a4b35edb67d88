#include "surface_files.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "core/paths.hpp"
#include "core/text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

using Reader = Surface (*)(const std::string&, std::string_view);
const std::map<std::string, Reader, std::less<>> kSurfaceReaders = {
    {".obj", read_obj}, {".ply", read_ply}, {".stl", read_stl}};

std::string surface_extension(const std::filesystem::path& file) { return text::to_lower(file.extension().string()); }

void check_surface(const std::string& path, const Surface& surface) {
  const Points& vertices = surface.vertices.points;
  if (surface.triangles.empty()) throw InputError(path + ": it has no triangles; a surface has some");
  constexpr double kLargest = 1e100;
  if (!(vertices.array().abs() < kLargest).all())
    throw InputError(path + ": a coordinate of a vertex is missing, not finite or larger than 1e100");
  for (const auto& triangle : surface.triangles)
    for (const int corner : triangle)
      if (corner < 0 || corner >= vertices.cols())
        throw InputError(fmt::format("{}: a triangle has the vertex {} of {}", path, corner + 1, vertices.cols()));
}

// The number of the cell of each vertex, and how many cells there are.
std::pair<std::vector<int>, int> cells_of(const Points& vertices, double side) {
  const Eigen::Vector3d low = vertices.rowwise().minCoeff();
  std::map<std::array<long, 3>, int> numbers;
  std::vector<int> cells;
  cells.reserve(static_cast<std::size_t>(vertices.cols()));
  for (const auto vertex : vertices.colwise()) {
    std::array<long, 3> cell{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      cell.at(axis) = std::lround(
          std::floor((vertex[static_cast<Eigen::Index>(axis)] - low[static_cast<Eigen::Index>(axis)]) / side));
    cells.push_back(numbers.try_emplace(cell, static_cast<int>(numbers.size())).first->second);
  }
  return {std::move(cells), static_cast<int>(numbers.size())};
}

}  // namespace

Surface read_surface(const std::filesystem::path& file) {
  if (!kSurfaceReaders.contains(surface_extension(file)))
    throw InputError(fmt::format("the surface '{}' is of an unknown kind; ply, stl and obj are read", file.string()));
  return surface_of_text(file, read_file(file));
}

Surface surface_of_text(const std::filesystem::path& file, std::string_view text) {
  const std::string path = file.string();
  Surface surface = kSurfaceReaders.at(surface_extension(file))(path, text);
  surface.vertices.source = path;
  surface.vertices.axes = stated_axes(text);
  check_surface(path, surface);
  return surface;
}

Surface coarsened(const Surface& surface, int most) {
  const Points& vertices = surface.vertices.points;
  if (vertices.cols() <= most) return surface;
  // A surface of area A has about A / side² cells.
  const Eigen::Vector3d span = vertices.rowwise().maxCoeff() - vertices.rowwise().minCoeff();
  double side = std::max(span.maxCoeff(), 1e-300) / std::sqrt(most);
  auto [cells, count] = cells_of(vertices, side);
  while (count > most) {
    side *= std::max(1.05, std::sqrt(static_cast<double>(count) / most));
    std::tie(cells, count) = cells_of(vertices, side);
  }
  Surface coarse;
  coarse.vertices = surface.vertices;
  coarse.vertices.points = Points::Zero(3, count);
  Eigen::VectorXd members = Eigen::VectorXd::Zero(count);
  for (Eigen::Index i = 0; i < vertices.cols(); ++i) {
    const int cell = cells[static_cast<std::size_t>(i)];
    coarse.vertices.points.col(cell) += vertices.col(i);
    members[cell] += 1;
  }
  coarse.vertices.points.array().rowwise() /= members.transpose().array();
  for (const auto& [a, b, c] : surface.triangles) {
    const std::array<int, 3> triangle = {cells[static_cast<std::size_t>(a)], cells[static_cast<std::size_t>(b)],
                                         cells[static_cast<std::size_t>(c)]};
    if (triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0])
      coarse.triangles.push_back(triangle);
  }
  return coarse;
}

// 3D Slicer says so in a comment or, in a binary stl, in the head.
std::string stated_axes(std::string_view text) {
  constexpr std::size_t kHead = 4096;
  const std::string_view head = text.substr(0, kHead);
  for (const char* axes : {"LPS", "RAS"})
    if (head.find(std::string("SPACE=") + axes) != std::string_view::npos) return axes;
  return "";
}

void add_polygon(Surface& surface, const std::vector<int>& corners) {
  for (std::size_t i = 2; i < corners.size(); ++i)
    surface.triangles.push_back({corners[0], corners[i - 1], corners[i]});
}

}  // namespace pulson::formats
