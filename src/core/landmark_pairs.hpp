#pragma once

#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// Which landmarks of two shapes correspond: first[i] of one and other[i] of the other, counted from 0.
struct LandmarkPairs {
  std::vector<int> first;
  std::vector<int> other;
};

/// Pairs by labels, or by the numbers of a file that numbers its landmarks, where both shapes have them, each once, and
/// at least half of the smaller shape's, and two, are the other's, too; those of one side only are left out. Else by
/// order, which requires equal numbers of landmarks. Labels such as `F-1` and `F_1-1`, which a program gave, have
/// little in common and do not pair. Adds to `notes`, one line each, that the order differs, that landmarks are left
/// out, which, or that labels which both shapes have are in different positions and were not used.
/// @throws InputError if the shapes have different numbers of landmarks and neither labels nor numbers pair them
LandmarkPairs pair_landmarks(const Landmarks& first, const Landmarks& other, std::vector<std::string>& notes);

/// These landmarks of a shape, in this order; those of a part keep their numbers.
Landmarks selected(const Landmarks& shape, const std::vector<int>& landmarks);

/// `other` with the landmarks of `first` in their order; those that it lacks are missing. Notes and
/// errors as pair_landmarks().
Landmarks in_order_of(const Landmarks& first, const Landmarks& other, std::vector<std::string>& notes);

/// The first few of these landmarks, for a message: `'nose', 'chin', 7, …`.
std::string listed(const Landmarks& shape, const std::vector<int>& landmarks);

}  // namespace pulson
