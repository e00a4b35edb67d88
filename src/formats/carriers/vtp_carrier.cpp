// VTK's XML polydata: points and their normals change.

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "carried_file.hpp"
#include "core/text.hpp"
#include "formats/text/text_lines.hpp"
#include "pulson/core/errors.hpp"
#include "vtp_blocks.hpp"

namespace pulson::formats {
namespace {

/// `<DataArray type="Float32" …>`, from its `<` on, or `</DataArray>`.
struct XmlTag {
  std::size_t begin = 0;
  std::size_t end = 0;  ///< behind the `>`
  std::string_view name{};
  std::map<std::string_view, std::string_view> attributes{};
  bool is_closing = false;
  bool is_alone = false;  ///< `<…/>`

  std::string_view value(std::string_view attribute) const {
    const auto found = attributes.find(attribute);
    return found == attributes.end() ? std::string_view() : found->second;
  }
};

constexpr std::string_view kXmlBlanks = " \t\r\n";

/// An array of points or normals, whose numbers are those of a file of their own: text, or the bytes of a block.
struct VtpArray {
  std::size_t begin = 0;  ///< of the numbers in the file
  std::size_t end = 0;
  std::unique_ptr<CarriedFile> numbers{};
  std::optional<VtpBlock> block{};
  VtpEncoding encoding{};
  std::optional<std::size_t> offset{};  ///< among the appended blocks
};

class VtpFile : public CarriedFile {
 public:
  VtpFile(std::string path, std::string given) : CarriedFile(std::move(given)), path_(std::move(path)) {}

  void read() {
    find_appended();
    std::size_t at = 0;
    while (const std::optional<XmlTag> tag = next_tag(at)) {
      if (tag->name == "AppendedData") break;
      enter(*tag);
      at = tag->end;
    }
    shape.points = text::points_from(coordinates_, 3);
    normals = text::points_from(normals_, 3);
    shape.axes = {};
    if (normals.cols() != shape.points.cols() && normals.cols() > 0)
      refuse(fmt::format("{} for {}", text::counted(static_cast<std::size_t>(normals.cols()), "normal"),
                         text::counted(static_cast<std::size_t>(shape.count()), "point")));
    for (int i = 0; i < normals.cols(); ++i) normal_points.push_back(i);
  }

  std::string with(const Points& points, const Points& new_normals) const override {
    std::map<std::size_t, std::pair<std::size_t, std::string>> changes;  // begin → end, text
    std::map<std::size_t, std::ptrdiff_t> growth;                        // of blocks, by their offsets
    for (const VtpArray& array : arrays_) {
      std::string text_of_array = array.numbers->with(points, new_normals);
      if (array.block) text_of_array = vtp_block_text(*array.block, text_of_array, array.encoding);
      if (array.offset)
        growth[*array.offset] = std::ssize(text_of_array) - static_cast<std::ptrdiff_t>(array.end - array.begin);
      changes[array.begin] = {array.end, std::move(text_of_array)};
    }
    for (const auto& [begin, end] : left_out_) changes[begin] = {end, ""};
    for (const auto& [place, offset] : offsets_) {
      std::ptrdiff_t moved = 0;
      for (const auto& [other, by] : growth)
        if (other < offset) moved += by;
      if (moved != 0)
        changes[static_cast<std::size_t>(place.data() - text().data())] = {
            static_cast<std::size_t>(place.data() - text().data()) + place.size(),
            std::to_string(static_cast<std::ptrdiff_t>(offset) + moved)};
    }
    std::string out;
    std::size_t at = 0;
    for (const auto& [begin, change] : changes) {
      if (begin < at) refuse("its arrays overlap");
      out.append(text(), at, begin - at);
      out += change.second;
      at = change.first;
    }
    return out.append(text(), at);
  }

  void keep_z() override {
    for (const VtpArray& array : arrays_) array.numbers->keep_z();
  }

 private:
  [[noreturn]] void refuse(const std::string& reason) const { throw InputError(path_ + ": " + reason); }

  std::optional<XmlTag> next_tag(std::size_t at) const {
    const std::string_view all = text();
    while ((at = all.find('<', at)) != std::string_view::npos) {
      if (!all.substr(at).starts_with("<!--")) break;
      at = all.find("-->", at);
      if (at == std::string_view::npos) refuse("a comment is not closed");
    }
    if (at == std::string_view::npos) return std::nullopt;
    XmlTag tag{.begin = at, .end = all.find('>', at)};
    if (tag.end == std::string_view::npos) refuse("a tag is not closed");
    std::string_view inner = all.substr(at + 1, tag.end++ - at - 1);
    tag.is_closing = inner.starts_with('/');
    tag.is_alone = inner.ends_with('/');
    if (tag.is_closing) inner.remove_prefix(1);
    tag.name = inner.substr(0, inner.find_first_of(" \t\r\n/"));
    inner.remove_prefix(tag.name.size());
    add_attributes(inner, tag);
    return tag;
  }

  static void add_attributes(std::string_view inner, XmlTag& tag) {
    while (true) {
      inner.remove_prefix(std::min(inner.find_first_not_of(kXmlBlanks), inner.size()));
      const std::size_t equals = inner.find('=');
      if (equals == std::string_view::npos) return;
      const std::string_view name = inner.substr(0, std::min(inner.find_first_of(kXmlBlanks), equals));
      const std::size_t quote = inner.find_first_of("\"'", equals);
      if (quote == std::string_view::npos) return;
      const std::size_t end = inner.find(inner[quote], quote + 1);
      if (end == std::string_view::npos) return;
      tag.attributes[name] = inner.substr(quote + 1, end - quote - 1);
      inner.remove_prefix(end + 1);
    }
  }

  /// `_` before the first appended block.
  void find_appended() {
    const std::size_t begin = text().find("<AppendedData");
    if (begin == std::string::npos) return;
    const std::optional<XmlTag> tag = next_tag(begin);
    const std::size_t mark = text().find('_', tag->end);
    if (mark == std::string::npos) refuse("its appended data do not begin with '_'");
    appended_ = mark + 1;
    appended_as_base64_ = tag->value("encoding") == "base64";
  }

  void enter(const XmlTag& tag) {
    if (tag.name == "VTKFile") return read_head(tag);
    if (tag.name == "DataArray" && !tag.is_closing) return read_array(tag);
    if (tag.name == "Points" || tag.name == "PointData" || tag.name == "CellData" || tag.name == "FieldData" ||
        tag.name == "Verts" || tag.name == "Lines" || tag.name == "Strips" || tag.name == "Polys")
      section_ = tag.is_closing || tag.is_alone ? XmlTag{} : tag;
    if (tag.name == "CellData" && !tag.is_closing) leave_out_attribute(tag, "Normals");
  }

  void read_head(const XmlTag& tag) {
    if (tag.is_closing) return;
    if (tag.value("type") != "PolyData")
      refuse(fmt::format("it holds {}; only PolyData is read", text::in_quotes(tag.value("type"))));
    encoding_.is_big = tag.value("byte_order") == "BigEndian";
    encoding_.header_size = tag.value("header_type") == "UInt64" ? 8 : 4;
    const std::string_view compressor = tag.value("compressor");
    encoding_.is_compressed = !compressor.empty();
    if (encoding_.is_compressed && compressor != "vtkZLibDataCompressor")
      refuse(fmt::format("it is compressed by {}; save it without compression", text::in_quotes(compressor)));
  }

  bool is_normals(const XmlTag& tag) const {
    const std::string_view name = tag.value("Name");
    return tag.value("NumberOfComponents") == "3" &&
           (text::to_lower(name) == "normals" || (!name.empty() && name == section_.value("Normals")));
  }

  void read_array(const XmlTag& tag) {
    note_offset(tag);
    if (section_.name == "Points") {
      take_array(tag, coordinates_, 0);
      leave_out_attribute(tag, "RangeMin");
      leave_out_attribute(tag, "RangeMax");
    } else if (section_.name == "PointData" && is_normals(tag)) {
      take_array(tag, normals_, NumberPlace::kNormal);
    } else if (section_.name == "CellData" && is_normals(tag)) {
      left_out_.emplace_back(tag.begin, end_of_element(tag));
      notes.push_back(path_ + ": the normals of its cells are left out, which programs make from these");
    }
  }

  std::size_t end_of_element(const XmlTag& tag) const {
    if (tag.is_alone) return tag.end;
    constexpr std::string_view kEnd = "</DataArray>";
    const std::size_t end = text().find(kEnd, tag.end);
    if (end == std::string::npos) refuse("a DataArray is not closed");
    return end + kEnd.size();
  }

  void note_offset(const XmlTag& tag) {
    const std::string_view value = tag.value("offset");
    if (tag.value("format") != "appended") return;
    const std::optional<std::size_t> offset = parse_count(value);
    if (!offset || *offset > text().size()) refuse(fmt::format("the offset of an array is {}", text::in_quotes(value)));
    offsets_.emplace_back(value, *offset);
  }

  /// With the blank before it.
  void leave_out_attribute(const XmlTag& tag, std::string_view name) {
    const std::string_view value = tag.value(name);
    if (value.data() == nullptr) return;
    const auto end = static_cast<std::size_t>(value.data() - text().data()) + value.size() + 1;
    const std::size_t begin = text().rfind(name, end - value.size() - 1);
    left_out_.emplace_back(begin - 1, end);
  }

  void take_array(const XmlTag& tag, std::vector<double>& numbers, std::uint32_t kind) {
    if (tag.value("NumberOfComponents") != "3") refuse("an array of points or normals has no 3 components");
    const bool is_float = tag.value("type") == "Float32";
    if (!is_float && tag.value("type") != "Float64")
      refuse(fmt::format("its coordinates are of the type {}; save it with Float32 or Float64",
                         text::in_quotes(tag.value("type"))));
    VtpArray& array = arrays_.emplace_back();
    array.encoding = encoding_;
    const std::string_view format = tag.value("format");
    if (format == "appended") {
      if (!appended_) refuse("it has no AppendedData");
      array.encoding.is_base64 = appended_as_base64_;
      array.offset = offsets_.back().second;
      array.begin = *appended_ + *array.offset;
    } else {
      take_content(tag, array);
    }
    const auto first = static_cast<std::uint32_t>(numbers.size()) | kind;
    if (format != "ascii") {
      array.block = read_vtp_block(path_, text(), array.begin, array.encoding);
      array.end = array.block->end;
      take_bytes(array, is_float, first, numbers);
    } else {
      take_words(array, is_float, first, numbers);
    }
    leave_out_ranges(tag);
  }

  /// The text between the tags and the elements within.
  void take_content(const XmlTag& tag, VtpArray& array) const {
    const std::size_t end = end_of_element(tag);
    std::size_t at = tag.end;
    while (true) {
      at = std::min(text().find_first_not_of(kXmlBlanks, at), end);
      if (at == end || text()[at] != '<' || text()[at + 1] == '/') break;
      at = text().find("</InformationKey>", at);
      if (at >= end) refuse("an element within a DataArray is unknown");
      at = text().find('>', at) + 1;
    }
    array.begin = at;
    array.end = std::min(text().find('<', at), end);
    while (array.end > array.begin && kXmlBlanks.find(text()[array.end - 1]) != std::string_view::npos) --array.end;
  }

  /// What an array knows of the range of its numbers, which change.
  void leave_out_ranges(const XmlTag& tag) {
    const std::size_t end = tag.is_alone ? tag.end : end_of_element(tag);
    constexpr std::string_view kEnd = "</InformationKey>";
    for (std::size_t at = tag.end; (at = text().find("<InformationKey", at)) < end;) {
      const std::size_t closed = text().find(kEnd, at);
      if (closed >= end) return;
      left_out_.emplace_back(at, closed + kEnd.size());
      at = closed;
    }
  }

  void take_bytes(VtpArray& array, bool is_float, std::uint32_t first, std::vector<double>& numbers) const {
    array.numbers = std::make_unique<CarriedFile>(std::exchange(array.block->bytes, {}));
    const std::string& bytes = array.numbers->text();
    const std::size_t size = is_float ? sizeof(float) : sizeof(double);
    if (bytes.size() % (3 * size) != 0) refuse("a block of points or normals has a part of one");
    const NumberCoding coding = encoding_.is_big ? (is_float ? NumberCoding::kBigFloat : NumberCoding::kBigDouble)
                                                 : (is_float ? NumberCoding::kFloat : NumberCoding::kDouble);
    for (std::size_t i = 0; i < bytes.size() / size; ++i) {
      numbers.push_back(number_of_bytes(bytes.data() + i * size, coding));
      if (std::isinf(numbers.back())) refuse("a coordinate is infinite");
      array.numbers->add_place(i * size, size, first + static_cast<std::uint32_t>(i), coding);
    }
  }

  void take_words(VtpArray& array, bool is_float, std::uint32_t first, std::vector<double>& numbers) const {
    array.numbers = std::make_unique<CarriedFile>(text().substr(array.begin, array.end - array.begin));
    array.numbers->set_missing_mark("nan");
    const std::string_view words = array.numbers->text();
    std::uint32_t count = 0;
    for (std::size_t at = 0; (at = words.find_first_not_of(kXmlBlanks, at)) != std::string_view::npos; ++count) {
      const std::string_view word = words.substr(at, words.find_first_of(kXmlBlanks, at) - at);
      numbers.push_back(text::parse_coordinate(word, {path_, 0, std::to_string(count / 3 + 1), "", count % 3}));
      array.numbers->add_place(at, word.size(), first + count,
                               is_float ? NumberCoding::kTextOfFloat : NumberCoding::kText);
      at += word.size();
    }
    if (count % 3 != 0) refuse("an array of points or normals has a part of one");
  }

  std::string path_;
  VtpEncoding encoding_;
  XmlTag section_;
  std::optional<std::size_t> appended_;
  bool appended_as_base64_ = false;
  std::vector<VtpArray> arrays_;
  std::vector<std::pair<std::string_view, std::size_t>> offsets_;  ///< of all arrays, as the file has them
  std::vector<std::pair<std::size_t, std::size_t>> left_out_;
  std::vector<double> coordinates_;
  std::vector<double> normals_;
};

}  // namespace

std::unique_ptr<CarriedFile> carry_vtp(const std::string& path, std::string text) {
  auto file = std::make_unique<VtpFile>(path, std::move(text));
  file->read();
  return file;
}

}  // namespace pulson::formats
