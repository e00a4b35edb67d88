// Searches over paths where they are hard, and what they must not depend on.

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <gtest/gtest.h>

#include "path_examples.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::matching {
namespace {

PathMatch permutation(const Points& target, double beta, int steps) {
  Points source = target;
  std::sort(source.data(), source.data() + source.size());
  return {source, target, "gaussian:alpha=1", ch_sd(beta), {1, steps}, 1e-3, 1};
}

TEST(PathMinima, OfPermutationsOnALineAreResolved) {
  for (const Points& target :
       {Points{{3, 0, 2, 1}}, Points{{3, 2, 1, 0}}, Points{{4, 2, 0, 3, 1}}, Points{{2, 0, 4, 1, 3}}})
    for (const double beta : {0.5, 1.0}) {
      SCOPED_TRACE(fmt::format("{} landmarks, the first to {}, beta {}", target.cols(), target(0), beta));
      const PathSolution coarse = permutation(target, beta, 20).search();
      const PathSolution fine = permutation(target, beta, 40).search();
      EXPECT_NEAR(coarse.cost.total(), fine.cost.total(), 5e-3 * fine.cost.total());
      EXPECT_LE(largest(fine.path.end() - target), 0.1);
    }
}

TEST(PathMinima, LeaveTheSaddleOfASwapInThePlane) {
  const auto swap = [](int steps) {
    return PathMatch{Points{{0, 1}, {0, 0}}, Points{{1, 0}, {0, 0}}, "gaussian:alpha=1", ch_sd(0.4), {1, steps}, 1e-4};
  };
  const PathSolution coarse = swap(20).search(), fine = swap(40).search();
  EXPECT_LE(coarse.cost.total(), 2.58);
  EXPECT_NEAR(coarse.cost.total(), fine.cost.total(), 5e-3 * fine.cost.total());
  EXPECT_GT(largest(fine.path.nodes[20].row(1)), 0.1);  // around each other
}

// Fields on a line, as those of a plane.
StepFields in_the_plane(StepFields fields) {
  const auto raised = [](const Points& x) {
    Points y = Points::Zero(2, x.cols());
    y.row(0) = x.row(0);
    return y;
  };
  for (auto* all : {&fields.centres, &fields.momenta, &fields.own})
    for (Points& x : *all) x = raised(x);
  for (Eigen::VectorXd& u : fields.controls) u = raised(u.transpose()).reshaped().eval();
  return fields;
}

// The minimum among paths on a line is a saddle among those of the plane: its gradient vanishes.
TEST(PathMinima, LeaveTheSaddlesThatMinimaOnALineAre) {
  for (const Points& target : {Points{{1, 0}}, Points{{2, 1, 0}}, Points{{1, 0, 2}}}) {
    Points source = target;
    std::sort(source.data(), source.data() + source.size());
    PathMatch match{source, target, "gaussian:alpha=1", ch_sd(0.4)};
    const PathSolution on_line = match.search();
    const auto raised = [](const Points& x) {
      Points y = Points::Zero(2, x.cols());
      y.row(0) = x;
      return y;
    };
    match.source = raised(source);
    match.target = raised(target);
    const StepFields start = in_the_plane(on_line.fields);
    const double best = match.search().cost.total();
    EXPECT_LT(best, 0.95 * on_line.cost.total());
    const PathSolution leaves = match.search(&start);
    EXPECT_NEAR(leaves.cost.total(), best, 1e-6 * best);
    EXPECT_LE(leaves.iterations, 60);
    std::vector<Points> nodes;
    for (const Points& node : on_line.path.nodes) nodes.push_back(raised(node));
    const MatchingProblem problem = match.problem();
    std::optional<DiscretePath> line = along({problem.system, problem.lambda}, problem.grid, nodes);
    ASSERT_TRUE(line);
    const PathSolution stays = continue_path(problem, {}, std::move(*line));
    EXPECT_NEAR(stays.cost.total(), on_line.cost.total(), 1e-9 * on_line.cost.total());
  }
}

// Noise that moves a landmark by where the others are.
TEST(PathMinima, OfScreenedSwapsInThePlaneAreReached) {
  for (const char* kernel : {"gaussian:alpha=1", "matern32:alpha=1", "matern52:alpha=1"}) {
    PathMatch match{Points{{0, 1}, {0, 0}}, Points{{1, 0}, {0, 0}}, kernel, "ch-sd-screened:beta=0.3,gamma=0.5"};
    match.sigma = 1e-2;
    EXPECT_LE(match.search().iterations, 40);
  }
}

TEST(PathMinima, ExistWhereLandmarksCoincide) {
  const Points apart{{0, 1, 2}, {0, 0, 0}}, joined{{0.5, 0.5, 2}, {0.2, 0.2, 0}};
  for (const double beta : {0.1, 0.5, 1.0}) {
    const auto match = [&](const Points& source, const Points& target, int steps) {
      return PathMatch{source, target, "gaussian:alpha=1", ch_sd(beta), {1, steps}, 1e-3};
    };
    const double coarse = match(apart, joined, 20).search().cost.total();
    const double fine = match(apart, joined, 40).search().cost.total();
    EXPECT_NEAR(coarse, fine, 5e-3 * fine);
    // Midpoint paths may be run backwards.
    EXPECT_NEAR(match(joined, apart, 20).search().cost.total(), coarse, 1e-4 * coarse);
  }
  PathMatch diffeomorphic{apart, joined, "gaussian:alpha=1", "none", {1, 20}, 1e-2};
  EXPECT_GT(diffeomorphic.search().cost.total(), 5);
}

// With sigma below 1e-8 of the shape round-off hides the gradient.
TEST(PathMinima, AreClaimedOnlyWhereTheyAreFound) {
  PathMatch match = nearby_shapes("none");
  const double right = match.search().cost.total();
  for (const double sigma : {1e-7, 1e-8, 1e-9, 1e-10}) {
    match.sigma = sigma;
    const PathSolution found = search_paths(match.problem(), {});
    if (found.converged) {
      EXPECT_NEAR(found.cost.total(), right, 1e-4 * right) << sigma;
    }
  }
}

TEST(PathMinima, DoNotDependOnTheUnit) {
  const auto match_in = [](double unit, const std::string& noise) {
    PathMatch match = nearby_shapes("none");
    match.source *= unit;
    match.target *= unit;
    match.sigma *= unit;
    match.lambda /= unit * unit;
    match.kernel = fmt::format("gaussian:alpha={}", unit);
    match.noise = fmt::format(fmt::runtime(noise), fmt::arg("beta", 0.3 * unit), fmt::arg("gamma", 0.8 * unit * unit),
                              fmt::arg("wavenumber", 1.3 / unit), fmt::arg("width", 0.7 * unit));
    return match;
  };
  for (const std::string noise :
       {"none", "ch-sd:beta={beta}", "ch-sd-screened:beta={beta},gamma={gamma}",
        "p-sd:beta={beta},fields=cos,wavenumber={wavenumber}", "p-sd:beta={beta},fields=grid,count=3,width={width}"}) {
    SCOPED_TRACE(noise);
    const PathSolution found = match_in(1, noise).search();
    for (const double unit : {1e-3, 1e3, 1e6}) {
      const PathSolution other = match_in(unit, noise).search();
      EXPECT_NEAR(other.cost.total(), found.cost.total(), 1e-12 * found.cost.total());
      EXPECT_LE((other.momenta / unit - found.momenta).norm(), 1e-8 * found.momenta.norm());
      EXPECT_EQ(other.iterations, found.iterations);
    }
  }
}

TEST(PathMinima, DoNotDependOnTheOrigin) {
  for (const std::string noise : {"none", "ch-sd:beta=0.3", "ch-sd-screened:beta=0.3,gamma=0.8"}) {
    PathMatch match = nearby_shapes(noise);
    const PathSolution found = match.search();
    match.source.array() += 1e4;
    match.target.array() += 1e4;
    const PathSolution other = match.search();
    EXPECT_NEAR(other.cost.total(), found.cost.total(), 1e-7 * found.cost.total());
    EXPECT_LE((other.momenta - found.momenta).norm(), 1e-6 * found.momenta.norm());
  }
}

TEST(PathMinima, HaveTheSameBitsForAnyNumberOfThreads) {
  for (const std::string noise :
       {"none", "ch-sd:beta=0.3", "ch-sd-screened:beta=0.3,gamma=0.8", "p-sd:beta=0.3,fields=cos"}) {
    PathMatch match = nearby_shapes(noise, 2, 9);
    match.grid.steps = 10;
    set_thread_count(1);
    const PathSolution one = match.search();
    for (const int threads : {2, 3}) {
      set_thread_count(threads);
      const PathSolution more = match.search();
      EXPECT_EQ(one.momenta, more.momenta);
      EXPECT_EQ(one.increments, more.increments);
      EXPECT_EQ(one.path.end(), more.path.end());
      EXPECT_EQ(one.cost.total(), more.cost.total());
      EXPECT_EQ(one.iterations, more.iterations);
    }
  }
  set_thread_count(0);
}

TEST(PathMinima, AreFoundAtOnceFromTheirFields) {
  for (const std::string& noise : linear_noise_specs()) {
    SCOPED_TRACE(noise);
    const PathMatch match = nearby_shapes(noise);
    const PathSolution found = match.search();
    const PathSolution again = match.search(&found.fields);
    EXPECT_LE(again.iterations, 1);
    EXPECT_NEAR(again.cost.total(), found.cost.total(), 1e-12 * found.cost.total());
    EXPECT_LE((again.momenta - found.momenta).norm(), 1e-7 * found.momenta.norm());
  }
}

// What is not observed does not pull, nor does what has no weight.
TEST(PathMinima, OfPartialDataLeaveOutWhatIsMissing) {
  for (const int d : {1, 2, 3}) {
    const PathMatch match = nearby_shapes("ch-sd:beta=0.3", d);
    MatchingProblem problem = match.problem();
    LandmarkObservations data{match.target, match.sigma};
    data.target(d - 1, 1) = kNaN;
    data.weights = Eigen::Vector4d(1, 1, 1, 0);
    problem.data = std::make_shared<LandmarkTerm>(data);
    const PathSolution found = search_paths(problem, {});
    EXPECT_TRUE(found.converged) << found.reason;
    EXPECT_LT(found.cost.total(), match.search().cost.total());
    // p(T) = −∂D/∂q/λ.
    const Trajectory path =
        make_integrator("midpoint")
            ->integrate(problem.system, {match.source, found.momenta}, match.grid, found.increments);
    const Points pull = problem.data->gradient(found.path.end());
    EXPECT_EQ(pull(d - 1, 1), 0);
    EXPECT_EQ(pull.col(3).norm(), 0);
    EXPECT_LE((problem.lambda * path.final().p + pull).norm(), 1e-5 * pull.norm());
  }
}

TEST(PathMinima, OfCurvesConverge) {
  for (const std::string noise : {"none", "ch-sd:beta=0.1"}) {
    PathMatch match;
    match.source.resize(2, 16);
    std::vector<std::pair<int, int>> edges;
    for (int a = 0; a < 16; ++a) {
      const double angle = 2 * std::numbers::pi * a / 16;
      match.source.col(a) << std::cos(angle), std::sin(angle);
      edges.emplace_back(a, (a + 1) % 16);
    }
    match.target = Eigen::DiagonalMatrix<double, 2>(1.4, 0.8) * match.source;
    match.noise = noise;
    match.sigma = 0.02;
    MatchingProblem problem = match.problem();
    problem.data = std::make_shared<CurveTerm>(edges, 16, Curve{match.target, edges},
                                               CurveTermOptions{CurveMeasure::kVarifold, match.sigma, 0.5});
    const PathSolution found = search_paths(problem, {});
    EXPECT_TRUE(found.converged) << found.reason;
    EXPECT_LE(found.relative_gradient, 1e-3);
    EXPECT_LT(found.cost.total(), match.search().cost.total());
  }
}

}  // namespace
}  // namespace pulson::matching
