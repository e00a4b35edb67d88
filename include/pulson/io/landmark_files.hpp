#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// What a landmark file holds. Coordinates are as the file has them: length units, axes and their directions (in tps, y
/// points up) are not changed. A missing coordinate is NaN.
struct LandmarkFile {
  std::string format;                 ///< name of the row of landmark_formats() that read it
  std::vector<Landmarks> shapes;      ///< in the order of the file; a shape may have no landmarks
  std::vector<std::string> warnings;  ///< what the file says and was not used, one line each
};

/// One row of the table of formats. A new format is one file that defines `sniff` and `read`, and one row.
struct LandmarkFormat {
  std::string name;
  std::vector<std::string> extensions;  ///< lower case, without the dot
  std::string help;
  /// Whether a file that holds `text` is of this format.
  bool (*sniff)(std::string_view text);
  /// Reads `text`; `path` is what messages call the file. The rows leave `format` and each shape's `source` to
  /// read_landmark_file. @throws InputError that begins with `path:line:`.
  LandmarkFile (*read)(const std::string& path, std::string_view text);
};

/// All formats, in the order in which they are tried.
const std::vector<LandmarkFormat>& landmark_formats();

/// All shapes of a file. Its format is the first whose `sniff` accepts the content, else the one that has the
/// extension. Each shape's `name` is its specimen or identifier, else the file's stem; its `source` is `file`, or
/// `file#k` where the file holds several. @throws InputError if the file cannot be read or is malformed.
LandmarkFile read_landmark_file(const std::filesystem::path& path);

/// One shape by its address: `file`, `file#3` (counted from 1) or `file#id=NAME`; plain `file` where it holds just one.
/// The file's warnings are appended to `warnings`. @throws InputError as read_landmark_file does, and if the address
/// names no shape, several shapes, or one without landmarks.
Landmarks read_landmarks(const std::string& address, std::vector<std::string>* warnings = nullptr);

/// The csv text of a shape: header and columns `[label,]x[,y[,z]][,group]`, numbers in the fewest digits that read back
/// to the same bits.
std::string landmarks_csv(const Landmarks& shape);

/// Writes landmarks_csv(shape) by write_file_atomically. @throws InputError if the file cannot be written.
void write_landmarks_csv(const std::filesystem::path& path, const Landmarks& shape);

}  // namespace pulson
