#pragma once

#include <memory>
#include <string_view>

#include "pulson/core/landmarks.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/dynamics/noise_model.hpp"

namespace pulson {

/// Makes a model for a shape, of which some take a grid over its box, or its groups.
using MakeNoise = std::shared_ptr<const NoiseModel> (*)(const Parameters&, const Landmarks& shape);
using NoiseTable = NameTable<MakeNoise>;

/// Noise models by name; see `pulson info noises` and docs/adding_a_noise_model.md.
const NoiseTable& noise_table();

/// Adds a model of your own: from then on its name works wherever a noise is specified, in registrations, comparisons
/// and the records that are read. Before other threads use the table. @throws InputError if the name is taken
void add_noise(NoiseTable::Row row);

/// The noise model of a specification such as `ch-sd:beta=4,on=2`, or of a sum such as `ch-sd:beta=1+p-sd:beta=0.2`,
/// for landmarks like those of `shape`. @throws InputError
std::shared_ptr<const NoiseModel> make_noise(std::string_view spec, const Landmarks& shape = {});

}  // namespace pulson
