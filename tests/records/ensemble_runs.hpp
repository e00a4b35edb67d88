#pragma once

#include "ensemble_examples.hpp"
#include "pulson/records/records.hpp"

namespace pulson::records {

/// Two landmarks on a line, with histograms at all times but the first.
inline EnsembleExample line_example() {
  EnsembleExample example;
  example.options = options_of({2, 100}, 100, 18446744073709551557U);
  example.options.records = {0, 25, 100};
  example.options.histograms = {25, 100};
  return example;
}

/// Three landmarks in the plane.
inline EnsembleExample plane_example() {
  EnsembleExample example{.noise = "ch-sd:beta=0.3"};
  example.start = {(Points(2, 3) << 0, 2, 1, 0, 0, 1).finished(), (Points(2, 3) << 1, 0, -1, 0, 2, 1).finished()};
  example.options = options_of({2, 20}, 70, 4);
  example.options.records = {0, 20};
  example.options.histograms = {20};
  return example;
}

/// What the program makes of an example that has sampled so many blocks.
inline EnsembleRun run_after(const EnsembleExample& example, int blocks) {
  ensemble::Ensemble ensemble = example.ensemble();
  ensemble.advance(blocks);
  Landmarks shape;
  shape.points = example.start.q;
  shape.source = "shapes.tps#7";
  return {example.system(),
          example.integrator,
          shape,
          example.start,
          ensemble.options(),
          ensemble.options().histograms,
          ensemble.sums(),
          ensemble.method(),
          2,
          1.5};
}

inline EnsembleRun finished_run(const EnsembleExample& example) { return run_after(example, 1000); }

}  // namespace pulson::records
