#pragma once

#include <string_view>
#include <vector>

#include "pulson/core/alignment.hpp"

namespace pulson {

/// Numbers that a map of the given kind has in R^d: none 0, translation d, rigid d(d+1)/2, similarity one more, affine
/// d(d+1).
Eigen::Index alignment_parameters(AlignmentKind kind, Eigen::Index d);

/// Whether the data hold more than a map of the given kind fits: coordinates of landmarks that are
/// finite in both shapes, with a weight above 0, are more than the map has parameters. Else the map fits them exactly
/// whatever they are, and shapes that were aligned by it are not equal, but undetermined.
/// @param source, target d×N @param weights N, empty: all 1
/// @throws InputError where no landmark can be aligned
bool is_determined(const Points& source, const Points& target, AlignmentKind kind, const Eigen::VectorXd& weights = {});

/// The same as a condition. @param shape what to call the landmarks in the message, such as the file of the target
/// @throws InputError where the map is undetermined; the message names its kind and the likeliest remedy
void require_determined(const Points& source, const Points& target, AlignmentKind kind, std::string_view shape,
                        const Eigen::VectorXd& weights = {});

/// Of the sum of squared distances from a source to shapes, the part that a similarity of each removes, of those where
/// that is determined. @param source, shapes d×N, NaN where a landmark is missing
double part_of_pose(const Points& source, const std::vector<Landmarks>& shapes);

/// Of that, what makes it worth a note that shapes are taken in the pose that they have.
inline constexpr double kMostlyPose = 0.5;

/// Landmarks that procrustes_mean() places beside the others by the coordinates of one shape, since no shapes that can
/// be aligned with one another have both; from 0.
std::vector<int> placed_as_given(const std::vector<Landmarks>& shapes, AlignmentKind kind);

/// Parameters that are fitted need more coordinates than there are of them; momenta and noise have priors, and need
/// none.
/// @param what as in "the parameters are", @param coordinates observed ones, less alignment_parameters() of each shape
/// @param remedy as in "give fewer parameters" @throws InputError where they are undetermined
void require_determined_parameters(std::string_view what, Eigen::Index parameters, Eigen::Index coordinates,
                                   std::string_view remedy);

}  // namespace pulson
