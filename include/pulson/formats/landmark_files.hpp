#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "pulson/core/landmarks.hpp"

namespace pulson::formats {

/// What a landmark file holds. Coordinates are as the file has them: length units, axes and their directions (in tps, y
/// points up) are not changed. A missing coordinate is NaN.
struct LandmarkFile {
  std::string format;                 ///< name of the row of landmark_formats() that read it
  std::vector<Landmarks> shapes;      ///< in the order of the file; a shape may have no landmarks
  std::vector<std::string> warnings;  ///< what the file says and was not used, one line each
  std::string units;                  ///< of length, as the file names them (`mm`), or `voxels`; empty: it does not
  std::string axes;                   ///< where the axes point, as the file says: `LPS`, `RAS`; empty: it does not
};

/// The text of a file, and what of the shapes it could not hold, one line each.
struct WrittenLandmarks {
  std::string text;
  std::vector<std::string> losses;
};

/// One row of the table of formats. A new format is one file that defines `sniff` and `read`, and one row.
struct LandmarkFormat {
  std::string name;
  std::vector<std::string> extensions;  ///< lower case, without the dot; none where only the content identifies it
  std::string help;
  /// Whether a file that holds `text` is of this format.
  bool (*sniff)(std::string_view text);
  /// Reads `text`; `path` is what messages call the file. The rows leave `format` and each shape's `source` to
  /// read_landmark_file. @throws InputError that begins with `path:line:`.
  LandmarkFile (*read)(const std::string& path, std::string_view text);
  /// The shapes in this format, numbers in the fewest digits that read back to the same bits, unless the format says
  /// otherwise; null where it is only read. `path` is what messages call the file. @throws InputError that begins with
  /// `path: ` where the format cannot hold these shapes at all: their number, dimension or missing coordinates
  WrittenLandmarks (*write)(const std::string& path, const LandmarkFile& file) = nullptr;
  /// Whether files may hold numbers as bytes; all others are text in UTF-8 or, where it is not that, in Windows-1252.
  bool holds_bytes = false;
  /// Whether y of its points in the plane counts rows of an image, downwards, or points up; none: files do not say.
  std::optional<bool> y_down{};
  /// Whether its programs place points on pictures as they are displayed, turned by EXIF, or on their stored rows.
  Orientation orientation = Orientation::kStored;
};

/// All formats, in the order in which they are tried.
const std::vector<LandmarkFormat>& landmark_formats();

/// Their names.
std::vector<std::string> landmark_format_names();

/// The format of this name or, where it is empty, the first that can be written and has the extension of `path`.
/// @throws InputError where none can be written
const LandmarkFormat& landmark_format_to_write(const std::filesystem::path& path, std::string_view name = {});

/// How to interpret a landmark file where the file does not say.
struct ReadOptions {
  /// A landmark with a negative coordinate is a missing one: all its coordinates are NaN.
  bool negative_is_missing = false;
  /// The same of a landmark at 0 in all coordinates, as some programs write those that were not digitised.
  bool zero_is_missing = false;
  /// The same of a landmark of which each coordinate is one of these numbers.
  std::vector<double> missing_codes{};
  /// A landmark of which each coordinate is one of these numbers is absent (Landmarks::absent); NaN: so is each that
  /// misses a coordinate, by the file or by a code above.
  std::vector<double> absent_codes{};
  /// A table of absent landmarks, as `FILE` or `FILE:COLUMN,COLUMN`; empty: none. Its first column, or the one named
  /// `specimen`, holds the names of the shapes, each of which needs a row; the other columns, or those named, hold
  /// labels of absent landmarks or their numbers in the file, several with blanks between, or nothing.
  std::string absent_table{};
  /// Name of the row of landmark_formats() that reads it; empty: recognised.
  std::string format{};
  /// The names of columns of a table: `x`, `y`, `z`, `name` (of landmarks), `specimen`, `group` → as the table has it;
  /// those left out are recognised. Files of other formats are read as without.
  std::map<std::string, std::string> columns{};
  /// The number of coordinates per landmark in tables of one column, or whose columns only count the coordinates of a
  /// shape; 0: each number of one column is a landmark on the line.
  int dimension = 0;
  /// The landmarks that are wanted, in this order: numbers in the file (from 1), ranges of them, labels, with commas
  /// between: `1-20,25,tip`; empty: all.
  std::string landmarks{};
  /// How many points of each curve and outline become landmarks after the others, at equal distances along it, in
  /// groups `curve 1`, `outline 1`, …; the others are then in the group `landmarks`. 0: none.
  int curve_points = 0;
  /// Coordinates are multiplied by the scale, which each shape must then have.
  bool applies_scale = false;
  /// A table of the links of all shapes, which those of their files give way to; empty: none. It has two columns: the
  /// labels, else the numbers in the file from 1, of the two landmarks that each row joins. The first row may name the
  /// columns, and a column before them the rows, as R writes them.
  std::string links{};
  /// Frame::y_down of shapes in the plane, in place of what files say.
  std::optional<bool> y_down{};
};

/// All shapes of a file; the path `-` or `/dev/stdin` is standard input, read once. Its format is the first whose
/// `sniff` accepts the content, else the only one with the longest extension that the file's name ends in. Each shape's
/// `name` is its specimen or identifier, else the file's stem; its `source` is `file`, or `file#k` where the file holds
/// several. @throws InputError if the file cannot be read or is malformed.
LandmarkFile read_landmark_file(const std::filesystem::path& path, const ReadOptions& options = {});

/// What read_landmark_file gives for the `file` of an address, with all shapes, or with the one that `file#3` (counted
/// from 1) or `file#id=NAME` names. @throws InputError as read_landmark_file does, and if the address names no shape or
/// several shapes.
LandmarkFile read_addressed_shapes(const std::string& address, const ReadOptions& options = {});

/// The text of all shapes in a format. Where that counts y in the other direction than a shape says, the shape is
/// mirrored in its picture. @throws InputError where the format cannot hold the shapes
WrittenLandmarks text_of_landmarks(const std::filesystem::path& path, LandmarkFile file, const LandmarkFormat& format);

/// Writes text_of_landmarks() by write_file_atomically, in the format that landmark_format_to_write finds.
/// @return what the format could not hold, one line each
/// @throws InputError where there is no such format or it cannot hold the shapes, or if the file cannot be written
std::vector<std::string> write_landmark_file(const std::filesystem::path& path, const LandmarkFile& file,
                                             std::string_view format = {});

/// One shape by its address: `file`, `file#3` (counted from 1) or `file#id=NAME`; plain `file` where it holds just one.
/// The file's warnings are appended to `warnings`. @throws InputError as read_landmark_file does, and if the address
/// names no shape, several shapes, or one without landmarks.
Landmarks read_landmarks(const std::string& address, std::vector<std::string>* warnings = nullptr,
                         const ReadOptions& options = {});

/// The csv text of a shape: header and columns `[label,]x[,y[,z]][,group]`, numbers in the fewest digits that read back
/// to the same bits, missing ones as NA; before them `# frame: …` where it is not that of rows of an image. The row
/// `csv` of landmark_formats() writes this for one shape and for several the columns
/// `specimen,[landmark,]x[,y[,z]][,group]`.
std::string landmarks_csv(const Landmarks& shape);

/// Writes landmarks_csv(shape) by write_file_atomically. @throws InputError if the file cannot be written.
void write_landmarks_csv(const std::filesystem::path& path, const Landmarks& shape);

// Tables with a row for each landmark of a shape. The first line may name the columns; blank lines and comments ('#')
// are skipped. Fields are separated by the first of ; , tab that the first line has, else by blanks. A column `label`,
// `landmark` and the like, or a first column of words, names the landmarks: rows then belong to them by names, in any
// order, and those of no landmark are counted in `notes`. Rows belong by order where neither the table nor the shape
// has names, or `by_order` says so. @throws InputError that names file and line, or the landmarks without a row

/// The weights of landmarks, one in each row: finite numbers, 0 or greater.
Eigen::VectorXd read_weights(const std::filesystem::path& path, const Landmarks& shape,
                             std::vector<std::string>* notes = nullptr, bool by_order = false);

/// The covariances of landmarks in d dimensions, d×d each, length units squared. A row holds 1 number (the variance of
/// each coordinate), d (the variances of the axes), d(d+1)/2 (the upper triangle by rows) or d² (all by rows).
/// @throws InputError also where one is not symmetric and positive definite
std::vector<Eigen::MatrixXd> read_covariances(const std::filesystem::path& path, const Landmarks& shape,
                                              std::vector<std::string>* notes = nullptr, bool by_order = false);

/// Numbers in numpy's format, version 1.0: doubles in C order, to be read by `numpy.load`. The product of `shape` is
/// the count of the numbers.
std::string npy_bytes(std::span<const double> numbers, const std::vector<std::size_t>& shape);

/// Writes npy_bytes by write_file_atomically. @throws InputError if the file cannot be written
void write_npy(const std::filesystem::path& path, std::span<const double> numbers,
               const std::vector<std::size_t>& shape);

}  // namespace pulson::formats
