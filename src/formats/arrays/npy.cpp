// Landmarks in arrays of numpy: magic, version, length of the header, the header (a dictionary of Python), the numbers.

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/atomic_file.hpp"
#include "core/text.hpp"
#include "formats/formats.hpp"
#include "formats/landmark_writers.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {

std::string npy_bytes(std::span<const double> numbers, const std::vector<std::size_t>& shape) {
  constexpr std::size_t kAlignment = 64;  // of the numbers
  constexpr std::size_t kPrefix = 10;     // magic, version, length of the header
  static_assert(std::endian::native == std::endian::little);
  std::string header =
      fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({},), }}", fmt::join(shape, ", "));
  header.append(kAlignment - 1 - (kPrefix + header.size()) % kAlignment, ' ');
  header += '\n';
  std::string file("\x93NUMPY\x01\x00", 8);
  file += static_cast<char>(header.size() & 0xFFU);
  file += static_cast<char>(header.size() >> 8U);
  file += header;
  const std::size_t begin = file.size();
  file.resize(begin + numbers.size_bytes());
  if (!numbers.empty()) std::memcpy(file.data() + begin, numbers.data(), numbers.size_bytes());
  return file;
}

void write_npy(const std::filesystem::path& path, std::span<const double> numbers,
               const std::vector<std::size_t>& shape) {
  write_file_atomically(path, npy_bytes(numbers, shape));
}

namespace {

constexpr std::string_view kNpyMagic = "\x93NUMPY";

// ---- types of numbers

template <class Number>
double number_at(const char* bytes, bool is_big) {
  std::array<char, sizeof(Number)> copy;
  std::copy_n(bytes, copy.size(), copy.begin());
  static_assert(std::endian::native == std::endian::little);
  if (is_big) std::reverse(copy.begin(), copy.end());
  return static_cast<double>(std::bit_cast<Number>(copy));
}

struct NumberType {
  std::string_view name;
  std::size_t size;
  double (*number)(const char*, bool is_big);
};

constexpr std::array<NumberType, 10> kNumberTypes = {{{"f4", 4, number_at<float>},
                                                      {"f8", 8, number_at<double>},
                                                      {"i1", 1, number_at<std::int8_t>},
                                                      {"i2", 2, number_at<std::int16_t>},
                                                      {"i4", 4, number_at<std::int32_t>},
                                                      {"i8", 8, number_at<std::int64_t>},
                                                      {"u1", 1, number_at<std::uint8_t>},
                                                      {"u2", 2, number_at<std::uint16_t>},
                                                      {"u4", 4, number_at<std::uint32_t>},
                                                      {"u8", 8, number_at<std::uint64_t>}}};

// ---- header

/// What the header says, and the bytes after it.
struct NpyArray {
  NumberType type;
  bool is_big = false;
  bool is_fortran = false;
  std::vector<std::size_t> shape;
  bool had_outer_axis = false;  // of length 1, which is left out of the shape
  std::string_view bytes;

  std::string shape_text() const { return fmt::format("({}{})", fmt::join(shape, ", "), shape.size() == 1 ? "," : ""); }
};

std::size_t little_endian(std::string_view bytes) {
  std::size_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8U | static_cast<unsigned char>(bytes[i]);
  return value;
}

/// Takes the parts of a file from its front.
class NpyReader {
 public:
  NpyReader(const std::string& path, std::string_view text) : path_(path), left_(text) {}

  NpyArray read() {
    take(kNpyMagic.size(), "magic");
    const std::string_view version = take(2, "version");
    if (version[0] < 1 || version[0] > 3)
      fail(fmt::format("version {}.{} of the format; 1.0, 2.0 and 3.0 are read", int{version[0]}, int{version[1]}));
    const std::size_t length = little_endian(take(version[0] == 1 ? 2 : 4, "length of the header"));
    header_ = take(length, "header");
    NpyArray array;
    read_type(array);
    const std::string_view order = value_of("fortran_order");
    array.is_fortran = order.starts_with("True");
    if (!array.is_fortran && !order.starts_with("False")) fail("'fortran_order' in the header is not True or False");
    array.shape = read_shape();
    check_size(array);
    array.bytes = left_;
    return array;
  }

 private:
  [[noreturn]] void fail(const std::string& message) const { throw InputError(path_ + ": " + message); }

  std::string_view take(std::size_t count, std::string_view what) {
    if (count > left_.size())
      fail(fmt::format("the {} takes {} bytes; the file has {} more", what, count, left_.size()));
    const std::string_view taken = left_.substr(0, count);
    left_.remove_prefix(count);
    return taken;
  }

  /// What follows `'key':`.
  std::string_view value_of(std::string_view key) const {
    for (const char quote : {'\'', '"'}) {
      const std::string quoted = fmt::format("{}{}{}", quote, key, quote);
      const std::size_t at = header_.find(quoted);
      if (at == std::string_view::npos) continue;
      const std::size_t colon = header_.find_first_not_of(' ', at + quoted.size());
      if (colon == std::string_view::npos || header_[colon] != ':') continue;
      return text::trim(header_.substr(colon + 1));
    }
    fail(fmt::format("the header has no key '{}'", key));
  }

  void read_type(NpyArray& array) const {
    const std::string_view value = value_of("descr");
    if (value.starts_with('[')) fail("the array holds records; numbers of one type are needed");
    const char quote = value.empty() ? ' ' : value.front();
    const std::size_t end = value.find(quote, 1);
    if ((quote != '\'' && quote != '"') || end == std::string_view::npos) fail("'descr' in the header is no text");
    const std::string_view name = value.substr(1, end - 1);
    if (name.find('O') != std::string_view::npos)
      fail("the array holds objects of Python (pickled), which are not read; an array of numbers is needed");
    const std::string_view plain = name.substr(name.find_first_not_of("<>|=") == 1 ? 1 : 0);
    const auto* const type = std::find_if(kNumberTypes.begin(), kNumberTypes.end(),
                                          [&](const NumberType& row) { return row.name == plain; });
    if (type == kNumberTypes.end())
      fail(fmt::format("the numbers have the type {}; f4, f8, i1 to i8 or u1 to u8 is needed", text::in_quotes(name)));
    array.type = *type;
    array.is_big = name.starts_with('>');
  }

  /// `(14, 66, 2)`, with `L` after the numbers where Python 2 wrote them.
  std::vector<std::size_t> read_shape() const {
    std::string_view text = value_of("shape");
    const std::size_t end = text.find(')');
    if (!text.starts_with('(') || end == std::string_view::npos) fail("'shape' in the header is not a tuple");
    text = text.substr(1, end - 1);
    std::vector<std::size_t> shape;
    while (!text::trim(text).empty()) {
      std::string_view number = text::trim(text.substr(0, text.find(',')));
      text.remove_prefix(std::min(text.find(','), text.size() - 1) + 1);
      if (number.ends_with('L')) number.remove_suffix(1);
      const auto [stop, error] = std::from_chars(number.data(), number.data() + number.size(), shape.emplace_back());
      if (error != std::errc() || stop != number.data() + number.size())
        fail(fmt::format("{} is in the shape of the array; a whole number is needed", text::in_quotes(number)));
    }
    return shape;
  }

  void check_size(const NpyArray& array) const {
    std::size_t room = left_.size() / array.type.size;
    const bool is_empty = std::find(array.shape.begin(), array.shape.end(), 0U) != array.shape.end();
    if (is_empty || array.shape.empty())
      fail(fmt::format("the array has the shape {}, which holds no landmarks", array.shape_text()));
    for (const std::size_t length : array.shape) room /= length;
    if (room == 0)
      fail(fmt::format("the header says {} numbers of {} bytes; the file has {} bytes more", array.shape_text(),
                       array.type.size, left_.size()));
  }

  const std::string& path_;
  std::string_view left_;
  std::string_view header_;
};

// ---- shapes

/// Which axes of an array count shapes, points and coordinates; npos: there is none.
struct Layout {
  static constexpr std::size_t kNone = std::string::npos;
  std::size_t shapes = kNone;
  std::size_t points = kNone;
  std::size_t coordinates = kNone;
};

/// (N,1,2) or (N,1,3): points of OpenCV, such as those of a contour.
bool is_contour(const std::vector<std::size_t>& shape) {
  return shape.size() == 3 && shape[0] > 1 && shape[1] == 1 && (shape[2] == 2 || shape[2] == 3);
}

/// Takes a first axis of length 1 off an array of four: trees of hyperiax hold shapes as (1,S,N,d). The strides of the
/// others are the same without it.
void drop_outer_axis(const std::string& path, NpyArray& array, std::vector<std::string>& warnings) {
  if (array.shape.size() != 4 || array.shape.front() != 1) return;
  const std::string given = array.shape_text();
  array.shape.erase(array.shape.begin());
  array.had_outer_axis = true;
  warnings.push_back(fmt::format("{}: the array {} is read as {}", path, given, array.shape_text()));
}

Layout layout_of(const std::string& path, const NpyArray& array, std::vector<std::string>& warnings) {
  const std::size_t size = array.shape.size();
  if (size > 3)
    throw InputError(fmt::format("{}: the array has {} axes, {}; (N,), (N,d), (S,N,d) or (1,S,N,d) is needed", path,
                                 size, array.shape_text()));
  if (size == 1) return {.points = 0};
  if (!array.had_outer_axis && is_contour(array.shape)) {
    warnings.push_back(fmt::format("{}: the array {} is read as one shape of {} landmarks, as OpenCV writes them", path,
                                   array.shape_text(), array.shape[0]));
    return {.points = 0, .coordinates = 2};
  }
  const std::size_t shapes = size == 3 ? 0 : Layout::kNone;
  if (array.shape[size - 1] <= 3) return {shapes, size - 2, size - 1};
  if (array.shape[size - 2] > 3)
    throw InputError(
        fmt::format("{}: the array has the shape {}, which does not say what is x and y; (N,d) or (S,N,d) "
                    "with d = 1, 2 or 3 is needed, in numpy: reshape(S, N, d)",
                    path, array.shape_text()));
  warnings.push_back(fmt::format("{}: of the array {} the axis before the last is read as that of the coordinates",
                                 path, array.shape_text()));
  return {shapes, size - 1, size - 2};
}

/// Numbers from one place on each axis to the next.
std::vector<std::size_t> strides_of(const NpyArray& array) {
  std::vector<std::size_t> strides(array.shape.size(), 1);
  if (array.is_fortran)
    for (std::size_t axis = 1; axis < strides.size(); ++axis) strides[axis] = strides[axis - 1] * array.shape[axis - 1];
  else
    for (std::size_t axis = strides.size() - 1; axis-- > 0;) strides[axis] = strides[axis + 1] * array.shape[axis + 1];
  return strides;
}

double coordinate_at(const std::string& path, const NpyArray& array, std::size_t place) {
  const double value = array.type.number(array.bytes.data() + place * array.type.size, array.is_big);
  if (std::isinf(value))
    throw InputError(fmt::format("{}: number {} of the array is {}; a coordinate must be finite", path, place, value));
  return std::isnan(value) ? std::numeric_limits<double>::quiet_NaN() : value;
}

bool sniff_npy(std::string_view text) { return text.starts_with(kNpyMagic); }

}  // namespace

LandmarkFile read_npy(const std::string& path, std::string_view text) {
  LandmarkFile file;
  NpyArray array = NpyReader(path, text).read();
  drop_outer_axis(path, array, file.warnings);
  const Layout layout = layout_of(path, array, file.warnings);
  const std::vector<std::size_t> strides = strides_of(array);
  const auto length = [&](std::size_t axis) { return axis == Layout::kNone ? 1 : array.shape[axis]; };
  const auto stride = [&](std::size_t axis) { return axis == Layout::kNone ? 0 : strides[axis]; };
  for (std::size_t s = 0; s < length(layout.shapes); ++s) {
    Points& points = file.shapes.emplace_back().points;
    points.resize(static_cast<Eigen::Index>(length(layout.coordinates)),
                  static_cast<Eigen::Index>(length(layout.points)));
    for (Eigen::Index i = 0; i < points.cols(); ++i)
      for (Eigen::Index c = 0; c < points.rows(); ++c)
        points(c, i) = coordinate_at(path, array,
                                     s * stride(layout.shapes) + static_cast<std::size_t>(i) * stride(layout.points) +
                                         static_cast<std::size_t>(c) * stride(layout.coordinates));
  }
  std::size_t used = array.type.size;
  for (const std::size_t axis : array.shape) used *= axis;
  if (used < array.bytes.size())
    file.warnings.push_back(
        fmt::format("{}: {} after the array are not used", path, text::counted(array.bytes.size() - used, "byte")));
  return file;
}

namespace {

WrittenLandmarks write_npy_landmarks(const std::string& path, const LandmarkFile& file) {
  const Target target{path, "npy"};
  require_shapes(target, file);
  require_landmarks(target, file.shapes.front());
  const Points& first = file.shapes.front().points;
  std::vector<double> numbers;
  for (std::size_t s = 0; s < file.shapes.size(); ++s) {
    const Points& points = file.shapes[s].points;
    if (points.rows() != first.rows() || points.cols() != first.cols())
      throw InputError(fmt::format("{}: npy holds shapes of one size; shape 1 has {} in {}D, shape {} has {} in {}D",
                                   path, text::counted(static_cast<std::size_t>(first.cols()), "landmark"),
                                   first.rows(), s + 1,
                                   text::counted(static_cast<std::size_t>(points.cols()), "landmark"), points.rows()));
    numbers.insert(numbers.end(), points.data(), points.data() + points.size());
  }
  std::vector<std::size_t> shape = {static_cast<std::size_t>(first.cols()), static_cast<std::size_t>(first.rows())};
  if (file.shapes.size() > 1) shape.insert(shape.begin(), file.shapes.size());
  if (is_contour(shape))
    throw InputError(
        fmt::format("{}: npy holds no shapes of one landmark each; an array ({}, 1, {}) is read as one shape", path,
                    shape[0], shape[2]));
  return {npy_bytes(numbers, shape), losses_of(target, file, {})};
}

}  // namespace

LandmarkFormat npy_format() {
  return {.name = "npy",
          .extensions = {"npy"},
          .help =
              "numpy array of real numbers, versions 1 to 3: (N,d), several shapes (S,N,d) or (1,S,N,d), on the line "
              "(N,), of "
              "OpenCV "
              "(N,1,d); also (d,N) and (S,d,N) where the last axis is longer than 3 and the one before is not",
          .sniff = sniff_npy,
          .read = read_npy,
          .write = write_npy_landmarks,
          .holds_bytes = true};
}

}  // namespace pulson::formats
