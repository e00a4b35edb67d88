#pragma once

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pulson/matching/data_term.hpp"
#include "pulson/matching/objective.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::matching {

/// A problem of landmarks for the tests of searches.
struct Match {
  Points source, target;
  std::string kernel = "gaussian:alpha=0.5";
  std::string noise = "none";
  TimeGrid grid{1, 20};
  double sigma = 0.2;
  std::vector<Eigen::MatrixXd> realisations{};

  MatchingObjective objective() const {
    Landmarks shape;
    shape.points = source;
    return MatchingObjective({{make_kernel(kernel, source), make_noise(noise, shape)},
                              make_integrator("variational"),
                              grid,
                              source,
                              std::make_shared<LandmarkTerm>(LandmarkObservations{target, sigma}),
                              sigma,
                              1,
                              realisations});
  }
};

inline MinimiseSummary minimum(const Match& match, const MinimiseOptions& options) {
  return minimise(match.objective(), options);
}

}  // namespace pulson::matching
