#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pulson/draw/pictures.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// `homotopy.csv`: one row per β.
std::string homotopy_csv(const std::vector<matching::HomotopyStep>& steps);

/// What they say of the pair, in one line.
std::string homotopy_line(const std::vector<matching::HomotopyStep>& steps, const matching::Registration& registration);

/// J, its parts and the distances over β. @throws InputError as write_chart() does
void write_homotopy_picture(const std::vector<matching::HomotopyStep>& steps,
                            const matching::Registration& registration, const draw::PictureFiles& files);

}  // namespace pulson
