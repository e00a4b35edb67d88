#pragma once

#include <vector>

#include "formats/json/json_reader.hpp"
#include "pulson/records/records.hpp"

namespace pulson::records {

/// The numbers of these landmarks.
formats::Json numbers_of(const Landmarks& shape, const std::vector<int>& landmarks);

/// `verdicts`, `prediction`, `concentrated` and `target_topology` of a record.
void add_verdicts(const matching::Registration& registration, const RegistrationFacts& facts, formats::Json& json);

}  // namespace pulson::records
