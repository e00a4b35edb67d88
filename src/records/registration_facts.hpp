#pragma once

#include "facts.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::records {

/// Of a registration, by the keys of registration.json.
const Facts<matching::Registration>& registration_facts();

}  // namespace pulson::records
