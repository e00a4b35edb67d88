#pragma once

#include <optional>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace pulson {

/// What happens to the file that the value of an option names, as path_options.hpp declares it.
enum class PathUse { kFile, kShape, kColumn, kResult, kFolder, kBoth };

/// None of an option whose value is no path.
std::optional<PathUse> path_use(const CLI::Option* option);

}  // namespace pulson
