#pragma once

#include <string>
#include <vector>

#include "pulson/ensemble/sample_paths.hpp"

namespace pulson {

/// What a simulation was made of, and its sample paths.
struct Simulation {
  StochasticSystem system;
  std::string integrator;
  Landmarks shape;  ///< of the start
  PhaseState start;
  SamplePathsOptions options;
  std::vector<SamplePath> samples;
  double seconds = 0;
};

/// The record of a simulation as JSON: what it takes to repeat it, and for each path its status, the adapted state
/// (q, p̂) at its end as [landmark][axis], and diagnostics of its steps.
std::string simulation_json(const Simulation& simulation);

/// csv of all paths: `sample,step,time,landmark,q_x,…,p_x,…`, every `every`-th step and the last; samples and landmarks
/// count from 1, sample m being path m − 1 of brownian_increments; p is the adapted momentum.
std::string sample_paths_csv(const Simulation& simulation, int every = 1);

}  // namespace pulson
