#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace pulson {

/// Help as wide as the terminal, at least 80 columns, and 100 where there is none. Descriptions are wrapped, not cut;
/// indented lines of a footer, which are commands to be copied, stay whole.
std::shared_ptr<CLI::FormatterBase> help_formatter();

/// What the program says where it is called without arguments.
std::string welcome();

/// Lines of at most `width` columns; a longer word has a line of its own.
std::vector<std::string> wrapped(std::string_view text, std::size_t width);

}  // namespace pulson
