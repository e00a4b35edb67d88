#pragma once

#include <string>
#include <vector>

#include "pulson/formats/landmark_files.hpp"

namespace pulson {

/// All shapes of these addresses, in their order. @throws InputError as read_addressed_shapes() does
std::vector<Landmarks> read_shapes(const std::vector<std::string>& addresses, const formats::ReadOptions& options,
                                   std::vector<std::string>& notes);

/// Puts the landmarks of each shape in the order of those of `first`, in its axes and unit of length: in_order_of() and
/// in_frame_of(), with the notes of one shape and how many others have some. @throws InputError as these do
void put_in_order_of(const Landmarks& first, std::vector<Landmarks>& shapes, std::vector<std::string>& notes);

/// The notes of one shape of many, and how many others have some.
class CohortNotes {
 public:
  void add(std::vector<std::string> notes);
  /// A line each.
  std::vector<std::string> lines() &&;

 private:
  std::vector<std::string> first_;
  int others_ = 0;
};

/// A name for each shape that a folder may have, all different: its own with other characters than letters, digits and
/// "._-" as "_", with a number behind it where several have it or it is in `taken`; its number from 1 where it has
/// none.
std::vector<std::string> folder_names(const std::vector<Landmarks>& shapes, const std::vector<std::string>& taken);

}  // namespace pulson
