#pragma once

// Headers of MetaImage and NRRD files: lines of a key and what it says.

#include <initializer_list>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace pulson::io {

/// One line of a header.
struct HeaderEntry {
  std::size_t line;
  std::string key;         ///< as the file has it
  std::string_view value;  ///< trimmed
};

/// The entries of a header by their keys, of which case and blanks do not matter. What is looked up by several keys has
/// several names in the format. All errors are InputError "path:line: message".
class GridHeader {
 public:
  explicit GridHeader(std::string path) : path_(std::move(path)) {}

  const std::string& path() const { return path_; }

  /// Keys may not come twice. @throws InputError if one does
  void add(std::size_t line, std::string_view key, std::string_view value);

  /// The entry of the first of these keys that is there, or nullptr.
  const HeaderEntry* find(std::initializer_list<std::string_view> keys) const;

  /// The same where it has to be there. @throws InputError
  const HeaderEntry& need(std::initializer_list<std::string_view> keys) const;

  /// `count` finite numbers, between blanks. @throws InputError
  std::vector<double> numbers(const HeaderEntry& entry, std::string_view text, std::size_t count) const;

  /// The same, whole and from 1 to the largest int. @throws InputError
  std::vector<int> counts(const HeaderEntry& entry, std::size_t count) const;

  /// @throws InputError "path:line: key is 'value'; what"
  [[noreturn]] void refuse(const HeaderEntry& entry, const std::string& what) const;

 private:
  std::string path_;
  std::map<std::string, HeaderEntry> entries_;
};

/// Takes a line, without its end, off the front of `text`.
std::string_view take_header_line(std::string_view& text);

}  // namespace pulson::io
