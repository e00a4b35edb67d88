#pragma once

#include "facts.hpp"
#include "pulson/records/records.hpp"

namespace pulson::records {

const Facts<Simulation>& simulation_facts();

/// One of the paths of a simulation.
struct SamplePathRow {
  const Simulation* simulation;
  std::size_t path = 0;

  const ensemble::SamplePath& sample() const { return simulation->samples[path]; }
};

const Facts<SamplePathRow>& sample_path_facts();

}  // namespace pulson::records
