#pragma once

// The tags of a file in XML, one after the other: what readers of landmarks in XML share.

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/text.hpp"

namespace pulson::formats {

struct Tag {
  std::size_t line;
  std::string name;
  std::map<std::string, std::string> attributes;
  bool begins = true;  ///< an element
  bool ends = false;   ///< an element, perhaps the same: `<a/>`

  /// Empty where there is none.
  std::string attribute(const std::string& key) const;
};

/// Whether `text` is XML whose first element has this name.
bool is_xml_of(std::string_view text, std::string_view element);

/// Takes the tags of a file from its front; text between them is left out, but for what text() returns.
class Tags {
 public:
  /// @throws InputError where `text` holds zero bytes
  Tags(const std::string& path, std::string_view text);

  /// The next tag; nothing at the end. @throws InputError that names the line of what is no XML, of an end without a
  /// beginning and of a beginning without an end
  std::optional<Tag> take();

  /// What stood before the last tag, without blanks around it.
  std::string text() const;

  std::size_t line() const { return line_; }

 private:
  std::optional<Tag> take_any();
  void skip(std::size_t count);
  void skip_past(std::string_view end, std::string_view what);
  void skip_blanks();
  void skip_doctype();
  Tag take_tag();
  void take_attribute(Tag& tag);
  void match(const Tag& tag);
  [[noreturn]] void fail_attribute(const Tag& tag) const;

  struct OpenTag {
    std::size_t line;
    std::string name;
  };

  const std::string& path_;
  std::string_view left_;
  std::string_view text_;
  std::size_t line_ = 1;
  char line_end_ = '\n';
  std::vector<OpenTag> open_;
};

/// The coordinate in the attribute x, y or z, by place.axis, of a tag. @throws InputError where it is not there or no
/// number
double coordinate_of(const Tag& tag, const text::CoordinatePlace& place);

}  // namespace pulson::formats
