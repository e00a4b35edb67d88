// Surfaces in ply, stl and obj: what they hold, and that no broken file is taken for one.
#include "formats/surfaces/surface_files.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

#include <gmock/gmock.h>

#include "error_of.hpp"
#include "pulson/core/errors.hpp"
#include "real_landmark_files.hpp"
#include "temporary_folder.hpp"

namespace pulson::formats {
namespace {

using Triangle = std::array<int, 3>;

/// A pyramid: vertices (0,0,0), (2,0,0), (2,3,0), (0,3,0), (1,1,4), a base of four corners and four sides.
Points pyramid() { return (Points(3, 5) << 0, 2, 2, 0, 1, 0, 0, 3, 3, 1, 0, 0, 0, 0, 4).finished(); }
std::vector<Eigen::Vector3d> vertices() {
  std::vector<Eigen::Vector3d> places;
  for (Eigen::Index i = 0; i < pyramid().cols(); ++i) places.emplace_back(pyramid().col(i));
  return places;
}
const std::vector<std::vector<int>> kFaces = {{0, 1, 2, 3}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
const std::vector<Triangle> kTriangles = {{0, 1, 2}, {0, 2, 3}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};

template <typename Number>
void append(std::string& bytes, Number number, bool reversed) {
  char raw[sizeof number];
  std::memcpy(raw, &number, sizeof number);
  if (reversed) std::reverse(raw, raw + sizeof number);
  bytes.append(raw, sizeof number);
}

std::string ply_head(const std::string& format) {
  return "ply\nformat " + format +
         " 1.0\ncomment SPACE=RAS\nelement vertex 5\nproperty uchar red\nproperty float x\nproperty double y\n"
         "property float z\nelement face 5\nproperty list uchar int vertex_indices\nproperty short flag\nend_header\n";
}

std::string text_ply() {
  std::string text = ply_head("ascii");
  for (const Eigen::Vector3d& vertex : vertices())
    text +=
        "255 " + std::to_string(vertex[0]) + " " + std::to_string(vertex[1]) + " " + std::to_string(vertex[2]) + "\n";
  for (const auto& face : kFaces) {
    text += std::to_string(face.size());
    for (const int corner : face) text += " " + std::to_string(corner);
    text += " -7\n";
  }
  return text;
}

std::string binary_ply(bool is_big) {
  std::string bytes = ply_head(is_big ? "binary_big_endian" : "binary_little_endian");
  for (const Eigen::Vector3d& vertex : vertices()) {
    append(bytes, static_cast<std::uint8_t>(255), is_big);
    append(bytes, static_cast<float>(vertex[0]), is_big);
    append(bytes, vertex[1], is_big);
    append(bytes, static_cast<float>(vertex[2]), is_big);
  }
  for (const auto& face : kFaces) {
    append(bytes, static_cast<std::uint8_t>(face.size()), is_big);
    for (const int corner : face) append(bytes, static_cast<std::int32_t>(corner), is_big);
    append(bytes, static_cast<std::int16_t>(-7), is_big);
  }
  return bytes;
}

std::string text_stl() {
  std::string text = "solid pyramid\n";
  for (const Triangle& triangle : kTriangles) {
    text += " facet normal 0 0 1\n  outer loop\n";
    for (const int corner : triangle) {
      const Eigen::Vector3d place = pyramid().col(corner);
      text += "   vertex " + std::to_string(place[0]) + " " + std::to_string(place[1]) + " " +
              std::to_string(place[2]) + "\n";
    }
    text += "  endloop\n endfacet\n";
  }
  return text + "endsolid\n";
}

std::string binary_stl() {
  std::string bytes = "solid, and yet binary; SPACE=LPS";
  bytes.resize(80, ' ');
  append(bytes, static_cast<std::uint32_t>(kTriangles.size()), false);
  for (const Triangle& triangle : kTriangles) {
    for (int axis = 0; axis < 3; ++axis) append(bytes, 0.0F, false);
    for (const int corner : triangle)
      for (int axis = 0; axis < 3; ++axis) append(bytes, static_cast<float>(pyramid()(axis, corner)), false);
    append(bytes, static_cast<std::uint16_t>(0), false);
  }
  return bytes;
}

const std::string kObj =
    "# a pyramid\nv 0 0 0\nv 2 0 0 0.5\nv 2 3 0\nv 0 3 0\nv 1 1 4\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf 1//1 2//1 "
    "5//1\n"
    "f 2 3 5\nf 3 4 -1\nf -2 1 -1\n";

class SurfaceFiles : public InTemporaryFolder {
 protected:
  static Surface read(const std::string& name, const std::string& bytes) {
    write(name, bytes);
    return read_surface(name);
  }

  static void expect_pyramid(const std::string& name, const std::string& bytes) {
    const Surface surface = read(name, bytes);
    EXPECT_EQ(surface.vertices.points, pyramid()) << name;
    EXPECT_EQ(surface.triangles, kTriangles) << name;
  }

  static void expect_error(const std::string& name, const std::string& bytes, const std::string& message) {
    EXPECT_THAT(error_of([&] { read(name, bytes); }), testing::HasSubstr(message));
  }
};

TEST_F(SurfaceFiles, HoldTheSamePyramid) {
  expect_pyramid("a.ply", text_ply());
  expect_pyramid("a.ply", binary_ply(false));
  expect_pyramid("a.PLY", binary_ply(true));
  expect_pyramid("a.stl", text_stl());
  expect_pyramid("a.stl", binary_stl());
  expect_pyramid("a.obj", kObj);
}

TEST_F(SurfaceFiles, StateTheirAxesAsSlicerDoes) {
  EXPECT_EQ(read("a.ply", binary_ply(false)).vertices.axes, "RAS");
  EXPECT_EQ(read("a.stl", binary_stl()).vertices.axes, "LPS");
  EXPECT_EQ(read("a.obj", kObj).vertices.axes, "");
}

TEST_F(SurfaceFiles, AreRefusedWhereBroken) {
  expect_error("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "a triangle has the vertex 0 of 3");
  expect_error("a.obj", "v 0 0 0\nv 1 0\n", "a.obj:2: a vertex has three coordinates");
  expect_error("a.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", "a coordinate of a vertex is missing");
  expect_error("a.obj", "v 0 0 0\n", "it has no triangles");
  expect_error("a.obj", "f x y z\n", "'x' is not a vertex");
  expect_error("a.stl", "something else", "neither text that begins with 'solid'");
  expect_error("a.ply", "plyx", "it does not begin with the line 'ply'");
  expect_error("a.ply", "ply\nformat ascii 1.0\nelement vertex 99999999999\n", "the number of its elements is");
  expect_error("a.ply", "ply\nformat binary_middle_endian 1.0\nend_header\n", "its format is 'binary_middle_endian'");
  expect_error("a.vtk", "", "ply, stl and obj are read");
  EXPECT_THAT(error_of([] { read_surface("missing.ply"); }), testing::HasSubstr("missing.ply"));
  std::filesystem::create_directory("folder.ply");
  EXPECT_THAT(error_of([] { read_surface("folder.ply"); }), testing::HasSubstr("folder.ply"));
}

// Of no file cut short is more read than it holds; at most the last blanks are missed without harm.
TEST_F(SurfaceFiles, AreRefusedWhereCutShort) {
  for (const std::string& whole : {text_ply(), binary_ply(false), binary_ply(true)})
    for (std::size_t length = 0; length + 3 < whole.size(); ++length)
      EXPECT_THROW(read("cut.ply", whole.substr(0, length)), InputError) << length;
  const std::string whole = binary_stl();
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_THROW(read("cut.stl", whole.substr(0, length)), InputError) << length;
}

/// A sphere of radius 1, by rings of latitude.
Surface sphere(int rings, int around) {
  Surface surface;
  surface.vertices.points.resize(3, rings * around);
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < around; ++j) {
      const double polar = std::numbers::pi * (i + 0.5) / rings, angle = 2 * std::numbers::pi * j / around;
      surface.vertices.points.col(i * around + j) << std::sin(polar) * std::cos(angle),
          std::sin(polar) * std::sin(angle), std::cos(polar);
      if (i > 0)
        add_polygon(surface, {(i - 1) * around + j, (i - 1) * around + (j + 1) % around, i * around + (j + 1) % around,
                              i * around + j});
    }
  return surface;
}

TEST(CoarsenedSurfaces, KeepTheirShapeWithFewerVertices) {
  const Surface fine = sphere(120, 240), coarse = coarsened(fine, 1000);
  const Eigen::Index count = coarse.vertices.points.cols();
  EXPECT_LE(count, 1000);
  EXPECT_GE(count, 250);
  // The mean of points of the unit sphere in a cube of side s lies within it and at most (√3 s)² / 2 below its surface;
  // s² count is at most about the area 4π times the greatest number of cubes per area, √3.
  const double side_squared = 4 * std::numbers::pi * std::sqrt(3) / static_cast<double>(count);
  const Eigen::RowVectorXd radii = coarse.vertices.points.colwise().norm();
  EXPECT_LE(radii.maxCoeff(), 1 + 1e-12);
  EXPECT_GE(radii.minCoeff(), 1 - 1.5 * side_squared);
  std::set<int> used;
  for (const Triangle& triangle : coarse.triangles) used.insert(triangle.begin(), triangle.end());
  EXPECT_EQ(used.size(), static_cast<std::size_t>(count));
  EXPECT_EQ(coarsened(fine, 1 << 20).triangles, fine.triangles);
}

TEST(RealSurfaces, LieBelowTheirLandmarks) {
  const std::filesystem::path mesh = data_folder() / "slicer_mouse_meshes/A_J.ply";
  if (!std::filesystem::exists(mesh)) GTEST_SKIP() << "no " << mesh << "; PULSON_DATA may name the folder";
  const Surface surface = read_surface(mesh);
  EXPECT_EQ(surface.vertices.points.cols(), 79254);
  EXPECT_EQ(surface.triangles.size(), 159760U);
  EXPECT_EQ(surface.vertices.axes, "LPS");
  const LandmarkFile file = read_landmark_file(data_folder() / "slicer_mrkjson/A_J.mrk.json");
  for (const auto landmark : file.shapes[0].points.colwise())  // in mm, placed by hand on a skull 26 mm long
    EXPECT_LT((surface.vertices.points.colwise() - landmark).colwise().norm().minCoeff(), 0.5);
}

}  // namespace
}  // namespace pulson::formats
