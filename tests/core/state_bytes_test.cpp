#include "core/state_bytes.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace pulson {
namespace {

/// One of each kind.
struct Example {
  int number = 0;
  double real = 0;
  std::array<std::int64_t, 2> pair{};
  Eigen::MatrixXd matrix;
  Eigen::VectorXi vector;
  std::vector<std::vector<double>> lists;
  std::vector<Eigen::ArrayXd> arrays;
  std::vector<std::pair<int, double>> items;
};

template <class State, class Value>
void pass_example(State& state, Value& value) {
  state(value.number, value.real, value.pair, value.matrix, value.vector, value.lists, value.arrays);
  state.list(value.items, [&](auto& item) { state(item.first, item.second); });
}

Example full() {
  return {-3,
          std::numeric_limits<double>::denorm_min(),
          {1, std::numeric_limits<std::int64_t>::min()},
          (Eigen::MatrixXd(2, 3) << 1, 2, 3, 4, -0.0, 6).finished(),
          Eigen::Vector3i(7, 8, 9),
          {{1, 2}, {}, {3}},
          {Eigen::ArrayXd::LinSpaced(4, 0, 1), {}},
          {{1, 0.5}, {2, std::numeric_limits<double>::infinity()}}};
}

std::string written(const Example& example) {
  StateWriter to;
  pass_example(to, example);
  return to.take();
}

TEST(StateBytes, ComeBackAsTheyWere) {
  const std::string bytes = written(full());
  Example back;
  StateReader from(bytes);
  pass_example(from, back);
  from.require_end();
  EXPECT_EQ(written(back), bytes);
  EXPECT_EQ(back.number, -3);
  EXPECT_EQ(back.matrix, full().matrix);
  EXPECT_TRUE(std::signbit(back.matrix(1, 1)));
  EXPECT_EQ(back.lists, full().lists);
  EXPECT_EQ(back.items, full().items);
}

// 8 bytes for a number and for the length before it, in the order of this machine.
TEST(StateBytes, AreNumbersAfterTheirCount) {
  StateWriter to;
  to(std::vector<double>{1.0});
  EXPECT_EQ(to.take(), std::string("\1\0\0\0\0\0\0\0\0\0\0\0\0\0\xF0\x3F", 16));
}

TEST(StateBytes, ThatEndEarlyOrLateAreRefused) {
  const std::string bytes = written(full());
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    StateReader from(std::string_view(bytes).substr(0, length));
    Example back;
    EXPECT_THROW(pass_example(from, back), InputError) << length;
  }
  StateReader from(bytes);
  int first = 0;
  from(first);
  EXPECT_THROW(from.require_end(), InputError);
}

TEST(StateBytes, OfImpossibleSizesAreRefused) {
  const auto refused = [](auto value, std::int64_t rows, std::int64_t columns) {
    StateWriter to;
    to(rows, columns, 1.0);
    const std::string bytes = to.take();
    StateReader from(bytes);
    EXPECT_THROW(from(value), InputError) << rows << ' ' << columns;
  };
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  for (const auto& [rows, columns] :
       {std::pair{std::int64_t{-1}, std::int64_t{1}}, {2, 1}, {kMost, kMost}, {kMost / 4, 8}, {1, -1}})
    refused(Eigen::MatrixXd(), rows, columns);
  refused(Eigen::VectorXd(), 1, 2);
  refused(Eigen::VectorXd(), 0, 0);
  refused(std::vector<double>(), kMost, 1);
  refused(std::vector<double>(), -1, 1);
}

}  // namespace
}  // namespace pulson
