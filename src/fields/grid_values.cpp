#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>

#include <fmt/format.h>
#define ZLIB_CONST  // its input is const
#include <zlib.h>

#include "core/text.hpp"
#include "grid_formats.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::fields {

namespace {

// ---- zlib's streams in memory

constexpr int kWindow = 15;        // its largest
constexpr int kGzip = 16;          // added to the window: with gzip's header
constexpr int kEitherHeader = 32;  // added to the window: gzip or zlib, as the stream has it

constexpr std::size_t kPart = std::size_t{1} << 30U;  // zlib counts bytes in 32 bits

/// Lends zlib the next part of what is left of a block of bytes.
template <class Byte, class Pointer>
void lend(Byte*& at, std::size_t& left, Pointer& next, uInt& available) {
  if (available > 0 || left == 0) return;
  available = static_cast<uInt>(std::min(left, kPart));
  next = reinterpret_cast<Pointer>(at);
  at += available;
  left -= available;
}

/// `bytes` as a gzip stream, or a zlib stream.
std::string deflated(std::string_view bytes, bool as_gzip) {
  constexpr int kLevel = 2;  // as ITK: floats gain little from a higher one, which takes far longer
  constexpr int kMemory = 8;
  z_stream stream{};
  if (deflateInit2(&stream, kLevel, Z_DEFLATED, kWindow + (as_gzip ? kGzip : 0), kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, &deflateEnd);

  std::string result(deflateBound(&stream, bytes.size()), '\0');
  const char* from = bytes.data();
  char* to = result.data();
  std::size_t from_left = bytes.size(), to_left = result.size();
  int state = Z_OK;
  while (state == Z_OK) {
    lend(from, from_left, stream.next_in, stream.avail_in);
    lend(to, to_left, stream.next_out, stream.avail_out);
    state = deflate(&stream, from_left == 0 ? Z_FINISH : Z_NO_FLUSH);
  }
  if (state != Z_STREAM_END) throw std::bad_alloc();  // of all that can go wrong in memory, what is left
  result.resize(result.size() - to_left - stream.avail_out);
  return result;
}

/// The `size` bytes that the gzip or zlib stream `stream` is of. @throws InputError that begins with `what` if it is
/// damaged, cut off or of another number of bytes; before anything is allocated if it is too short to hold so many
std::string inflated(std::string_view stream_bytes, std::size_t size, const std::string& what) {
  constexpr std::size_t kLargestRatio = 1032;  // 258 bytes from two bits, the best that deflate can do
  if (size / kLargestRatio > stream_bytes.size())
    throw InputError(fmt::format("{} are cut off: {} compressed bytes cannot be {}", what, stream_bytes.size(), size));
  z_stream stream{};
  if (inflateInit2(&stream, kWindow + kEitherHeader) != Z_OK) throw std::bad_alloc();
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, &inflateEnd);

  std::string result(size + 1, '\0');  // one byte more, so that a stream that is too long shows
  const char* from = stream_bytes.data();
  char* to = result.data();
  std::size_t from_left = stream_bytes.size(), to_left = result.size();
  int state = Z_OK;
  while (state == Z_OK) {
    lend(from, from_left, stream.next_in, stream.avail_in);
    lend(to, to_left, stream.next_out, stream.avail_out);
    state = inflate(&stream, Z_NO_FLUSH);
  }
  const std::size_t taken = result.size() - to_left - stream.avail_out;
  if (taken > size) throw InputError(fmt::format("{} are more than the {} bytes that its sizes need", what, size));
  if (state == Z_DATA_ERROR || state == Z_NEED_DICT)
    throw InputError(fmt::format("{} are damaged: zlib says {}", what, stream.msg != nullptr ? stream.msg : "no more"));
  if (state == Z_MEM_ERROR) throw std::bad_alloc();
  if (state != Z_STREAM_END || taken < size)
    throw InputError(fmt::format("{} are cut off: {} of {} bytes are there", what, taken, size));
  result.resize(size);
  return result;
}

// ---- headers

std::string plain_key(std::string_view key) {
  std::string plain = text::to_lower(key);
  std::erase(plain, ' ');
  return plain;
}

}  // namespace

void GridHeader::add(std::size_t line, std::string_view key, std::string_view value) {
  const auto [entry, is_new] =
      entries_.try_emplace(plain_key(key), HeaderEntry{line, std::string(key), text::trim(value)});
  if (!is_new)
    text::fail(path_, line, fmt::format("{} was given on line {} already", text::in_quotes(key), entry->second.line));
}

const HeaderEntry* GridHeader::find(std::initializer_list<std::string_view> keys) const {
  for (const std::string_view key : keys)
    if (const auto entry = entries_.find(plain_key(key)); entry != entries_.end()) return &entry->second;
  return nullptr;
}

const HeaderEntry& GridHeader::need(std::initializer_list<std::string_view> keys) const {
  if (const HeaderEntry* const entry = find(keys)) return *entry;
  throw InputError(fmt::format("{}: its header has no '{}'", path_, *keys.begin()));
}

std::vector<double> GridHeader::numbers(const HeaderEntry& entry, std::string_view text, std::size_t count) const {
  const std::string what = fmt::format("{}:{}: a number of {}", path_, entry.line, entry.key);
  std::vector<double> values;
  for (const std::string_view word : text::split_words(text)) {
    values.push_back(parse_number(word, what));
    if (!std::isfinite(values.back())) refuse(entry, "its numbers must be finite");
  }
  if (values.size() != count)
    refuse(entry, fmt::format("{} needed", count == 1 ? "1 number is" : text::counted(count, "number") + " are"));
  return values;
}

std::vector<int> GridHeader::counts(const HeaderEntry& entry, std::size_t count) const {
  std::vector<int> values;
  for (const double number : numbers(entry, entry.value, count)) {
    if (!(number >= 1 && number <= std::numeric_limits<int>::max() && number == std::floor(number)))
      refuse(entry, "whole numbers from 1 to 2147483647 are needed");
    values.push_back(static_cast<int>(number));
  }
  return values;
}

std::vector<std::pair<std::string, std::string>> GridHeader::others(std::span<const std::string_view> keys) const {
  std::map<std::size_t, std::pair<std::string, std::string>> by_line;
  for (const auto& [plain, entry] : entries_)
    if (std::none_of(keys.begin(), keys.end(), [&name = plain](auto key) { return plain_key(key) == name; }))
      by_line.emplace(entry.line, std::pair(entry.key, std::string(entry.value)));
  std::vector<std::pair<std::string, std::string>> result;
  for (auto& [line, entry] : by_line) result.push_back(std::move(entry));
  return result;
}

void GridHeader::refuse(const HeaderEntry& entry, const std::string& what) const {
  text::fail(path_, entry.line, fmt::format("{} is {}; {}", entry.key, text::in_quotes(entry.value), what));
}

std::string_view take_header_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

namespace {

constexpr std::array<GridNumberType, 10> kGridNumberTypes = {{
    {"MET_FLOAT", "float", GridType::kFloat32},
    {"MET_DOUBLE", "double", GridType::kFloat64},
    {"MET_CHAR", "signed char,int8,int8_t", GridType::kInt8},
    {"MET_UCHAR", "uchar,unsigned char,uint8,uint8_t", GridType::kUint8},
    {"MET_SHORT", "short,short int,signed short,signed short int,int16,int16_t", GridType::kInt16},
    {"MET_USHORT", "ushort,unsigned short,unsigned short int,uint16,uint16_t", GridType::kUint16},
    // MetaIO's long ones have 32 bits on every machine.
    {"MET_INT,MET_LONG", "int,signed int,int32,int32_t", GridType::kInt32},
    {"MET_UINT,MET_ULONG", "uint,unsigned int,uint32,uint32_t", GridType::kUint32},
    {"MET_LONG_LONG", "longlong,long long,long long int,signed long long,signed long long int,int64,int64_t",
     GridType::kInt64},
    {"MET_ULONG_LONG", "ulonglong,unsigned long long,unsigned long long int,uint64,uint64_t", GridType::kUint64},
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
  return find_type([name](const GridNumberType& type) { return holds_name(type.meta_image, name); });
}

const GridNumberType* find_nrrd_type(std::string_view name) {
  return find_type([lower = text::to_lower(name)](const GridNumberType& type) { return holds_name(type.nrrd, lower); });
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

std::vector<std::byte> grid_bytes(const std::string& path, const GridBytes& bytes, const std::vector<int>& sizes,
                                  int components, std::uint64_t max_points) {
  if (const auto points = grid_count(sizes, 1); !points || *points > max_points)
    throw InputError(fmt::format("{}: its grid has {} points, more than `max_points = {}` allows", path,
                                 fmt::join(sizes, " x "), max_points));
  const std::size_t number_size = byte_count(bytes.type.type);
  const std::optional<std::size_t> count = grid_count(sizes, components);
  const std::optional<std::size_t> size = count ? product(*count, number_size) : std::nullopt;
  const std::string need =
      fmt::format("{}: sizes {} of {} of {} need", path, fmt::join(sizes, " × "),
                  text::counted(static_cast<std::size_t>(components), "number"), text::counted(number_size, "byte"));
  if (!size) throw InputError(need + " more bytes than any file has");
  std::string raw;
  if (bytes.is_compressed) {
    raw = inflated(bytes.bytes, *size, path + ": its compressed numbers");
  } else if (bytes.bytes.size() != *size) {
    throw InputError(fmt::format("{} {} bytes; after its header the file has {}", need, *size, bytes.bytes.size()));
  }
  const char* const first = bytes.is_compressed ? raw.data() : bytes.bytes.data();
  std::vector<std::byte> numbers(*size);
  std::memcpy(numbers.data(), first, *size);
  if (bytes.is_big_endian != (std::endian::native == std::endian::big) && number_size > 1)
    for (auto at = numbers.begin(); at != numbers.end(); at += static_cast<std::ptrdiff_t>(number_size))
      std::reverse(at, at + static_cast<std::ptrdiff_t>(number_size));
  return numbers;
}

std::string encoded(std::span<const std::byte> bytes, GridEncoding encoding) {
  static_assert(std::endian::native == std::endian::little);
  const std::string_view raw(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return encoding == GridEncoding::kRaw ? std::string(raw) : deflated(raw, encoding == GridEncoding::kGzip);
}

}  // namespace pulson::fields
