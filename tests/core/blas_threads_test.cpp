// Products of matrices from several threads at once: a BLAS that was built for one thread alone, such as Debian's
// serial OpenBLAS, shares its work space between them and gives wrong numbers.

#include <cstdlib>
#include <stdexcept>
#include <vector>

#include <Eigen/Core>
#include <cblas.h>
#include <gtest/gtest.h>

#include "pulson/core/parallel.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr int kProducts = 100;

// Entries of either sign, each a whole number of 32768ths: another one for every i, j and seed.
MatrixXd factor(Index rows, Index cols, int seed) {
  return MatrixXd::NullaryExpr(rows, cols, [seed](Index i, Index j) {
    return static_cast<double>((i * 7919 + j * 104729 + seed * 1299709 + i * j * 31) % 65537 - 32768) / 32768;
  });
}

struct Factors {
  explicit Factors(int i) : left(factor(200 + 31 * i, 250, i)), right(factor(250, 300 - 17 * i, i + 1)) {}
  MatrixXd left, right;
};

// Of factors made beforehand, so that the threads do nothing but multiply.
std::vector<MatrixXd> products(const std::vector<Factors>& factors, int threads) {
  std::vector<MatrixXd> all(kProducts);
  set_thread_count(threads);
  parallel_for(kProducts, [&](int i) {
    const Factors& of = factors[static_cast<std::size_t>(i) % factors.size()];
    all[static_cast<std::size_t>(i)].noalias() = of.left * of.right;
  });
  set_thread_count(0);
  return all;
}

TEST(MatrixProducts, HaveTheSameBitsOnSeveralThreadsAtOnce) {
  const std::vector<Factors> factors = {Factors(0), Factors(1), Factors(2), Factors(3)};
  const std::vector<MatrixXd> alone = products(factors, 1);
  for (const int threads : {2, 3}) {
    const std::vector<MatrixXd> together = products(factors, threads);
    for (std::size_t i = 0; i < alone.size(); ++i)
      EXPECT_TRUE(together[i] == alone[i]) << "product " << i << " on " << threads << " threads";
  }
}

// Small ones take and give back their work space all the time.
TEST(MatrixProducts, AreRightOnSeveralThreadsHoweverOftenTheyBegin) {
  const MatrixXd left = factor(40, 40, 1);
  const MatrixXd right = factor(40, 40, 2);
  const MatrixXd alone = left * right;
  std::vector<int> wrong(kProducts, 0);
  set_thread_count(3);
  parallel_for(kProducts, [&](int i) {
    MatrixXd again;
    for (int turn = 0; turn < 600; ++turn) {
      again.noalias() = left * right;
      wrong[static_cast<std::size_t>(i)] += again == alone ? 0 : 1;
    }
  });
  set_thread_count(0);
  EXPECT_EQ(wrong, std::vector<int>(kProducts, 0));
}

// The factors' entries are exact, so the sums are known but for their rounding.
TEST(MatrixProducts, AreSumsOfProducts) {
  const Factors of(3);
  const MatrixXd actual = of.left * of.right;
  for (Index i = 0; i < actual.rows(); i += 17)
    for (Index j = 0; j < actual.cols(); j += 13) {
      double sum = 0;
      for (Index k = 0; k < 250; ++k) sum += of.left(i, k) * of.right(k, j);
      EXPECT_NEAR(actual(i, j), sum, 1e-12);
    }
}

TEST(MatrixProducts, AreOfABlasForManyThreads) { EXPECT_NE(openblas_get_parallel(), OPENBLAS_SEQUENTIAL); }

class BlasThreads : public testing::Test {
 protected:
  void SetUp() override {
    static const int kAtStart = openblas_get_num_threads();
    at_start_ = kAtStart;
    openblas_set_num_threads(2);
  }
  void TearDown() override {
    openblas_set_num_threads(at_start_);
    set_thread_count(0);
  }
  int at_start_ = 0;
};

// The library has been loaded and no test has run: as many as OpenBLAS takes by itself.
TEST_F(BlasThreads, AreThoseOfTheHostWhenTheLibraryIsLoaded) {
  if (openblas_get_num_procs() == 1 || std::getenv("OPENBLAS_NUM_THREADS") != nullptr)
    GTEST_SKIP() << "one thread is what the host asks for";
  EXPECT_GT(at_start_, 1);
}

TEST_F(BlasThreads, AreOneInsideOfTasksAndThenWhatTheyWere) {
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    std::vector<int> inside(7, 0);
    parallel_for(7, [&](int i) { inside[static_cast<std::size_t>(i)] = openblas_get_num_threads(); });
    EXPECT_EQ(inside, std::vector<int>(7, 1)) << threads;
    EXPECT_EQ(openblas_get_num_threads(), 2) << threads;
  }
}

TEST_F(BlasThreads, AreRestoredByTheLastOfSeveralGuards) {
  {
    const SerialBlas outer;
    {
      const SerialBlas inner;
      EXPECT_EQ(openblas_get_num_threads(), 1);
    }
    EXPECT_EQ(openblas_get_num_threads(), 1);
  }
  EXPECT_EQ(openblas_get_num_threads(), 2);
}

TEST_F(BlasThreads, AreRestoredWhereATaskThrows) {
  EXPECT_THROW(parallel_for(3, [](int) { throw std::runtime_error("no"); }), std::runtime_error);
  EXPECT_EQ(openblas_get_num_threads(), 2);
}

}  // namespace
}  // namespace pulson
