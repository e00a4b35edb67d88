#pragma once

#include "pulson/noise/noise_table.hpp"

namespace pulson {

// The rows of noise_table(), one function for each file of this folder.
NoiseTable::Row no_noise();
NoiseTable::Row ch_sd();
NoiseTable::Row ch_sd_screened();
NoiseTable::Row p_sd();
NoiseTable::Row trouve_vialard();
NoiseTable::Row potential();
NoiseTable::Row langevin();

/// The channels of all terms one after the other, and everything else their sum. @param terms at least two
std::shared_ptr<const NoiseModel> sum_of_noises(std::vector<std::shared_ptr<const NoiseModel>> terms);

}  // namespace pulson
