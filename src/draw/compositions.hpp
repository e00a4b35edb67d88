#pragma once

#include "canvas.hpp"
#include "pulson/draw/registration_picture.hpp"

namespace pulson::picture {

/// The whole drawing for each dimension. The picture has been checked.
Canvas compose_line(const RegistrationPicture& picture);   // d = 1
Canvas compose_plane(const RegistrationPicture& picture);  // d = 2
Canvas compose_space(const RegistrationPicture& picture);  // d = 3

}  // namespace pulson::picture
