// The sums of KernelOperator where momenta are zero, which it leaves out: against plain loops over all pairs.

#include <functional>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "pair_loops.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson {
namespace {

// Which columns are zero.
struct Zeros {
  std::string name;
  bool (*at)(Eigen::Index column);
};

const std::vector<Zeros> kZeros = {{"none", [](Eigen::Index) { return false; }},
                                   {"even", [](Eigen::Index a) { return a % 2 == 0; }},
                                   {"most", [](Eigen::Index a) { return a % 5 != 3; }},
                                   {"first", [](Eigen::Index a) { return a == 0; }},
                                   {"all", [](Eigen::Index) { return true; }}};

// Numbers between −1 and 1 in the other columns.
Points sparse_points(int d, int count, unsigned seed, const Zeros& zeros) {
  Points p = random_points(d, count, seed);
  for (Eigen::Index a = 0; a < count; ++a)
    if (zeros.at(a)) p.col(a).setZero();
  return p;
}

class SparseSums : public testing::TestWithParam<std::tuple<DefinedKernel, int>> {
 protected:
  const DefinedKernel definition_ = std::get<0>(GetParam());
  const int d_ = std::get<1>(GetParam());
  const KernelOperator kernel_ = definition_.make();
};

INSTANTIATE_TEST_SUITE_P(Table, SparseSums,
                         testing::Combine(testing::ValuesIn(every_kernel()), testing::Values(1, 2, 3)),
                         [](const auto& instance) {
                           return test_name(std::get<0>(instance.param).spec() + "_in_" +
                                            std::to_string(std::get<1>(instance.param)) + "d");
                         });

TEST_P(SparseSums, FieldsAreSumsOverAllSources) {
  for (const int count : {1, 2, 9, 67}) {
    for (const Zeros& of_p : kZeros) {
      SCOPED_TRACE(std::to_string(count) + " sources, zero momenta: " + of_p.name);
      expect_field_sums(definition_, kernel_, random_points(d_, 10, 1), random_points(d_, count, 2),
                        sparse_points(d_, count, 3, of_p));
    }
  }
}

// Of a and p either may be zero where the other is not: a zero p_b leaves a_b·p_a of the gradient.
TEST_P(SparseSums, DerivativesAreSumsOverAllPairs) {
  for (const int count : {1, 2, 9, 67}) {
    for (const Zeros& of_p : kZeros) {
      for (const Zeros& of_a : kZeros) {
        SCOPED_TRACE(std::to_string(count) + " landmarks, zero p: " + of_p.name + ", zero a: " + of_a.name);
        expect_self_sums(definition_, kernel_, random_points(d_, count, 1), sparse_points(d_, count, 2, of_a),
                         sparse_points(d_, count, 3, of_p), random_points(d_, count, 4));
      }
    }
  }
}

// One axis of a momentum may vanish and the other not.
TEST(SparseMomenta, AreThoseOfWhichEveryCoordinateIsZero) {
  const DefinedKernel definition = every_kernel().front();
  Points p = random_points(2, 9, 3);
  p.row(0).leftCols(5).setZero();
  p.row(1).rightCols(6).setZero();  // column 3 and 4 are zero
  expect_field_sums(definition, definition.make(), random_points(2, 4, 1), random_points(2, 9, 2), p);
  expect_self_sums(definition, definition.make(), random_points(2, 9, 1), random_points(2, 9, 2), p,
                   random_points(2, 9, 4));
}

// Enough pairs for the sums to be shared out over threads even where half of the momenta are zero.
TEST(SparseMomenta, GiveTheSameBitsOnAnyNumberOfThreads) {
  const KernelOperator kernel = every_kernel().front().make();
  const int count = 900;
  const Points q = random_points(2, count, 1);
  const Points a = random_points(2, count, 2);
  const Points p = sparse_points(2, count, 3, kZeros[1]);
  const auto sums = [&](int threads) {
    set_thread_count(threads);
    Eigen::MatrixXd jacobian;
    std::vector<Points> all = {kernel.apply(q, q, p), kernel.apply_with_jacobian(q, q, p, jacobian),
                               kernel.apply_tangent(q, p, a), kernel.gradient(q, a, p), kernel.hessian(q, p, a)};
    all.push_back(jacobian);
    const Flow flow = kernel.flow(q, p), change = kernel.flow_tangent(q, p, a, p);
    all.insert(all.end(), {flow.velocity, flow.force, change.velocity, change.force});
    set_thread_count(0);
    return all;
  };
  const std::vector<Points> alone = sums(1);
  const std::vector<Points> shared = sums(2);
  for (std::size_t i = 0; i < alone.size(); ++i) EXPECT_EQ(alone[i], shared[i]) << "sum " << i;
}

}  // namespace
}  // namespace pulson
