// VTK legacy polydata: points and their normals change.

#include <array>
#include <cmath>

#include <fmt/format.h>

#include "carried_file.hpp"
#include "core/text.hpp"
#include "formats/slicer_vtk/vtk_numbers.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

/// What begins a block of POINT_DATA or CELL_DATA with a name, a type and `components` numbers for each point or cell.
struct VtkAttribute {
  std::string_view keyword;
  std::size_t components;
};

constexpr std::array<VtkAttribute, 7> kAttributes = {{{"vectors", 3},
                                                      {"normals", 3},
                                                      {"tensors", 9},
                                                      {"tensors6", 6},
                                                      {"global_ids", 1},
                                                      {"pedigree_ids", 1},
                                                      {"edge_flags", 1}}};

class VtkPlaces {
 public:
  VtkPlaces(const std::string& path, CarriedFile& file) : cursor_(path, file.text()), file_(file) {}

  void read() {
    file_.shape.axes = take_vtk_header(cursor_);
    file_.shape.points.resize(3, 0);
    while (read_section()) {
    }
    if (!has_points_) throw InputError(cursor_.path() + " has no section POINTS");
  }

 private:
  /// @return false at the end
  bool read_section() {
    const std::string_view word = cursor_.take_word();
    const std::string keyword = text::to_lower(word);
    const VtkPlace begin = cursor_.place();
    if (keyword.empty()) return false;
    if (keyword == "points") {
      read_points(word);
    } else if (keyword == "vertices" || keyword == "lines" || keyword == "polygons" || keyword == "triangle_strips") {
      take_vtk_cells(cursor_, word);
    } else if (keyword == "field") {
      skip_vtk_field(cursor_);
    } else if (keyword == "metadata") {
      skip_vtk_metadata(cursor_);
      if (follows_points_) file_.leave_out(begin.byte, cursor_.here().byte);  // the range of the coordinates
    } else if (keyword == "point_data" || keyword == "cell_data") {
      is_of_points_ = keyword == "point_data";
      count_ = take_vtk_count(cursor_, word);
      if (is_of_points_ && count_ != static_cast<std::size_t>(file_.shape.count()))
        cursor_.fail_here(fmt::format("POINT_DATA of {} for {}", count_,
                                      text::counted(static_cast<std::size_t>(file_.shape.count()), "point")));
    } else if (!read_attribute(keyword, begin)) {
      file_.notes.push_back(fmt::format("{}: what follows {} is kept as it is, with normals if there are any",
                                        cursor_.path(), text::in_quotes(word)));
      return false;
    }
    follows_points_ = keyword == "points";
    return true;
  }

  /// @return false where the keyword is unknown
  bool read_attribute(const std::string& keyword, VtkPlace begin) {
    if (keyword == "scalars") return read_scalars();
    if (keyword == "color_scalars" || keyword == "lookup_table") return read_colours(keyword);
    const std::string_view name = cursor_.take_word();
    if (keyword == "texture_coordinates") {
      const std::size_t components = take_vtk_count(cursor_, name);
      skip_numbers(name, take_vtk_type(cursor_, name), components);
      return true;
    }
    for (const VtkAttribute& attribute : kAttributes) {
      if (attribute.keyword != keyword) continue;
      const VtkType& type = take_vtk_type(cursor_, name);
      if (keyword == "normals" && is_of_points_)
        read_normals(name, type);
      else
        skip_numbers(name, type, attribute.components);
      if (keyword == "normals" && !is_of_points_) leave_out_cell_normals(begin);
      return true;
    }
    return false;
  }

  /// `name type [components]` on a line, then LOOKUP_TABLE.
  bool read_scalars() {
    const std::string_view name = cursor_.take_word();
    const VtkType& type = take_vtk_type(cursor_, name);
    std::size_t components = 1;
    if (!cursor_.is_next("lookup_table")) components = take_vtk_count(cursor_, name);
    if (cursor_.is_next("lookup_table")) {
      cursor_.take_word();
      cursor_.take_word();
    }
    skip_numbers(name, type, components);
    return true;
  }

  /// A colour for each point or cell, or a table of them: numbers in text, bytes in binary files.
  bool read_colours(const std::string& keyword) {
    const std::string_view name = cursor_.take_word();
    const std::size_t size = take_vtk_count(cursor_, name);
    const bool is_table = keyword == "lookup_table";
    const VtkType& type = vtk_byte();
    VtkBlock block{cursor_.place(), fmt::format("{} {}", keyword, name)};
    skip(block, type, is_table ? size : count_, is_table ? 4 : size);
    return true;
  }

  void skip_numbers(std::string_view name, const VtkType& type, std::size_t components) {
    skip({cursor_.place(), std::string(name)}, type, count_, components);
  }

  void skip(const VtkBlock& block, const VtkType& type, std::size_t count, std::size_t each) {
    if (each == 0) cursor_.fail_at(block.place, text::in_quotes(block.text) + " has no components");
    begin_vtk_numbers(cursor_, block, type, count, each);
    if (cursor_.is_binary) cursor_.take_bytes(count * each * type.size);
    for (std::size_t i = 0; i < count * each && !cursor_.is_binary; ++i)
      take_vtk_number(cursor_, block, count * each, i);
  }

  void read_points(std::string_view keyword) {
    if (has_points_) cursor_.fail_here("a second section POINTS");
    has_points_ = true;
    VtkBlock block{cursor_.place(), ""};
    count_ = take_vtk_count(cursor_, keyword);
    const VtkType& type = take_vtk_type(cursor_, keyword);
    block.text = fmt::format("{} {} {}", keyword, count_, type.name);
    file_.shape.points = triples(block, type, 0);
  }

  void read_normals(std::string_view name, const VtkType& type) {
    const VtkBlock block{cursor_.place(), fmt::format("NORMALS {} {}", name, type.name)};
    if (file_.normals.cols() > 0) cursor_.fail_here("a second section NORMALS");
    file_.normals = triples(block, type, NumberPlace::kNormal);
    for (int i = 0; i < file_.shape.count(); ++i) file_.normal_points.push_back(i);
  }

  void leave_out_cell_normals(VtkPlace begin) {
    const std::size_t end = cursor_.here().byte;
    file_.leave_out(begin.byte, end);
    file_.notes.push_back(cursor_.path() + ": the normals of its cells are left out, which programs make from these");
  }

  NumberCoding coding_of(const VtkBlock& block, const VtkType& type) const {
    if (type.name != "float" && type.name != "double")
      cursor_.fail_at(block.place,
                      fmt::format("{} holds whole numbers alone; save it with float", text::in_quotes(block.text)));
    const bool is_float = type.name == "float";
    if (cursor_.is_binary) return is_float ? NumberCoding::kBigFloat : NumberCoding::kBigDouble;
    return is_float ? NumberCoding::kTextOfFloat : NumberCoding::kText;
  }

  /// The numbers of `count_` points, whose places have values from `first` on.
  Points triples(const VtkBlock& block, const VtkType& type, std::uint32_t first) {
    const NumberCoding coding = coding_of(block, type);
    begin_vtk_numbers(cursor_, block, type, count_, 3);
    Points numbers(3, static_cast<Eigen::Index>(count_));
    for (std::size_t i = 0; i < 3 * count_; ++i) {
      std::size_t length = type.size;
      VtkPlace place = cursor_.here();
      double& number = numbers.data()[i];
      if (cursor_.is_binary) {
        number = type.number(cursor_.take_bytes(length));
      } else {
        const std::string_view word = take_vtk_number(cursor_, block, 3 * count_, i);
        place = cursor_.place();
        length = word.size();
        number = text::parse_coordinate(word, {cursor_.path(), place.line, std::to_string(i / 3 + 1), "", i % 3});
      }
      if (std::isinf(number)) cursor_.fail_at(place, "a coordinate is infinite");
      file_.add_place(place.byte, length, first + static_cast<std::uint32_t>(i), coding);
    }
    return numbers;
  }

  VtkCursor cursor_;
  CarriedFile& file_;
  std::size_t count_ = 0;  // of points, or of those or cells that data are of
  bool has_points_ = false;
  bool follows_points_ = false;
  bool is_of_points_ = false;
};

}  // namespace

std::unique_ptr<CarriedFile> carry_vtk(const std::string& path, std::string text) {
  auto file = std::make_unique<CarriedFile>(std::move(text));
  VtkPlaces(path, *file).read();
  file->set_missing_mark("nan");
  return file;
}

}  // namespace pulson::formats
