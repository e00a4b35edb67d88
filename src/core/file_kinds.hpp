#pragma once

// Kinds of files that are no text and are not read: named by the bytes that they begin with, with the way out.

#include <optional>
#include <string>
#include <string_view>

namespace pulson {

struct FileKind {
  std::string name;    ///< "an Excel workbook"
  std::string remedy;  ///< "save the sheet as csv"
};

/// The kind of a file that holds these bytes; none where it is no kind that is known.
std::optional<FileKind> kind_of_bytes(std::string_view bytes);

}  // namespace pulson
