#pragma once

#include "pulson/matching/registration.hpp"
#include "pulson/report/registration_picture.hpp"

namespace pulson {

/// What the picture of a registration shows: its path, and the grid that the flow carries along.
RegistrationPicture make_registration_picture(const Registration& registration, const Trajectory& path);

}  // namespace pulson
