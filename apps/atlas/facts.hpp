#pragma once

#include <vector>

#include "results.hpp"
#include "shell/facts.hpp"

namespace pulson {

/// A specimen of an atlas.
struct SpecimenRow {
  const AtlasResults* results;
  std::size_t specimen;
  double momenta_norm;
};

/// A mode, of the momenta and of Procrustes coordinates; from 0.
struct ModeRow {
  const AtlasResults* results;
  Eigen::Index mode;
};

const Facts<AtlasResults>& atlas_facts();
const Facts<SpecimenRow>& specimen_facts();
const Facts<ModeRow>& mode_facts();

std::vector<SpecimenRow> specimen_rows(const AtlasResults& results);
std::vector<ModeRow> mode_rows(const AtlasResults& results);

}  // namespace pulson
