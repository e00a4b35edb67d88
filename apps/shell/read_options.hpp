#pragma once

#include <CLI/App.hpp>

#include "pulson/formats/landmark_files.hpp"

namespace pulson {

/// `--missing`, `--format`, `--columns`, `--dim`, `--landmarks`, `--curves` and `--scale`, of every verb that reads
/// landmarks.
void add_read_options(CLI::App& verb, ReadOptions& options);

}  // namespace pulson
