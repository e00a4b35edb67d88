#pragma once

#include <string>
#include <vector>

#include "pulson/records/records.hpp"

namespace pulson {

/// Landmarks by number, of which three and more in a row are "12–15", or by label; of many the first.
std::string landmark_list(const Landmarks& shape, const std::vector<int>& landmarks);

/// "leave-one-out error 13.5 (alignment alone: 21.5): each landmark is where the others predict it"; "undetermined: it
/// takes 8 landmarks"; empty for curves. A good prediction clears landmarks, but never their order: none is cleared
/// where the audit has a finding.
std::string prediction_text(const matching::Registration& registration, const records::RegistrationFacts& facts);

/// The note where the displacements have no common smooth part, else empty.
std::string prediction_note(const records::RegistrationFacts& facts);

/// Where the noise does its work: "not diffeomorphic here: landmarks 7, 12–15 (93 % of the action)"; empty where its
/// action is not concentrated.
std::string place_of_noise(const matching::Registration& registration, const records::RegistrationFacts& facts);

/// What the target's positions ask for, whatever the path makes of it: "the target's order differs in 21 pairs of
/// landmarks; the path exchanges 21 of them", or the triangles that it flips; empty for shapes in space and where the
/// plane keeps its orientation.
std::string topology_of_target(const matching::Registration& registration, const records::RegistrationFacts& facts);

/// Whether flipped triangles are a warning: with noise, or where prediction fails. A flow bends lines, and triangles
/// that a good prediction accounts for may flip.
bool flips_matter(const matching::Registration& registration, const records::RegistrationFacts& facts);

}  // namespace pulson
