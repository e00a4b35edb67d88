#pragma once

#include "formats/json/json_reader.hpp"
#include "pulson/records/records.hpp"

namespace pulson::records {

/// How many of the clean paths end in a different order, with its error or the bound that holds with 95 %; null where
/// there is no order, or no clean path.
formats::Json crossing_json(const EnsembleRun& run);

/// How many paths ended how.
formats::Json paths_json(const ensemble::PathCounts& paths);

}  // namespace pulson::records
