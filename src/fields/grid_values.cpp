#include "grid_values.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include <fmt/format.h>

#include "core/text.hpp"
#include "deflate.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::io {
namespace {

template <class T>
void decode(const char* bytes, bool is_big_endian, std::span<float> values) {
  const bool is_other_order = is_big_endian != (std::endian::native == std::endian::big);
  std::array<char, sizeof(T)> raw{};
  for (float& value : values) {
    std::memcpy(raw.data(), bytes, raw.size());
    if (is_other_order) std::reverse(raw.begin(), raw.end());
    value = static_cast<float>(std::bit_cast<T>(raw));
    bytes += raw.size();
  }
}

template <class T>
T nearest(float value) {
  if constexpr (std::is_floating_point_v<T>) {
    return value;
  } else {
    using Limits = std::numeric_limits<T>;
    if (std::isnan(value)) return 0;
    const double whole = std::nearbyint(static_cast<double>(value));
    if (whole <= static_cast<double>(Limits::lowest())) return Limits::lowest();
    return whole >= static_cast<double>(Limits::max()) ? Limits::max() : static_cast<T>(whole);
  }
}

template <class T>
void encode(std::span<const float> values, char* bytes) {
  static_assert(std::endian::native == std::endian::little);
  for (const float value : values) {
    const T number = nearest<T>(value);
    std::memcpy(bytes, &number, sizeof(T));
    bytes += sizeof(T);
  }
}

template <class T>
constexpr GridNumberType row(std::string_view meta_image, std::string_view nrrd, GridType type) {
  return {meta_image, nrrd, type, sizeof(T), decode<T>, encode<T>};
}

constexpr std::array<GridNumberType, 10> kGridNumberTypes = {{
    row<float>("MET_FLOAT", "float", GridType::kFloat),
    row<double>("MET_DOUBLE", "double", GridType::kDouble),
    row<std::int8_t>("MET_CHAR", "signed char,int8,int8_t", GridType::kInt8),
    row<std::uint8_t>("MET_UCHAR", "uchar,unsigned char,uint8,uint8_t", GridType::kUint8),
    row<std::int16_t>("MET_SHORT", "short,short int,signed short,signed short int,int16,int16_t", GridType::kInt16),
    row<std::uint16_t>("MET_USHORT", "ushort,unsigned short,unsigned short int,uint16,uint16_t", GridType::kUint16),
    row<std::int32_t>("MET_INT", "int,signed int,int32,int32_t", GridType::kInt32),
    row<std::uint32_t>("MET_UINT", "uint,unsigned int,uint32,uint32_t", GridType::kUint32),
    row<std::int64_t>("MET_LONG_LONG",
                      "longlong,long long,long long int,signed long long,signed long long int,int64,int64_t",
                      GridType::kInt64),
    row<std::uint64_t>("MET_ULONG_LONG", "ulonglong,unsigned long long,unsigned long long int,uint64,uint64_t",
                       GridType::kUint64),
}};

bool holds_name(std::string_view list, std::string_view name) {
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(','), list.size());
    if (list.substr(0, end) == name) return true;
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return false;
}

template <class Predicate>
const GridNumberType* find_type(Predicate is_wanted) {
  const auto* const type = std::find_if(kGridNumberTypes.begin(), kGridNumberTypes.end(), is_wanted);
  return type == kGridNumberTypes.end() ? nullptr : type;
}

std::optional<std::size_t> product(std::size_t a, std::size_t b) {
  if (a > std::numeric_limits<std::size_t>::max() / b) return std::nullopt;
  return a * b;
}

}  // namespace

const GridNumberType* find_meta_image_type(std::string_view name) {
  return find_type([name](const GridNumberType& type) { return type.meta_image == name; });
}

const GridNumberType* find_nrrd_type(std::string_view name) {
  return find_type([lower = to_lower(name)](const GridNumberType& type) { return holds_name(type.nrrd, lower); });
}

const GridNumberType& grid_number_type(GridType type) {
  return *find_type([type](const GridNumberType& row) { return row.type == type; });
}

std::optional<std::size_t> grid_count(const std::vector<int>& sizes, int components) {
  std::optional<std::size_t> count = static_cast<std::size_t>(components);
  for (const int size : sizes)
    if (count) count = product(*count, static_cast<std::size_t>(size));
  return count;
}

std::vector<float> grid_values(const std::string& path, const GridBytes& bytes, const std::vector<int>& sizes,
                               int components) {
  const std::optional<std::size_t> count = grid_count(sizes, components);
  const std::optional<std::size_t> size = count ? product(*count, bytes.type.size) : std::nullopt;
  const std::string need =
      fmt::format("{}: sizes {} of {} of {} need", path, fmt::join(sizes, " × "),
                  counted(static_cast<std::size_t>(components), "number"), counted(bytes.type.size, "byte"));
  if (!size) throw InputError(need + " more bytes than any file has");
  std::string raw;
  if (bytes.is_compressed) {
    raw = inflated(bytes.bytes, *size, path + ": its compressed numbers");
  } else if (bytes.bytes.size() != *size) {
    throw InputError(fmt::format("{} {} bytes; after its header the file has {}", need, *size, bytes.bytes.size()));
  }
  std::vector<float> values(*count);
  bytes.type.decode(bytes.is_compressed ? raw.data() : bytes.bytes.data(), bytes.is_big_endian, values);
  return values;
}

std::string encoded(std::span<const float> values, GridType type, GridEncoding encoding) {
  const GridNumberType& row = grid_number_type(type);
  std::string raw(values.size() * row.size, '\0');
  row.encode(values, raw.data());
  return encoding == GridEncoding::kRaw ? raw : deflated(raw, encoding == GridEncoding::kGzip);
}

}  // namespace pulson::io
