#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace pulson {

/// A message of the library in the program's words: settings that it names as its options have them, in backticks,
/// become options of the command line: "more `grid.steps`" is "more --steps", "`data.kind = varifold`" is "--data
/// varifold". Other text in backticks stays.
std::string in_option_words(std::string_view message);
std::vector<std::string> in_option_words(std::vector<std::string> messages);

}  // namespace pulson
