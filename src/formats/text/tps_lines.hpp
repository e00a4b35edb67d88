#pragma once

// What the reader and the writer of tps must agree on.

#include <string_view>

namespace pulson::io {

/// Whether a line that begins so is a comment: with # or a quote, as some programs write them and nts has them.
inline bool is_tps_comment(std::string_view line) {
  return !line.empty() && std::string_view("#\"'").find(line.front()) != std::string_view::npos;
}

}  // namespace pulson::io
