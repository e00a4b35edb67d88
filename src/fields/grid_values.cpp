#include "grid_values.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>

#include <fmt/format.h>

#include "core/text.hpp"
#include "deflate.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::io {
namespace {

template <class T>
void convert(const char* bytes, bool is_big_endian, std::span<float> values) {
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
constexpr GridNumberType row(std::string_view meta_image, std::string_view nrrd) {
  return {meta_image, nrrd, sizeof(T), convert<T>};
}

constexpr std::array<GridNumberType, 10> kGridNumberTypes = {{
    row<float>("MET_FLOAT", "float"),
    row<double>("MET_DOUBLE", "double"),
    row<std::int8_t>("MET_CHAR", "signed char,int8,int8_t"),
    row<std::uint8_t>("MET_UCHAR", "uchar,unsigned char,uint8,uint8_t"),
    row<std::int16_t>("MET_SHORT", "short,short int,signed short,signed short int,int16,int16_t"),
    row<std::uint16_t>("MET_USHORT", "ushort,unsigned short,unsigned short int,uint16,uint16_t"),
    row<std::int32_t>("MET_INT", "int,signed int,int32,int32_t"),
    row<std::uint32_t>("MET_UINT", "uint,unsigned int,uint32,uint32_t"),
    row<std::int64_t>("MET_LONG_LONG",
                      "longlong,long long,long long int,signed long long,signed long long int,int64,int64_t"),
    row<std::uint64_t>("MET_ULONG_LONG", "ulonglong,unsigned long long,unsigned long long int,uint64,uint64_t"),
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
  bytes.type.convert(bytes.is_compressed ? raw.data() : bytes.bytes.data(), bytes.is_big_endian, values);
  return values;
}

std::string encoded(std::span<const float> values, GridEncoding encoding) {
  static_assert(std::endian::native == std::endian::little);
  const std::string_view raw(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  return encoding == GridEncoding::kRaw ? std::string(raw) : deflated(raw, encoding == GridEncoding::kGzip);
}

}  // namespace pulson::io
