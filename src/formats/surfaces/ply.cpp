// Polygon files (G. Turk): a head in text, then the elements in its order, as text or as binary numbers.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/carriers/carried_file.hpp"
#include "pulson/core/errors.hpp"
#include "surface_files.hpp"

namespace pulson::formats {
namespace {

struct PlyProperty {
  std::string name;
  std::string type;    // of its values
  std::string length;  // type of the number of values, of a list; else empty
};

struct PlyElement {
  std::string name;
  std::size_t count;
  std::vector<PlyProperty> properties;
};

struct PlyHead {
  std::string format;
  std::vector<PlyElement> elements;
  std::size_t end = 0;  // of the head in the file
};

[[noreturn]] void refuse(const std::string& path, const std::string& reason) { throw InputError(path + ": " + reason); }

PlyHead read_head(const std::string& path, std::string_view text) {
  PlyHead head;
  std::string_view rest = text;
  const char line_end = '\n';
  if (text::trim(text::take_line(rest, line_end)) != "ply") refuse(path, "it does not begin with the line 'ply'");
  while (!rest.empty()) {
    const std::vector<std::string_view> words = text::split_words(text::take_line(rest, line_end));
    if (words.empty()) continue;
    if (words[0] == "end_header") {
      head.end = text.size() - rest.size();
      return head;
    }
    if (words[0] == "format" && words.size() > 1) head.format = words[1];
    if (words[0] == "element" && words.size() == 3) {
      if (words[2].size() > 9 || !std::all_of(words[2].begin(), words[2].end(), text::is_digit))
        refuse(path, fmt::format("the number of its elements is {}", text::in_quotes(words[2])));
      head.elements.push_back({std::string(words[1]), std::stoul(std::string(words[2])), {}});
    }
    if (words[0] != "property") continue;
    if (head.elements.empty() || words.size() < 3) refuse(path, "a property in its head has no element or no name");
    const bool is_list = words[1] == "list" && words.size() > 4;
    head.elements.back().properties.push_back({std::string(words.back()), std::string(words[words.size() - 2]),
                                               is_list ? std::string(words[2]) : std::string()});
  }
  refuse(path, "its head has no end: the line 'end_header' is missing");
}

template <typename Number>
double as_number(const char* bytes) {
  Number number;
  std::memcpy(&number, bytes, sizeof number);
  return static_cast<double>(number);
}

// Values one after the other.
class PlyValues {
 public:
  /// @param begin of the values in the text
  PlyValues(const std::string& path, std::string_view text, std::size_t begin, const std::string& format)
      : path_(path),
        size_(text.size()),
        rest_(text.substr(begin)),
        is_text_(format == "ascii"),
        swaps_(swaps_bytes(format)) {}

  double take(const std::string& type) { return is_text_ ? take_word() : take_bytes(type); }

  /// Where the value that was taken last stands.
  std::size_t begin() const { return size_ - rest_.size() - length_; }
  std::size_t length() const { return length_; }

 private:
  bool swaps_bytes(const std::string& format) const {
    const bool is_big = format == "binary_big_endian";
    if (!is_big && format != "ascii" && format != "binary_little_endian")
      refuse(path_, fmt::format("its format is {}; ascii, binary_little_endian and binary_big_endian are read",
                                text::in_quotes(format)));
    return is_big == (std::endian::native == std::endian::little);
  }

  double take_word() {
    constexpr std::string_view kBlanks = " \t\r\n";
    rest_.remove_prefix(std::min(rest_.find_first_not_of(kBlanks), rest_.size()));
    const std::string_view word = rest_.substr(0, rest_.find_first_of(kBlanks));
    rest_.remove_prefix(word.size());
    length_ = word.size();
    if (word.empty()) refuse(path_, "it ends before its last element");
    if (!text::is_number(word)) refuse(path_, fmt::format("{} is not a number", text::in_quotes(word)));
    return std::strtod(std::string(word).c_str(), nullptr);
  }

  double take_bytes(const std::string& type) {
    using Convert = double (*)(const char*);
    struct Kind {
      const char* names;
      std::size_t size;
      Convert convert;
    };
    static constexpr Kind kKinds[] = {
        {" char int8 ", 1, as_number<std::int8_t>},    {" uchar uint8 ", 1, as_number<std::uint8_t>},
        {" short int16 ", 2, as_number<std::int16_t>}, {" ushort uint16 ", 2, as_number<std::uint16_t>},
        {" int int32 ", 4, as_number<std::int32_t>},   {" uint uint32 ", 4, as_number<std::uint32_t>},
        {" float float32 ", 4, as_number<float>},      {" double float64 ", 8, as_number<double>}};
    for (const Kind& kind : kKinds) {
      if (std::string_view(kind.names).find(' ' + type + ' ') == std::string_view::npos) continue;
      if (rest_.size() < kind.size) refuse(path_, "it ends before its last element");
      char bytes[8];
      std::copy_n(rest_.begin(), kind.size, bytes);
      if (swaps_) std::reverse(bytes, bytes + kind.size);
      rest_.remove_prefix(kind.size);
      length_ = kind.size;
      return kind.convert(bytes);
    }
    refuse(path_, fmt::format("a property is of the unknown type {}", text::in_quotes(type)));
  }

  const std::string& path_;
  std::size_t size_;
  std::string_view rest_;
  std::size_t length_ = 0;
  bool is_text_;
  bool swaps_;
};

void read_vertices(const PlyElement& element, PlyValues& values, std::size_t most, Surface& surface,
                   const std::string& path) {
  if (element.count > most) refuse(path, "it ends before its last vertex");
  surface.vertices.points.setConstant(3, static_cast<Eigen::Index>(element.count), text::kMissing);
  for (Eigen::Index i = 0; i < surface.vertices.points.cols(); ++i)
    for (const PlyProperty& property : element.properties) {
      const double length = property.length.empty() ? 1 : values.take(property.length);
      for (int k = 0; k < length; ++k) {
        const double value = values.take(property.type);
        const std::size_t axis =
            property.name.size() == 1 ? text::kAxisLetters.find(property.name) : std::string_view::npos;
        if (axis != std::string_view::npos) surface.vertices.points(static_cast<Eigen::Index>(axis), i) = value;
      }
    }
}

// Faces, and elements that are of no use here.
void read_others(const PlyElement& element, PlyValues& values, Surface& surface) {
  std::vector<int> corners;
  for (std::size_t i = 0; i < element.count; ++i)
    for (const PlyProperty& property : element.properties) {
      const double length = property.length.empty() ? 1 : values.take(property.length);
      corners.clear();
      for (int k = 0; k < length; ++k) {
        const double corner = values.take(property.type);
        corners.push_back(std::abs(corner) < 2e9 ? static_cast<int>(corner) : -1);
      }
      if (element.name == "face" && (property.name == "vertex_indices" || property.name == "vertex_index"))
        add_polygon(surface, corners);
    }
}

}  // namespace

Surface read_ply(const std::string& path, std::string_view text) {
  const PlyHead head = read_head(path, text);
  PlyValues values(path, text, head.end, head.format);
  Surface surface;
  for (const PlyElement& element : head.elements) {
    if (element.properties.empty()) continue;
    if (element.name == "vertex")
      read_vertices(element, values, text.size(), surface, path);
    else
      read_others(element, values, surface);
  }
  return surface;
}

namespace {

NumberCoding coding_of(const std::string& path, const PlyHead& head, const std::string& type) {
  const bool is_float = type == "float" || type == "float32";
  if (!is_float && type != "double" && type != "float64")
    refuse(path, fmt::format("its coordinates are of the type {}, which holds no place between whole numbers; save it "
                             "with coordinates of the type float",
                             text::in_quotes(type)));
  if (head.format == "ascii") return is_float ? NumberCoding::kTextOfFloat : NumberCoding::kText;
  if (head.format == "binary_big_endian") return is_float ? NumberCoding::kBigFloat : NumberCoding::kBigDouble;
  return is_float ? NumberCoding::kFloat : NumberCoding::kDouble;
}

// 0, 1, 2 of x, y, z and of nx, ny, nz.
struct PlyAxis {
  Eigen::Index axis;
  bool is_normal;
};

std::optional<PlyAxis> axis_of(const PlyProperty& property) {
  const bool is_normal = property.name.size() == 2 && property.name.front() == 'n';
  if (!property.length.empty() || (property.name.size() != 1 && !is_normal)) return std::nullopt;
  const std::size_t axis = text::kAxisLetters.find(property.name.back());
  return axis == std::string_view::npos ? std::nullopt
                                        : std::optional(PlyAxis{static_cast<Eigen::Index>(axis), is_normal});
}

// The coordinates and, where all three are there, the normals of all vertices.
class PlyPlaces {
 public:
  PlyPlaces(const std::string& path, const PlyHead& head, const PlyElement& element, CarriedFile& file)
      : element_(element), file_(file) {
    int coordinates = 0, normals = 0;
    for (const PlyProperty& property : element.properties) {
      axes_.push_back(axis_of(property));
      codings_.push_back(axes_.back() ? coding_of(path, head, property.type) : NumberCoding::kText);
      if (!axes_.back()) continue;
      (axes_.back()->is_normal ? normals : coordinates) += 1;
    }
    if (coordinates != 3) refuse(path, "its vertices need the properties x, y and z, each once");
    has_normals_ = normals == 3;
  }

  void read(PlyValues& values) {
    const auto count = static_cast<Eigen::Index>(element_.count);
    file_.shape.points.setConstant(3, count, text::kMissing);
    file_.normals.setConstant(3, has_normals_ ? count : 0, text::kMissing);
    for (Eigen::Index i = 0; i < count; ++i) {
      if (has_normals_) file_.normal_points.push_back(static_cast<int>(i));
      for (std::size_t k = 0; k < axes_.size(); ++k) read_property(k, i, values);
    }
  }

 private:
  void read_property(std::size_t number, Eigen::Index vertex, PlyValues& values) {
    const PlyProperty& property = element_.properties[number];
    const std::optional<PlyAxis>& axis = axes_[number];
    const double length = property.length.empty() ? 1 : values.take(property.length);
    for (int k = 0; k < length; ++k) {
      const double value = values.take(property.type);
      if (!axis || (axis->is_normal && !has_normals_)) continue;
      (axis->is_normal ? file_.normals : file_.shape.points)(axis->axis, vertex) = value;
      const auto place = static_cast<std::uint32_t>(3 * vertex + axis->axis);
      file_.add_place(values.begin(), values.length(), axis->is_normal ? place | NumberPlace::kNormal : place,
                      codings_[number]);
    }
  }

  const PlyElement& element_;
  CarriedFile& file_;
  std::vector<std::optional<PlyAxis>> axes_;
  std::vector<NumberCoding> codings_;
  bool has_normals_ = false;
};

}  // namespace

std::unique_ptr<CarriedFile> carry_ply(const std::string& path, std::string text) {
  auto file = std::make_unique<CarriedFile>(std::move(text));
  const PlyHead head = read_head(path, file->text());
  PlyValues values(path, file->text(), head.end, head.format);
  Surface passed_over;
  for (const PlyElement& element : head.elements) {
    if (element.properties.empty()) continue;
    if (element.name != "vertex") {
      read_others(element, values, passed_over);
      continue;
    }
    if (element.count > file->text().size()) refuse(path, "it ends before its last vertex");
    PlyPlaces(path, head, element, *file).read(values);
    break;
  }
  file->set_missing_mark("nan");
  file->shape.axes = stated_axes(file->text());
  return file;
}

}  // namespace pulson::formats
