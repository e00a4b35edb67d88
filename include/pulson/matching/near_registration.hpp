#pragma once

#include <vector>

#include "pulson/matching/registration.hpp"

namespace pulson::matching {

/// register_shapes() of shapes that are near those of an earlier match, as while a landmark is dragged: the search over
/// paths begins where the fields of that match carry the source, and looks for no other minima. So it takes a few
/// iterations, and ends at the minimum next to that path, which need not be the least. Searches over curves and those
/// that shoot begin as ever.
///
/// Kernel and λ are those of `options`; with the automatic ones they are fitted again. To follow a match give its own,
/// Registration::kernel and lambda, and the positions of replay().
/// @param path K + 1 ≥ 2 positions of the landmarks that take part, d×N each, at equal distances in time
/// @throws InputError as register_shapes(), and where the path is none of these landmarks
Registration register_near(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options,
                           const std::vector<Points>& path);

}  // namespace pulson::matching
