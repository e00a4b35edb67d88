#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "pulson/core/errors.hpp"

namespace pulson {

/// State of a computation as bytes: to be saved and gone on from, or for another process of the run. Numbers lie as in
/// memory, so they are for the same build; lists and matrices follow their sizes. A template that takes a StateWriter
/// and constant state, or a StateReader and state, describes both directions at once:
///
///     template <class State, class Sums>
///     void pass(State& state, Sums& sums) { state(sums.count, sums.mean); }
class StateWriter {
 public:
  /// Numbers, matrices, and vectors and arrays of these.
  template <class... T>
  void operator()(const T&... values) {
    (put(values), ...);
  }

  /// Items of another type, each by `pass_item`.
  template <class T, class PassItem>
  void list(const std::vector<T>& items, const PassItem& pass_item) {
    put(static_cast<std::int64_t>(items.size()));
    for (const T& item : items) pass_item(item);
  }

  std::string take() { return std::move(bytes_); }

 private:
  template <class T>
  void append(const T* numbers, std::size_t count) {
    static_assert(std::is_arithmetic_v<T>);
    if (count > 0) bytes_.append(reinterpret_cast<const char*>(numbers), count * sizeof(T));
  }

  template <class T>
    requires std::is_arithmetic_v<T>
  void put(const T& number) {
    append(&number, 1);
  }
  template <class Matrix>
  void put(const Eigen::PlainObjectBase<Matrix>& matrix) {
    put(static_cast<std::int64_t>(matrix.rows()));
    put(static_cast<std::int64_t>(matrix.cols()));
    append(matrix.data(), static_cast<std::size_t>(matrix.size()));
  }
  template <class T, std::size_t n>
  void put(const std::array<T, n>& items) {
    for (const T& item : items) put(item);
  }
  template <class T>
  void put(const std::vector<T>& items) {
    put(static_cast<std::int64_t>(items.size()));
    if constexpr (std::is_arithmetic_v<T>)
      append(items.data(), items.size());
    else
      for (const T& item : items) put(item);
  }

  std::string bytes_;
};

/// Reads what a StateWriter wrote, in the same order. @throws InputError where the bytes end early, or a size is none
class StateReader {
 public:
  explicit StateReader(std::string_view bytes) : bytes_(bytes) {}

  template <class... T>
  void operator()(T&... values) {
    (get(values), ...);
  }

  template <class T, class PassItem>
  void list(std::vector<T>& items, const PassItem& pass_item) {
    items.resize(size(1));
    for (T& item : items) pass_item(item);
  }

  bool at_end() const { return bytes_.empty(); }
  void require_end() const {
    if (!at_end()) fail();
  }
  [[noreturn]] static void fail() { throw InputError("the saved state is damaged"); }

 private:
  template <class T>
  void take(T* numbers, std::size_t count) {
    static_assert(std::is_arithmetic_v<T>);
    if (count > bytes_.size() / sizeof(T)) fail();
    if (count > 0) std::memcpy(numbers, bytes_.data(), count * sizeof(T));
    bytes_.remove_prefix(count * sizeof(T));
  }

  /// Of a list whose items take so many bytes at least.
  std::size_t size(std::size_t bytes_of_item) {
    std::int64_t count = 0;
    take(&count, 1);
    if (count < 0 || static_cast<std::uint64_t>(count) > bytes_.size() / bytes_of_item) fail();
    return static_cast<std::size_t>(count);
  }

  template <class T>
    requires std::is_arithmetic_v<T>
  void get(T& number) {
    take(&number, 1);
  }
  template <class Matrix>
  void get(Eigen::PlainObjectBase<Matrix>& matrix) {
    std::int64_t rows = 0, columns = 0;
    take(&rows, 1);
    take(&columns, 1);
    const auto fits = [](std::int64_t count, int fixed) {
      return count >= 0 && (fixed == Eigen::Dynamic || fixed == count);
    };
    const auto most = static_cast<std::int64_t>(bytes_.size() / sizeof(typename Matrix::Scalar));
    if (!fits(rows, Matrix::RowsAtCompileTime) || !fits(columns, Matrix::ColsAtCompileTime)) fail();
    if (columns > 0 && rows > most / columns) fail();
    matrix.resize(rows, columns);
    take(matrix.data(), static_cast<std::size_t>(matrix.size()));
  }
  template <class T, std::size_t n>
  void get(std::array<T, n>& items) {
    for (T& item : items) get(item);
  }
  template <class T>
  void get(std::vector<T>& items) {
    if constexpr (std::is_arithmetic_v<T>) {
      items.resize(size(sizeof(T)));
      take(items.data(), items.size());
    } else {
      items.resize(size(1));
      for (T& item : items) get(item);
    }
  }

  std::string_view bytes_;
};

}  // namespace pulson
