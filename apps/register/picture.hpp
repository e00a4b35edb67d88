#pragma once

#include <string>

#include "pulson/draw/registration_picture.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// What the picture of a registration shows: its path, and the grid that the flow carries along.
RegistrationPicture make_registration_picture(const Registration& registration, const Trajectory& path);

/// What pictures call a shape: its name; where that is a mere number, the file's name and the number.
std::string short_name(const Landmarks& shape);

}  // namespace pulson
