// Shapes made from bytes without any text between, so that writers meet what no reader of a mutated text comes to soon.

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "fuzz_targets.hpp"
#include "landmark_laws.hpp"

namespace pulson::fuzz {
namespace {

using namespace std::literals;

/// What names are made of, between bars: words and signs that mean something to one of the formats.
constexpr std::string_view kBarredWords =
    "| |a|b|1|2|0|-1|1.5|1,5|1e3|NA|nan|inf|null|,|;|\t|\"|'|#|//|\\|=|:|[|]|{|}|(|\n|\r|\0|\v|\f|\x7F|\xC2\xA0|"
    "\xC3\xA9|\xFF|\xEF\xBB\xBF|\xE2\x80\xA8|\xF0\x9F\x90\x9F|\x1B[1m|x|y|z|X1|x1|p_x|label|landmark|group|"
    "specimen|scorer|bodyparts|coords|likelihood|individuals|LM|LM3|ID|IMAGE|SCALE|CURVES|OUTLINES|POINTS|"
    "COMMENT|VARIABLES|points|shapes|shape_type|imagePath|markups|source|target|result|index|point|version: 1|"
    "n_points: |# vtk|# Markups fiducial file version = 4.11|[individuals]|vtkMRMLMarkupsFiducialNode_1|Pt-1|"
    "Point|mm|LPS|RAS|voxels|f|f#1|curve 1|type|Curve|Fiducial|outline 1"sv;

std::vector<std::string_view> split_words() {
  std::vector<std::string_view> words;
  for (std::string_view left = kBarredWords; !left.empty();) {
    const std::size_t end = std::min(left.find('|'), left.size());
    words.push_back(left.substr(0, end));
    left.remove_prefix(std::min(end + 1, left.size()));
  }
  return words;
}

const std::vector<std::string_view> kWords = split_words();

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::array kNumbers = {0.0,  -0.0,   1.0,  -1.0, 2.0,  3.0,    0.5,  0.1,       -9999.0, -999.0,   kNaN,
                                 1e-5, 5e-324, 1e15, 1e16, 1e22, -1e300, 1e17, 1234567.0, 12.25,   0.1 + 0.2};

/// Takes what a file holds from the front of bytes; zeros where they have ended.
class ShapesFromBytes {
 public:
  explicit ShapesFromBytes(std::string_view bytes) : left_(bytes) {}

  formats::LandmarkFile file() {
    formats::LandmarkFile file;
    for (std::size_t count = 1 + below(3); count > 0; --count) file.shapes.push_back(shape());
    if (below(4) == 1) file.units = text();
    if (below(4) == 1) file.axes = text();
    return file;
  }

 private:
  std::size_t byte() {
    if (left_.empty()) return 0;
    const auto value = static_cast<unsigned char>(left_.front());
    left_.remove_prefix(1);
    return value;
  }

  std::size_t below(std::size_t end) { return byte() % end; }

  std::string text() {
    std::string text;
    std::size_t value = byte();
    for (; value >= 128; value = byte()) text += kWords[value % kWords.size()];
    return text += kWords[value % kWords.size()];
  }

  std::vector<std::string> texts(std::size_t count) {
    std::vector<std::string> all(count);
    for (std::string& one : all) one = text();
    return all;
  }

  Points points(std::size_t dimension) {
    Points points(static_cast<Eigen::Index>(dimension), static_cast<Eigen::Index>(below(6)));
    for (double& value : points.reshaped()) value = kNumbers[below(kNumbers.size())];
    return points;
  }

  std::vector<Points> lines(std::size_t dimension) {
    std::vector<Points> lines(below(3));
    for (Points& line : lines) line = points(below(8) == 1 ? 1 + below(3) : dimension);
    return lines;
  }

  Landmarks shape() {
    Landmarks shape;
    const std::size_t dimension = 1 + (below(8) + 1) % 3;
    shape.points = points(dimension);
    const auto count = static_cast<std::size_t>(shape.count());
    const std::size_t parts = byte();
    if ((parts & 1U) != 0) shape.labels = texts(count);
    if ((parts & 2U) != 0) shape.groups = texts(count);
    if ((parts & 4U) != 0) shape.name = text();
    if ((parts & 8U) != 0) shape.image = text();
    if ((parts & 16U) != 0) shape.scale = kNumbers[below(9)];
    if ((parts & 32U) != 0)
      for (std::size_t left = below(4); left > 0; --left) {
        const std::string name = text();
        shape.properties.emplace_back(name, text());
      }
    if ((parts & 64U) != 0) shape.curves = lines(dimension);
    if ((parts & 128U) != 0) shape.outlines = lines(dimension);
    return shape;
  }

  std::string_view left_;
};

}  // namespace

bool shapes(std::string_view input) {
  const formats::LandmarkFile file = ShapesFromBytes(input).file();
  check_writers(file);
  return true;
}

}  // namespace pulson::fuzz
