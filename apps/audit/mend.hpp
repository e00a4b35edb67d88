#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "judge.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson {

/// A landmark file that was read, and the places of its shapes among all.
struct AuditedFile {
  std::string address;
  formats::LandmarkFile contents;
  std::size_t first = 0;
};

/// All shapes of the files, in their order.
std::vector<Landmarks> shapes_of(const std::vector<AuditedFile>& files);

/// Files with mended shapes, where --fix says they are to be.
class MendedFiles {
 public:
  /// Of one file that is judged `fix` is the copy; else it is a folder, for copies of the same names. In the format of
  /// the copy's extension.
  /// @throws InputError where a copy cannot be written, or would replace an input
  MendedFiles(const std::string& fix, const std::vector<AuditedFile>& files, const AuditResults& results);

  /// Makes the texts. `notes` get what formats cannot hold. @throws InputError where a format cannot hold the shapes
  void mend(std::vector<AuditedFile> files, const AuditResults& results, std::vector<std::string>& notes);

  void write() const;

  /// A line for each finding, mended or not, and for each file.
  void print(const AuditResults& results) const;

 private:
  struct Copy {
    std::size_t file;  ///< of which
    std::filesystem::path path;
    std::string format, text;
    std::size_t shapes = 0;
  };
  std::vector<Copy> copies_;
};

/// A shape as it was given, without what was found to be wrong. Positions that only belong to other landmarks keep all
/// of their digits.
/// @param corrected the positions of the landmarks of `judged` @throws InputError where a landmark that the shape lacks
/// would get a position
Points mended_points(const Landmarks& given, const JudgedShape& judged, const Points& corrected);

}  // namespace pulson
