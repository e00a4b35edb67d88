#pragma once

#include "register/cohort.hpp"
#include "shell/facts.hpp"

namespace pulson {

/// Of one shape of a cohort; the numbers of a match are missing where it failed.
const Facts<SpecimenMatch>& match_facts();

}  // namespace pulson
