#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>

namespace pulson {

/// The types of numbers that pictures and grids have.
enum class NumberType : std::uint8_t {
  kUint8,
  kInt8,
  kUint16,
  kInt16,
  kUint32,
  kInt32,
  kUint64,
  kInt64,
  kFloat32,
  kFloat64
};

inline constexpr NumberType kNumberTypes[] = {
    NumberType::kUint8, NumberType::kInt8,   NumberType::kUint16, NumberType::kInt16,   NumberType::kUint32,
    NumberType::kInt32, NumberType::kUint64, NumberType::kInt64,  NumberType::kFloat32, NumberType::kFloat64};

/// The type that holds numbers of type Value.
template <class Value>
constexpr NumberType number_type_of() {
  using enum NumberType;
  static_assert(std::is_arithmetic_v<Value>);
  if constexpr (std::is_floating_point_v<Value>) return sizeof(Value) == 4 ? kFloat32 : kFloat64;
  constexpr bool kSigned = std::is_signed_v<Value>;
  if constexpr (sizeof(Value) == 1) return kSigned ? kInt8 : kUint8;
  if constexpr (sizeof(Value) == 2) return kSigned ? kInt16 : kUint16;
  if constexpr (sizeof(Value) == 4) return kSigned ? kInt32 : kUint32;
  return kSigned ? kInt64 : kUint64;
}

/// `task.operator()<Value>()` for the type of numbers: from the name of a type to the type.
template <class Task>
decltype(auto) with_number_type(NumberType type, const Task& task) {
  using enum NumberType;
  switch (type) {
    case kUint8:
      return task.template operator()<std::uint8_t>();
    case kInt8:
      return task.template operator()<std::int8_t>();
    case kUint16:
      return task.template operator()<std::uint16_t>();
    case kInt16:
      return task.template operator()<std::int16_t>();
    case kUint32:
      return task.template operator()<std::uint32_t>();
    case kInt32:
      return task.template operator()<std::int32_t>();
    case kUint64:
      return task.template operator()<std::uint64_t>();
    case kInt64:
      return task.template operator()<std::int64_t>();
    case kFloat32:
      return task.template operator()<float>();
    case kFloat64:
      break;
  }
  return task.template operator()<double>();
}

/// Bytes of one number.
inline std::size_t byte_count(NumberType type) {
  return with_number_type(type, []<class Value>() { return sizeof(Value); });
}

/// Whether the numbers are floating-point ones.
inline bool is_floating_point(NumberType type) {
  return with_number_type(type, []<class Value>() { return std::is_floating_point_v<Value>; });
}

/// Whether the numbers have a sign.
inline bool is_signed(NumberType type) {
  return with_number_type(type, []<class Value>() { return std::is_signed_v<Value>; });
}

/// "8-bit", "signed 16-bit" or "32-bit floating-point", for messages.
inline std::string describe(NumberType type) {
  const std::string bits = std::to_string(8 * byte_count(type)) + "-bit";
  if (is_floating_point(type)) return bits + " floating-point";
  return is_signed(type) ? "signed " + bits : bits;
}

}  // namespace pulson
