// Stereolithography files, whose triangles have corners and normals of their own, and Wavefront's obj.

#include <algorithm>
#include <array>
#include <cstring>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "carried_file.hpp"
#include "core/text.hpp"
#include "formats/surfaces/surface_files.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

/// Its normals are those of the triangles.
class StlFile : public CarriedFile {
 public:
  using CarriedFile::CarriedFile;

  void read(const std::string& path) {
    if (const auto count = binary_stl_triangles(text()))
      read_bytes(*count);
    else
      read_text(path);
    shape.points = corners_.vertices();
    shape.axes = stated_axes(text());
    set_missing_mark("nan");
  }

  std::string with(const Points& points, const Points& /*new_normals*/) const override {
    const std::vector<int>& corners = corners_.corners();
    Points triangles = Points::Zero(3, static_cast<Eigen::Index>(corners.size() / 3));
    for (Eigen::Index i = 0; i < triangles.cols(); ++i) {
      const auto corner = [&](Eigen::Index k) -> Eigen::Vector3d {
        return points.col(corners[static_cast<std::size_t>(3 * i + k)]);
      };
      // NaN in the corners makes it 0, as of triangles without area.
      const Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
      if (normal.norm() > 0) triangles.col(i) = normal.normalized();
    }
    return replaced(text(), points, triangles);
  }

 private:
  using Triple = std::array<double, 3>;

  void read_bytes(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < 4; ++k) {  // the normal, three corners
        const std::size_t begin = kStlHead + 4 + kStlTriangle * i + 12 * k;
        std::array<float, 3> numbers{};
        std::memcpy(numbers.data(), text().data() + begin, sizeof numbers);
        const std::uint32_t first = take({numbers[0], numbers[1], numbers[2]}, k == 0);
        for (std::uint32_t axis = 0; axis < 3; ++axis)
          add_place(begin + 4 * axis, 4, first + axis, NumberCoding::kFloat);
      }
  }

  void read_text(const std::string& path) {
    if (!text().starts_with("solid")) throw InputError(path + " is no stl file: it has no triangles, or is cut off");
    for (const text::TextLine& line : text::split_lines(path, text())) {
      std::vector<std::string_view> words = text::split_words(line.text);
      const bool is_normal = words.size() == 5 && words[0] == "facet" && words[1] == "normal";
      if (!is_normal && (words.empty() || words[0] != "vertex")) continue;
      if (is_normal) words.erase(words.begin());
      const std::uint32_t first = take(numbers_behind_word(path, line, words), is_normal);
      for (std::uint32_t axis = 0; axis < 3; ++axis)
        add_place(static_cast<std::size_t>(words[axis + 1].data() - text().data()), words[axis + 1].size(),
                  first + axis);
    }
    if (triangles_ == 0 || corners_.corners().size() != 3 * triangles_)
      throw InputError(fmt::format("{}: {} for {}", path, text::counted(corners_.corners().size(), "corner"),
                                   text::counted(triangles_, "triangle")));
  }

  /// @return the first of its three values
  std::uint32_t take(const Triple& numbers, bool is_normal) {
    if (is_normal) return static_cast<std::uint32_t>(3 * triangles_++) | NumberPlace::kNormal;
    corners_.add(numbers);
    return 3 * static_cast<std::uint32_t>(corners_.corners().back());
  }

  std::size_t triangles_ = 0;
  SharedCorners corners_;
};

/// The normal in `4/1/7` and `4//7`, with the slashes before it, which no texture coordinate ends.
std::string_view normal_in(std::string_view corner) {
  const std::size_t first = corner.find('/');
  const std::size_t second = corner.find('/', first == std::string_view::npos ? first : first + 1);
  if (second == std::string_view::npos) return {};
  return corner.substr(second == first + 1 ? first : second);
}

}  // namespace

std::unique_ptr<CarriedFile> carry_stl(const std::string& path, std::string text) {
  auto file = std::make_unique<StlFile>(std::move(text));
  file->read(path);
  return file;
}

// A normal may belong to several corners that turn differently, so that none is kept.
std::unique_ptr<CarriedFile> carry_obj(const std::string& path, std::string text) {
  auto file = std::make_unique<CarriedFile>(std::move(text));
  const char* const begin = file->text().data();
  const auto at = [&](std::string_view part) { return static_cast<std::size_t>(part.data() - begin); };
  std::vector<double> coordinates;
  std::size_t normals = 0;
  const std::vector<text::TextLine> lines = text::split_lines(path, file->text());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::vector<std::string_view> words = text::split_words(lines[i].text);
    if (words.empty()) continue;
    if (words[0] == "v")
      for (std::uint32_t axis = 0; const double number : numbers_behind_word(path, lines[i], words)) {
        file->add_place(at(words[axis + 1]), words[axis + 1].size(), static_cast<std::uint32_t>(coordinates.size()));
        coordinates.push_back(number);
        ++axis;
      }
    if (words[0] == "vn") {
      file->leave_out(at(lines[i].text), i + 1 < lines.size() ? at(lines[i + 1].text) : file->text().size());
      ++normals;
    }
    if (words[0] == "f")
      for (const std::string_view word : words)
        if (const std::string_view normal = normal_in(word); !normal.empty())
          file->leave_out(at(normal), at(normal) + normal.size());
  }
  if (normals > 0)
    file->notes.push_back(fmt::format("{}: {} (vn) left out, which other programs make from the faces", path,
                                      text::counted(normals, "normal")));
  file->set_missing_mark("nan");
  file->shape.points = text::points_from(coordinates, 3);
  file->shape.axes = stated_axes(file->text());
  return file;
}

}  // namespace pulson::formats
