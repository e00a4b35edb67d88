#pragma once

#include "formats/json/json_reader.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::records {

/// `channels`: what each number of a row of `increments` drives, `[{noise, landmark, axis, center, wavevector}]`.
/// Landmarks have the numbers of residuals.csv, a list of them where there are several; axes are counted from 1; keys
/// that do not apply are left out.
formats::Json channels_json(const matching::Registration& registration);

}  // namespace pulson::records
