#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/name_matching.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson {

/// Which landmarks of two shapes correspond: first[i] of one and other[i] of the other, counted from 0.
struct LandmarkPairs {
  std::vector<int> first;
  std::vector<int> other;
};

/// By which landmarks of two shapes correspond: by their names, or in the order of the files, as their user says.
enum class PairBy : unsigned char { kNames, kOrder };

/// Pairs by names, as match_names() does: by labels, or by the numbers of a file that numbers its landmarks. Where
/// neither shape has names, or both have the same in the same order, by order, which requires equal numbers of
/// landmarks. The names of one shape alone pair where they are numbers, which those of the other then have by their
/// order; else as many landmarks pair by order, with a note. Labels that repeat within an outline name nothing.
/// Landmarks of one side only are left out. Adds to `notes`, one line each, how names were matched, that the order
/// differs, and that landmarks are left out, which.
/// @throws InputError where fewer than half of the smaller shape's landmarks, or fewer than two, have a partner, one
/// shape of another number of landmarks has no names, or names do not say which correspond; where pairs by order have
/// different numbers
LandmarkPairs pair_landmarks(const Landmarks& first, const Landmarks& other, std::vector<std::string>& notes,
                             PairBy by = PairBy::kNames);

/// What identifies each landmark: its label, with its outline where labels repeat, or its number in the file; nothing
/// where the shape has neither, or one label for all.
std::vector<std::string> landmark_names(const Landmarks& shape);

/// The place of each landmark of a shape in a list of names, such as that of a table's rows, which is empty where it
/// has none. Notes as pair_landmarks(), and how many of the list are not used. @param what the list is of: "a weight"
/// @throws InputError as pair_landmarks(), and where a landmark is not in the list, with all such
std::vector<int> places_in_list(const Landmarks& shape, const NameList& list, std::size_t count, std::string_view what,
                                std::vector<std::string>& notes, PairBy by = PairBy::kNames);

/// These landmarks of a shape, in this order, and the links among them; those of a part keep their numbers.
Landmarks selected(const Landmarks& shape, const std::vector<int>& landmarks);

/// `other` with the landmarks of `first` in their order and with their names; those that it lacks are missing. Notes
/// and errors as pair_landmarks().
Landmarks in_order_of(const Landmarks& first, const Landmarks& other, std::vector<std::string>& notes,
                      PairBy by = PairBy::kNames);

/// The first few of these landmarks, for a message: `'nose', 'chin', 7, …`.
std::string listed(const Landmarks& shape, const std::vector<int>& landmarks);

/// All of them.
std::string all_listed(const Landmarks& shape, const std::vector<int>& landmarks);

/// Whether a shape of several landmarks was never digitised: they are all at one point, such as (0, 0), or all missing.
bool is_undigitised(const Landmarks& shape);

/// All pairs a < b at the same position, as find_coincident() defines it, in no particular order.
std::vector<std::pair<int, int>> coincident_pairs(const Points& points, double tolerance = 1e-12);

/// Whether landmarks a and b of a shape are at the same position, as find_coincident() defines it, or one of them has a
/// missing coordinate.
bool is_repeated(const Points& points, int a, int b);

/// The shape without landmark `second`, whose links `first` gets, and with `first` at the mean of both; where one has a
/// missing coordinate, at the other. @param weights of both in the mean
Landmarks merged(const Landmarks& shape, int first, int second, const Eigen::Vector2d& weights);

/// The note that both were merged: `a.csv: landmarks 1 and 13 are at the same position in both shapes and are merged`.
/// @param shapes "in both shapes", or empty
std::string merged_note(const Landmarks& shape, int first, int second, const std::string& shapes);

/// The error where they differ in `other`, so that no flow maps `shape` to it.
std::string coincident_error(const Landmarks& shape, int first, int second, const Landmarks& other);

/// `weights`, or `count` ones where it is empty.
/// @throws InputError where their number is another or one is negative or not finite
Eigen::VectorXd landmark_weights(const Eigen::VectorXd& weights, Eigen::Index count);

}  // namespace pulson
