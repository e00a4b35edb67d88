// Geodesics that few landmarks carry against those of all, and against an accurate integrator.

#include "geodesic_search.hpp"

#include <cmath>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "carriers.hpp"
#include "pulson/dynamics/stochastic_system.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;

// A circle of n points to an ellipse with a bump.
MatchingProblem circle_problem(Index n, const std::string& kernel, double sigma) {
  Points source(2, n), target(2, n);
  for (Index a = 0; a < n; ++a) {
    const double t = 2 * std::numbers::pi * static_cast<double>(a) / static_cast<double>(n);
    source.col(a) << std::cos(t), std::sin(t);
    const double bump = 1 + 0.3 * std::exp(-8 * (1 - std::cos(t - 1)));
    target.col(a) << 1.3 * bump * std::cos(t), 0.8 * bump * std::sin(t);
  }
  return {{make_kernel(kernel, source), make_noise("none")},
          nullptr,
          {1, 20},
          source,
          std::make_shared<LandmarkTerm>(LandmarkObservations{target, sigma}),
          sigma,
          1};
}

struct Cost {
  double energy, data;
  double total() const { return energy + data; }
};

// By a shot in ten times as many steps.
Cost accurate(const MatchingProblem& problem, const GeodesicSolution& found) {
  const PhaseState start{problem.source, found.momenta};
  const TimeGrid grid{problem.grid.time, 10 * problem.grid.steps};
  const Points end =
      make_integrator("rk4")->integrate(problem.system, start, grid, Eigen::MatrixXd(0, grid.steps)).final().q;
  return {problem.lambda * hamiltonian(problem.system.kernel, start), problem.data->value(end)};
}

TEST(Carriers, AreFewWhereTheKernelIsWide) {
  EXPECT_FALSE(find_carriers(circle_problem(300, "gaussian:alpha=0.6", 0.002)));
  EXPECT_TRUE(find_carriers(circle_problem(400, "gaussian:alpha=0.6", 0.002)));
  EXPECT_FALSE(find_carriers(circle_problem(400, "matern32:alpha=0.6", 0.002)));
}

// Near what the carriers' data are known for, they are those of all.
TEST(Carriers, SeeTheDataOfAll) {
  const MatchingProblem problem = circle_problem(600, "gaussian:alpha=0.6", 0.01);
  const std::optional<Carriers> carriers = find_carriers(problem);
  ASSERT_TRUE(carriers);
  const auto pushed = [&](double s) {  // a smooth motion
    Points q = problem.source;
    q.row(0) += s * q.row(1).array().sin().matrix();
    q.row(1) += s * (q.row(0).array() * q.row(1).array()).matrix();
    return q;
  };
  const Points all = pushed(0.5);
  const MatchingProblem few = carriers->problem(carriers->of(all), all);
  EXPECT_NEAR(few.data->value(carriers->of(all)), problem.data->value(all), 1e-6 * problem.data->value(all));
  for (const double s : {0.45, 0.6}) {
    const Points there = pushed(s);
    const double right = problem.data->value(there);
    EXPECT_NEAR(few.data->value(carriers->of(there)), right, 1e-3 * right);
  }
}

TEST(SearchGeodesic, CostsTheSameWhetherFewCarryOrAllAreSearched) {
  const MatchingProblem dense = circle_problem(300, "gaussian:alpha=0.6", 0.004 / std::sqrt(2));
  const MatchingProblem carried = circle_problem(600, "gaussian:alpha=0.6", 0.004);
  ASSERT_FALSE(find_carriers(dense));
  ASSERT_TRUE(find_carriers(carried));
  // Twice as many points of half the precision are the same curve, equally well known.
  const GeodesicSolution of_all = search_geodesic(dense, {}), of_few = search_geodesic(carried, {});
  for (const GeodesicSolution* found : {&of_all, &of_few}) {
    EXPECT_TRUE(found->converged) << found->reason;
    EXPECT_EQ(found->integrator, "rk4");
  }
  const Cost right = accurate(dense, of_all), cost = accurate(carried, of_few);
  EXPECT_NEAR(cost.total(), right.total(), 2e-3 * right.total());
  EXPECT_LT(cost.data, 0.02 * right.total());
  Index carrying = 0;
  for (Index a = 0; a < of_few.momenta.cols(); ++a) carrying += of_few.momenta.col(a).isZero(0) ? 0 : 1;
  EXPECT_LT(carrying, 300);
}

TEST(SearchGeodesic, LeavesOutLandmarksThatAreNotObserved) {
  MatchingProblem problem = circle_problem(600, "gaussian:alpha=0.6", 0.004);
  Points target = problem.data->landmarks()->target();
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(600);
  for (Index a = 100; a < 600; a += 5) {
    weights[a] = 0;
    target.col(a).setConstant(1e3);
  }
  problem.data = std::make_shared<LandmarkTerm>(LandmarkObservations{target, 0.004, weights});
  ASSERT_TRUE(find_carriers(problem));
  const GeodesicSolution found = search_geodesic(problem, {});
  EXPECT_TRUE(found.converged) << found.reason;
  const Cost cost = accurate(problem, found);
  EXPECT_LT(cost.data, 0.02 * cost.total());
}

}  // namespace
}  // namespace pulson::matching
