#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pulson/core/estimate.hpp"
#include "pulson/fokker_planck/pair_equation.hpp"
#include "records/facts.hpp"

namespace pulson {

/// A probability by sample paths, of those that are clean. NaN where none is.
struct SampledProbability : Estimate {
  std::int64_t paths = 0;

  double known_error() const;  ///< NaN where all paths or none are counted, as 0 would say nothing
  std::string text() const;
};

/// What was computed of a pair.
struct PairRun {
  const fokker_planck::PairEquation& equation;
  std::string noise;
  double tolerance = 0;
  const fokker_planck::PairCrossing& crossing;
  const std::vector<SampledProbability>& sampled;  ///< at the times of the crossing; may be empty
  std::int64_t samples = 0;
  double dt = 0;  ///< of the samples
};

const Facts<PairRun>& pair_equation_facts();

/// Of runs that have samples.
const Facts<PairRun>& sampled_pair_facts();

}  // namespace pulson
