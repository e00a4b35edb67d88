#pragma once

// Files whose points move while all else stays as it is, byte for byte: tables with any columns, and meshes.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {

/// How a number stands in a file.
enum class NumberCoding : std::uint8_t {
  kText,         ///< in the fewest digits that read back to the same double
  kTextOfFloat,  ///< the same of a float
  kFloat,        ///< four bytes, the lowest first
  kDouble,
  kBigFloat,  ///< the highest first
  kBigDouble
};

/// A number of a file, or a part that is left out.
struct NumberPlace {
  std::size_t begin;
  std::uint32_t length : 24;
  NumberCoding coding : 8;
  std::uint32_t value;  ///< which coordinate of all points; with kNormal added, of all normals; or kNoValue
  static constexpr std::uint32_t kNormal = 0x80000000;
  static constexpr std::uint32_t kNoValue = 0xFFFFFFFF;
  static constexpr std::uint32_t kLongest = 0xFFFFFF;
};

/// The text of a file, and where its points stand in it.
class CarriedFile {
 public:
  explicit CarriedFile(std::string text) : text_(std::move(text)) {}
  CarriedFile(const CarriedFile&) = delete;
  virtual ~CarriedFile() = default;

  Landmarks shape;                   ///< all points, with axes, units and frame of the file
  Points normals{};                  ///< 3×M unit vectors
  std::vector<int> normal_points{};  ///< which point each of them belongs to
  std::vector<std::string> notes{};  ///< what is left out, one line each

  /// The file with other points and normals, of the sizes of those above. @throws InputError where it cannot hold them
  virtual std::string with(const Points& points, const Points& new_normals) const;

  /// Makes points in space whose z are all the same points of the plane, which keep their z and their normals.
  void take_plane();

  /// The places become those of points in the plane: z and normals stay.
  virtual void keep_z();

  const std::string& text() const { return text_; }

  // ---- for those who find the points

  /// Places come in the order of the file. @throws InputError where a number is longer than any is
  void add_place(std::size_t begin, std::size_t length, std::uint32_t value, NumberCoding coding = NumberCoding::kText);
  /// Leaves a part of the file out.
  void leave_out(std::size_t begin, std::size_t end);
  void sort_places();
  /// What a missing coordinate is in text.
  void set_missing_mark(std::string mark) { missing_mark_ = std::move(mark); }
  /// @param are_between_commas whether a number needs quotes for its comma
  void use_decimal_commas(bool are_between_commas);

 protected:
  /// `source`, of which the places are parts, with new numbers.
  std::string replaced(std::string_view source, const Points& points, const Points& new_normals) const;

 private:
  void append(std::string& out, std::string_view source, const NumberPlace& place, double value) const;
  void append_text(std::string& out, std::string_view source, const NumberPlace& place, double value) const;

  std::string text_;
  std::vector<NumberPlace> places_;
  std::string missing_mark_ = "NA";
  bool has_decimal_commas_ = false;
  bool quotes_decimal_commas_ = false;
};

/// The file at the path, with points in `dimension` dimensions: ply, obj, stl, vtk and vtp meshes by their extension,
/// else tables with a point, or the landmarks of a shape, in each row. Null for files of other kinds, and where the
/// options choose or add points. @throws InputError if it cannot be read or is malformed
std::unique_ptr<CarriedFile> read_carried_file(const std::filesystem::path& path, const ReadOptions& options,
                                               int dimension);

/// The same where `text` is all that the file holds; `path` is what messages call it.
std::unique_ptr<CarriedFile> carry(const std::string& path, std::string text, const ReadOptions& options,
                                   int dimension);

/// The number that these bytes are. @param coding none of text
double number_of_bytes(const char* bytes, NumberCoding coding);

/// Whether the file is a mesh by its extension.
bool is_mesh_file(const std::filesystem::path& path);

// The kinds. `path` is what messages call the file.

std::unique_ptr<CarriedFile> carry_ply(const std::string& path, std::string text);
std::unique_ptr<CarriedFile> carry_obj(const std::string& path, std::string text);
std::unique_ptr<CarriedFile> carry_stl(const std::string& path, std::string text);
std::unique_ptr<CarriedFile> carry_vtk(const std::string& path, std::string text);
std::unique_ptr<CarriedFile> carry_vtp(const std::string& path, std::string text);

/// Null where the rows do not hold points: lines of all x and all y, a coordinate per line.
std::unique_ptr<CarriedFile> carry_table(const std::string& path, std::string text, const ReadOptions& options);

/// Of DeepLabCut's tables.
std::unique_ptr<CarriedFile> carry_deeplabcut(const std::string& path, std::string text, const ReadOptions& options);

/// Of 3D Slicer's point lists.
std::unique_ptr<CarriedFile> carry_fcsv(const std::string& path, std::string text, const ReadOptions& options);

}  // namespace pulson::formats
