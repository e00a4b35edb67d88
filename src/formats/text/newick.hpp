#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson::formats {

/// The tree of a Newick file: `(A:1,(B:2,C:2)D:1);`. Labels may be quoted, `'it''s'`; comments in brackets are left
/// out. Without any lengths all are 1.
/// @return the root first, parents before their children, the nodes below one node one after the other
/// @throws InputError where it is no tree, holds several, or only some branches have lengths
std::vector<TreeNode> parse_newick(const std::string& path, std::string_view text);

}  // namespace pulson::formats
