#pragma once

#include "path_sampler.hpp"

namespace pulson {

/// Samples one batch of lanes: `advance(batch, first, last)` takes steps, `copy(batch, states)` gives what a record
/// needs.
template <class Batch, class Advance, class Copy>
LaneEnds sample_lanes(Batch batch, const PathPlan& plan, Eigen::Index coordinates, const PathSampler::Sink& sink,
                      const Advance& advance, const Copy& copy) {
  LaneStates states;
  states.values.resize(kPathBatch, coordinates);
  const auto is_running = [&](std::size_t lane) { return batch.status[lane] == LaneStatus::kRunning; };
  std::uint32_t now = 0;
  for (std::size_t record = 0; record < plan.records.size(); ++record) {
    const auto next = static_cast<std::uint32_t>(plan.records[record]);
    advance(batch, now, next);
    now = next;
    copy(batch, states);
    states.largest_momentum = batch.largest_momentum;
    for (std::size_t lane = 0; lane < kPathBatch; ++lane) states.running[lane] = is_running(lane);
    sink(record, states);
  }
  advance(batch, now, static_cast<std::uint32_t>(plan.grid.steps));
  LaneEnds ends{{}, batch.largest_momentum, batch.smallest_side};
  for (std::size_t lane = 0; lane < kPathBatch; ++lane) ends.reached_end[lane] = is_running(lane);
  return ends;
}

}  // namespace pulson
