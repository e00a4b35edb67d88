#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include "pulson/core/errors.hpp"

namespace pulson::inference {

/// Writes numbers and arrays of them to bytes, of this machine's order.
class StateWriter {
 public:
  template <typename T>
  void operator()(const T& number) {
    static_assert(std::is_arithmetic_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&number), sizeof number);  // NOLINT: the bytes of a number
  }
  template <typename T, int Rows, int Columns>
  void operator()(const Eigen::Matrix<T, Rows, Columns>& matrix) {
    (*this)(static_cast<std::int64_t>(matrix.rows()));
    (*this)(static_cast<std::int64_t>(matrix.cols()));
    for (Eigen::Index i = 0; i < matrix.size(); ++i) (*this)(matrix.data()[i]);
  }
  template <typename T>
  void operator()(const std::vector<T>& many) {
    (*this)(static_cast<std::int64_t>(many.size()));
    for (const T& one : many) (*this)(one);
  }

  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Reads what a StateWriter wrote, in the same order. @throws InputError where there are too few bytes, or too many at
/// the end
class StateReader {
 public:
  explicit StateReader(std::string_view bytes) : bytes_(bytes) {}

  template <typename T>
  void operator()(T& number) {
    static_assert(std::is_arithmetic_v<T>);
    if (bytes_.size() < sizeof number) damaged();
    std::memcpy(&number, bytes_.data(), sizeof number);
    bytes_.remove_prefix(sizeof number);
  }
  template <typename T, int Rows, int Columns>
  void operator()(Eigen::Matrix<T, Rows, Columns>& matrix) {
    const std::int64_t rows = count(), columns = count();
    if (columns > 0 && rows > most(sizeof(T)) / columns) damaged();
    matrix.resize(rows, columns);
    for (Eigen::Index i = 0; i < matrix.size(); ++i) (*this)(matrix.data()[i]);
  }
  template <typename T>
  void operator()(std::vector<T>& many) {
    const std::int64_t size = count();
    if (size > most(1)) damaged();
    many.resize(static_cast<std::size_t>(size));
    for (T& one : many) (*this)(one);
  }

  void end() const {
    if (!bytes_.empty()) damaged();
  }

 private:
  [[noreturn]] static void damaged() { throw InputError("the saved state of the chains is damaged"); }
  std::int64_t most(std::size_t size) const { return static_cast<std::int64_t>(bytes_.size() / size); }
  std::int64_t count() {
    std::int64_t number = 0;
    (*this)(number);
    if (number < 0) damaged();
    return number;
  }

  std::string_view bytes_;
};

}  // namespace pulson::inference
