#pragma once

#include <string_view>

namespace pulson::view {

/// A file of the page, in the program.
struct PageFile {
  std::string_view name;  ///< empty: the page itself
  std::string_view type;
  std::string_view text;
};

/// Null where there is none.
const PageFile* page_file(std::string_view name);

}  // namespace pulson::view
