#pragma once

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

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

/// These landmarks of a shape, in this order, and the links among them; those of a part keep their numbers.
Landmarks selected(const Landmarks& shape, const std::vector<int>& landmarks);

/// `other` with the landmarks of `first` in their order; those that it lacks are missing. Notes and
/// errors as pair_landmarks().
Landmarks in_order_of(const Landmarks& first, const Landmarks& other, std::vector<std::string>& notes);

/// Calls change(points) for the landmarks of a shape, and for each of the curves and outlines beside them.
template <class Change>
void change_points(Landmarks& shape, const Change& change) {
  change(shape.points);
  for (Points& curve : shape.curves) change(curve);
  for (Points& outline : shape.outlines) change(outline);
}

/// The first few of these landmarks, for a message: `'nose', 'chin', 7, …`.
std::string listed(const Landmarks& shape, const std::vector<int>& landmarks);

/// All pairs a < b at the same position, as find_coincident() defines it, in no particular order.
std::vector<std::pair<int, int>> coincident_pairs(const Points& points, double tolerance = 1e-12);

/// Whether landmarks a and b of a shape are at the same position, as find_coincident() defines it, or one of them has a
/// missing coordinate.
bool is_repeated(const Points& points, int a, int b);

/// The shape without landmark `second`, whose links `first` gets, and with `first` at the mean of both; where one has a missing coordinate, at
/// the other. @param weights of both in the mean
Landmarks merged(const Landmarks& shape, int first, int second, const Eigen::Vector2d& weights);

/// The note that both were merged: `a.csv: landmarks 1 and 13 are at the same position in both shapes and are merged`.
/// @param shapes "in both shapes", or empty
std::string merged_note(const Landmarks& shape, int first, int second, const std::string& shapes);

/// The error where they differ in `other`, so that no flow maps `shape` to it.
std::string coincident_error(const Landmarks& shape, int first, int second, const Landmarks& other);

/// `shape` in the axes and the unit of length of `frame`, where both files say theirs: LPS and RAS differ by the signs
/// of x and y, mm, um, cm and m by a factor. Adds a line to `notes` where that changes the coordinates.
/// @throws InputError if the units are incompatible, such as voxels and mm
Landmarks in_frame_of(const Landmarks& frame, const Landmarks& shape, std::vector<std::string>& notes);

/// `weights`, or `count` ones where it is empty.
/// @throws InputError where their number is another or one is negative or not finite
Eigen::VectorXd landmark_weights(const Eigen::VectorXd& weights, Eigen::Index count);

}  // namespace pulson
