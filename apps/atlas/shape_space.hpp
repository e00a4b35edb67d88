#pragma once

#include <optional>

#include "cohort_pictures.hpp"
#include "html/html_report.hpp"
#include "results.hpp"

namespace pulson {

/// The shapes that up to three modes of an atlas make together, for its page: a polynomial of third degree in the
/// scores, fitted to geodesics of the momenta Σ_k s_k √(variance_k) direction_k; the caption says how far it is from
/// those of the specimens. None where the modes cannot be shot far enough, and on a line.
/// @param modes that the pictures show
std::optional<html::ReportShapeSpace> shape_space(const AtlasResults& results, int modes,
                                                  const std::optional<CohortPictures>& pictures);

}  // namespace pulson
