#pragma once

#include <CLI/App.hpp>

#include "pulson/io/landmark_files.hpp"

namespace pulson {

/// `--missing`: what stands for a missing coordinate besides what the format has for it.
void add_missing_option(CLI::App& verb, ReadOptions& options);

}  // namespace pulson
