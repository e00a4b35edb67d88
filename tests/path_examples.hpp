#pragma once

// Problems for the tests of searches over paths.

#include <memory>
#include <string>
#include <vector>

#include "combinations.hpp"
#include "path_search.hpp"
#include "pulson/matching/landmark_term.hpp"
#include "shape.hpp"

namespace pulson {

inline StochasticSystem make_system(const std::string& kernel, const std::string& noise, const Points& source) {
  return {make_kernel(kernel, source), make_noise(noise, shape(source))};
}

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

}  // namespace pulson
