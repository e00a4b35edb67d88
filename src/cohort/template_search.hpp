#pragma once

#include "pulson/cohort/atlas.hpp"

namespace pulson::cohort {

/// Finds the template, the momenta that match its specimens, and their poses, from the mean as it stands: each round
/// matches all, moves each specimen by the pose that its momenta contain, until Zᵀp = 0, and the template by
/// (A + λσ²)p̄, less what of that is a pose of the mean. Kernel, λ, σ and β are those of the atlas.
void search_template(Atlas& atlas, const AtlasOptions& options);

}  // namespace pulson::cohort
