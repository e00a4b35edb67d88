#include <algorithm>
#include <numeric>
#include <set>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "atlas_examples.hpp"
#include "error_of.hpp"
#include "pulson/cohort/linear_model.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using testing::HasSubstr;

const Atlas& null_atlas() {
  static const Atlas atlas = [] {
    const CohortLaw law;
    return make_atlas(drawn_shapes(law, 20, 21), options_of(law));
  }();
  return atlas;
}

Eigen::VectorXd normals(std::uint64_t seed, int count) { return standard_normals(seed, 0, count, 1); }

TEST(RandomPermutation, IsAPermutationOfItsOwn) {
  std::vector<int> order = random_permutation(1, 2, 10), other = random_permutation(1, 3, 10);
  EXPECT_EQ(order, random_permutation(1, 2, 10));
  EXPECT_NE(order, other);
  std::sort(order.begin(), order.end());
  for (int i = 0; i < 10; ++i) EXPECT_EQ(order[static_cast<std::size_t>(i)], i);
  std::set<std::vector<int>> all;
  for (std::uint64_t k = 0; k < 200; ++k) all.insert(random_permutation(5, k, 3));
  EXPECT_EQ(all.size(), 6U);
}

ModelTest test_of(const Atlas& atlas, const ModelFormula& formula, const std::vector<std::string>& fields,
                  const PermutationOptions& options) {
  const ModelData data{std::vector<std::string>(fields.size()), {{"x", fields}}};
  return test_model(make_design(formula, data), momentum_modes(atlas).scores, options);
}

ModelTest test_on(const Atlas& atlas, const Eigen::VectorXd& x, const PermutationOptions& options) {
  std::vector<std::string> fields;
  for (const double value : x) fields.push_back(std::isfinite(value) ? fmt::format("{:.17g}", value) : "NA");
  return test_of(atlas, ModelFormula::of_column("x", false), fields, options);
}

// Against least squares of the coordinates L'p, whose inner product is that of the metric.
TEST(Regression, IsLeastSquaresInTheMetric) {
  const Atlas& atlas = null_atlas();
  const Eigen::VectorXd x = normals(3, 20);
  const ModelTest test = test_on(atlas, x, {99, 1});
  const Eigen::LLT<Eigen::MatrixXd> factors(atlas.metric());
  Eigen::MatrixXd rows(20, 24);
  for (Index i = 0; i < 20; ++i)
    rows.row(i) = (atlas.specimens[static_cast<std::size_t>(i)].momenta * Eigen::MatrixXd(factors.matrixL()))
                      .reshaped()
                      .transpose();
  Eigen::MatrixXd design(20, 2);
  design << Eigen::VectorXd::Ones(20), x;
  const Eigen::MatrixXd coefficients = design.colPivHouseholderQr().solve(rows);
  const double residual = (rows - design * coefficients).squaredNorm();
  const double total = (rows.rowwise() - rows.colwise().mean()).squaredNorm();
  EXPECT_NEAR(test.terms[0].r_squared, 1 - residual / total, 1e-9);
  EXPECT_NEAR(test.terms[0].f, (total - residual) / (residual / 18), 1e-6 * test.terms[0].f);
  const Points slope = coefficients.row(1).transpose().reshaped(2, 12);
  EXPECT_LT((regress_momenta(atlas, x).slope * Eigen::MatrixXd(factors.matrixL()) - slope).norm(), 1e-9 * slope.norm());
}

TEST(Regression, FindsAPlantedSlope) {
  const CohortLaw law;
  std::vector<Landmarks> shapes = drawn_shapes(law, 20, 22);
  Eigen::VectorXd x = normals(4, 20);
  Points direction = 0 * law.q0;
  for (Index a = 0; a < 12; ++a) direction(1, a) = law.q0(0, a) * law.q0(0, a);  // a bend
  for (Index i = 0; i < 20; ++i) shapes[static_cast<std::size_t>(i)].points += 0.1 * x[i] * direction;
  x[5] = std::nan("");
  const Atlas atlas = make_atlas(shapes, options_of(law));
  const MomentumRegression found = regress_momenta(atlas, x);
  EXPECT_EQ(found.specimens, 19);
  EXPECT_EQ(test_on(atlas, x, {999, 1}).terms[0].p_value, 1e-3);
  // The shape at one more than the mean differs from that at the mean by the bend.
  const Points moved =
      atlas.geodesic(found.momenta(found.mean + 1)).final().q - atlas.geodesic(found.momenta(found.mean)).final().q;
  const double along = moved.cwiseProduct(direction).sum() / direction.squaredNorm();
  EXPECT_NEAR(along, 0.1, 0.02);
}

TEST(Groups, OfTwoAreARegressionOnTheirIndicator) {
  const Atlas& atlas = null_atlas();
  std::vector<std::string> groups(20, "a");
  Eigen::VectorXd x = Eigen::VectorXd::Zero(20);
  for (Index i = 0; i < 20; i += 3) {
    groups[static_cast<std::size_t>(i)] = "b";
    x[i] = 1;
  }
  const ModelTest found = test_of(atlas, ModelFormula::of_column("x", true), groups, {199, 2});
  const ModelTest regression = test_on(atlas, x, {199, 2});
  EXPECT_NEAR(found.terms[0].r_squared, regression.terms[0].r_squared, 1e-10);
  EXPECT_NEAR(found.terms[0].f, regression.terms[0].f, 1e-8);
  EXPECT_EQ(found.terms[0].p_value, regression.terms[0].p_value);
  ASSERT_EQ(found.pairs.size(), 1U);
  EXPECT_EQ(found.pairs[0].p_value, found.terms[0].p_value);
  const std::vector<GroupMean> means = group_means(atlas, groups);
  EXPECT_EQ(means[0].name, "b");
  EXPECT_EQ(means[0].size, 7);
  const Points difference = means[1].momenta - means[0].momenta;
  EXPECT_NEAR(found.pairs[0].distance, std::sqrt(difference.cwiseProduct(difference * atlas.metric()).sum()), 1e-9);
}

// Kolmogorov's bound for 500 draws at 1 in 1000 is 1.95/√500, and p takes steps of 1/100.
void expect_uniform(std::vector<double> p) {
  std::sort(p.begin(), p.end());
  double largest = 0;
  for (std::size_t i = 0; i < p.size(); ++i)
    largest = std::max(largest, std::abs(p[i] - (static_cast<double>(i) + 0.5) / static_cast<double>(p.size())));
  EXPECT_LT(largest, 1.95 / std::sqrt(static_cast<double>(p.size())) + 0.01);
}

TEST(PermutationTests, ArePUniformWhereNothingIsThere) {
  std::vector<double> of_regression, of_groups;
  for (std::uint64_t draw = 0; draw < 500; ++draw) {
    const Eigen::VectorXd x = normals(100 + draw, 20);
    of_regression.push_back(test_on(null_atlas(), x, {99, draw}).terms[0].p_value);
    std::vector<std::string> groups;
    for (const double value : x) groups.emplace_back(value > 0 ? "a" : "b");
    if (std::set<std::string>(groups.begin(), groups.end()).size() < 2) continue;
    of_groups.push_back(test_of(null_atlas(), ModelFormula::of_column("x", true), groups, {99, draw}).terms[0].p_value);
  }
  expect_uniform(of_regression);
  expect_uniform(of_groups);
}

TEST(PermutationTests, HaveTheSameBitsForAnyNumberOfThreads) {
  const Eigen::VectorXd x = normals(9, 20);
  set_thread_count(1);
  const TermTest one = test_on(null_atlas(), x, {999, 3}).terms[0];
  set_thread_count(2);
  const TermTest two = test_on(null_atlas(), x, {999, 3}).terms[0];
  EXPECT_EQ(two.p_value, one.p_value);
  EXPECT_EQ(two.z, one.z);
  set_thread_count(0);
  EXPECT_NE(test_on(null_atlas(), x, {999, 4}).terms[0].p_value, one.p_value);
}

TEST(PermutationTests, RefuseWhatSaysNothing) {
  const Atlas& atlas = null_atlas();
  EXPECT_THAT(error_of([&] { regress_momenta(atlas, Eigen::VectorXd::Ones(20)); }), HasSubstr("same value"));
  EXPECT_THAT(error_of([&] { regress_momenta(atlas, Eigen::VectorXd::Constant(20, std::nan(""))); }),
              HasSubstr("needs three"));
  EXPECT_THAT(error_of([&] { test_on(atlas, normals(9, 20), {0, 1}); }), HasSubstr("must be at least 1"));
}

}  // namespace
}  // namespace pulson::cohort
