#pragma once

#include <memory>
#include <string_view>

#include "pulson/core/name_table.hpp"
#include "pulson/dynamics/noise_model.hpp"

namespace pulson {

using MakeNoise = std::shared_ptr<const NoiseModel> (*)(const Parameters&);

/// Noise models by name; see `pulson info noises`.
const NameTable<MakeNoise>& noise_table();

/// The noise model of a specification such as `ch-sd:beta=4,on=2`. @throws InputError
std::shared_ptr<const NoiseModel> make_noise(std::string_view spec);

}  // namespace pulson
