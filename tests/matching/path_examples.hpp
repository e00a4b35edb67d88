#pragma once

// Problems for the tests of searches over paths.

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "combinations.hpp"
#include "numbers.hpp"
#include "path_model.hpp"
#include "path_search.hpp"
#include "pulson/matching/data_term.hpp"
#include "shape.hpp"

namespace pulson::matching {

inline StochasticSystem make_system(const std::string& kernel, const std::string& noise, const Points& source) {
  return {make_kernel(kernel, source), make_noise(noise, shape(source))};
}

/// A search over paths between landmarks.
struct PathMatch {
  Points source, target;
  std::string kernel = "gaussian:alpha=1";
  std::string noise = "none";
  TimeGrid grid{1, 20};
  double sigma = 1e-4;
  double lambda = 1;

  MatchingProblem problem() const {
    return {make_system(kernel, noise, source),
            nullptr,
            grid,
            source,
            std::make_shared<LandmarkTerm>(LandmarkObservations{target, sigma}),
            sigma,
            lambda};
  }

  PathSolution search(const StepFields* start = nullptr) const {
    PathSolution solution = search_paths(problem(), {}, start);
    EXPECT_TRUE(solution.converged) << solution.reason;
    return solution;
  }
};

inline std::string ch_sd(double beta) { return "ch-sd:beta=" + std::to_string(beta); }

// Two landmarks on a line that change places.
inline PathMatch swap_on_a_line(double beta, double lambda, int steps) {
  return {Points{{0, 1}}, Points{{1, 0}}, "gaussian:alpha=1", ch_sd(beta), {1, steps}, 1e-4, lambda};
}

// J = (∫₀¹ dr/√((1 − K(r))/λ + β²))² in continuous time, by Simpson's rule.
inline double swap_cost(double beta, double lambda) {
  constexpr int kPairs = 500;
  const auto f = [&](int i) {
    const double r = i / (2.0 * kPairs);
    return 1 / std::sqrt((1 - std::exp(-r * r)) / lambda + beta * beta);
  };
  double sum = 0;
  for (int i = 0; i < 2 * kPairs; i += 2) sum += (f(i) + 4 * f(i + 1) + f(i + 2)) / (6 * kPairs);
  return sum * sum;
}

inline PathMatch nearby_shapes(const std::string& noise, int d = 2, int n = 4) {
  PathMatch match;
  match.source = Numbers(2).landmarks(d, n);
  match.target = match.source + 0.4 * Numbers(3)(d, n);
  match.noise = noise;
  match.sigma = 1e-3;
  return match;
}

/// w of the tests of PathModel.
inline constexpr double kWeight = 1.3;

/// A path by chance, from q0 = landmarks 0.6 apart.
struct PathExample {
  PathExample(const std::string& kernel, const std::string& noise, int dimension, int count, int steps)
      : d(dimension), n(count), grid{0.8, steps}, numbers(static_cast<unsigned>(10 * d + n)) {
    const Points source = numbers.landmarks(d, n);
    const Points displacement = 0.3 * numbers(d, n);
    for (int k = 0; k <= steps; ++k)
      nodes.push_back(source + (k * 1.0 / steps) * displacement + (k > 0 ? 0.01 : 0) * numbers(d, n));
    system.emplace(make_system(kernel, noise, source), 1.4);
    path = along(*system, grid, nodes);
  }

  /// Changes of the nodes, the first of which stays.
  std::vector<Points> change() {
    std::vector<Points> all(nodes.size(), Points::Zero(d, n));
    for (std::size_t j = 1; j < all.size(); ++j) all[j] = numbers(d, n);
    return all;
  }

  std::vector<Points> moved(double factor, const std::vector<Points>& by) const {
    std::vector<Points> all = nodes;
    for (std::size_t j = 0; j < all.size(); ++j) all[j] += factor * by[j];
    return all;
  }

  int d, n;
  TimeGrid grid;
  Numbers numbers;
  std::vector<Points> nodes;
  std::optional<EffectiveHamiltonian> system;
  std::optional<DiscretePath> path;
};

inline std::shared_ptr<const LandmarkTerm> plain_data(PathExample& example) {
  return std::make_shared<LandmarkTerm>(LandmarkObservations{example.numbers(example.d, example.n), 0.3});
}

/// Landmarks that were observed in part, with weights and covariances.
inline std::shared_ptr<const LandmarkTerm> partial_data(PathExample& example) {
  const int d = example.d, n = example.n;
  LandmarkObservations data{example.numbers(d, n), 0.3};
  data.target(0, 1) = kNaN;
  data.target.col(2).setConstant(kNaN);
  data.weights = Eigen::VectorXd::LinSpaced(n, 0, 2);
  for (int a = 0; a < n; ++a) {
    const Eigen::MatrixXd root = example.numbers(d, d);
    data.covariances.emplace_back(0.1 * Eigen::MatrixXd::Identity(d, d) + 0.2 * root * root.transpose());
  }
  return std::make_shared<LandmarkTerm>(data);
}

inline std::shared_ptr<const CurveTerm> curve_data(PathExample& example) {
  const int n = example.n;
  std::vector<std::pair<int, int>> edges;
  for (int a = 0; a + 1 < n; ++a) edges.emplace_back(a, a + 1);
  const Curve target{example.numbers.landmarks(example.d, n), edges};
  return std::make_shared<CurveTerm>(edges, n, target, CurveTermOptions{CurveMeasure::kVarifold, 0.3, 0.8});
}

/// f' at 0 by central differences of order 8.
template <class Function>
auto derivative(const Function& f, double h) {
  constexpr std::array<double, 4> kWeights{4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
  auto sum = ((f(h) - f(-h)) * (kWeights[0] / h)).eval();
  for (int i = 1; i < 4; ++i) sum += (f((i + 1) * h) - f(-(i + 1) * h)) * (kWeights[static_cast<std::size_t>(i)] / h);
  return sum;
}

inline Eigen::VectorXd stacked(const std::vector<Points>& all) {
  Eigen::VectorXd sum(static_cast<Eigen::Index>(all.size()) * all.front().size());
  for (std::size_t j = 0; j < all.size(); ++j)
    sum.segment(static_cast<Eigen::Index>(j) * all[j].size(), all[j].size()) = all[j].reshaped();
  return sum;
}

}  // namespace pulson::matching
