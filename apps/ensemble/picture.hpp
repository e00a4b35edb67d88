#pragma once

#include "charts/chart.hpp"
#include "pulson/records/ensemble_record.hpp"

namespace pulson {

/// Means and the middle nine tenths of positions and momenta over time, and the densities of the positions at the end,
/// a row for each axis; of many landmarks the first few.
Chart ensemble_chart(const EnsembleRun& run);

}  // namespace pulson
