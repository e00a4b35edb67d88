#pragma once

#include "facts.hpp"
#include "pulson/records/records.hpp"

namespace pulson::records {

/// Of an ensemble; `crossing` is of landmarks on a line: how many of the clean paths end in a different order.
const Facts<EnsembleRun>& ensemble_facts();

/// To a record; `crossing` is null where there is no order or no clean path, and has where all paths are alike the
/// bound that holds with 95 %.
void add_ensemble_facts(formats::Json& json, const Facts<EnsembleRun>& facts, const EnsembleRun& run);

}  // namespace pulson::records
