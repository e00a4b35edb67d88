#pragma once

#include <string>
#include <vector>

#include "view/saved_document.hpp"

namespace pulson {

struct ExportResult {
  std::string file;                 ///< path as a command line has it
  std::string kept{};               ///< where the first state of the opened file is; empty: nothing was replaced
  std::vector<std::string> losses;  ///< what the format could not hold
  std::size_t shapes = 0;
};

/// Writes the landmarks of all specimens that have some into `name`, beside the session, in the format of its
/// extension. Shapes that were opened keep their frames and all else that their file says.
/// @throws InputError where nothing is placed, the format cannot hold it, or the file is one that this session did not
/// write
ExportResult export_landmarks(view::SavedDocument& document, const std::string& name, bool in_place);

/// The name that is proposed.
std::string export_name(const view::SavedDocument& document, bool in_place);

}  // namespace pulson
