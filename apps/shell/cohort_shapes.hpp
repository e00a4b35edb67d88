#pragma once

#include <string>
#include <vector>

#include "pulson/formats/landmark_files.hpp"

namespace pulson {

/// All shapes of these addresses, in their order. @throws InputError as read_addressed_shapes() does
std::vector<Landmarks> read_shapes(const std::vector<std::string>& addresses, const formats::ReadOptions& options,
                                   std::vector<std::string>& notes);

/// Takes out shapes that were never digitised, as is_undigitised() says, and prints a warning that names them all.
void leave_out_undigitised(std::vector<Landmarks>& shapes);

/// @throws InputError where the shape was never digitised
void require_digitised(const Landmarks& shape);

/// Puts the landmarks of each shape in the order of those of `first`, in its axes and unit of length: in_order_of() and
/// in_frame_of(), with the notes of one shape and how many others have some. @throws InputError as these do
void put_in_order_of(const Landmarks& first, std::vector<Landmarks>& shapes, bool by_order,
                     std::vector<std::string>& notes);

/// What a format needs before its text is made: all but json count y of all shapes in one direction, that of the
/// format, else that of the first shape. `notes` get a line on each shape that is turned. @throws InputError as
/// in_frame_of()
void prepare_to_write(const formats::LandmarkFormat& format, formats::LandmarkFile& file,
                      std::vector<std::string>& notes);

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

/// A note where shapes have the same name, which tables then cannot tell apart by it.
std::vector<std::string> notes_of_names(const std::vector<Landmarks>& shapes);

/// A name for each shape that a folder may have on any system, all different whatever the case of their letters: its
/// own, at most 100 bytes, with other characters than letters, digits and "._-" as "_", and "_" for what begins or ends
/// it wrongly and before a name that Windows reserves, with a number behind it where several have it or it is in
/// `taken`; its number from 1 where it has none.
std::vector<std::string> folder_names(const std::vector<Landmarks>& shapes, const std::vector<std::string>& taken);

}  // namespace pulson
