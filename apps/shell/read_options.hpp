#pragma once

#include <CLI/App.hpp>

#include "pulson/formats/landmark_files.hpp"

namespace pulson {

/// `--missing`, `--format`, `--columns`, `--dim`, `--landmarks`, `--curves` and `--scale`, of every verb that reads
/// landmarks.
void add_read_options(CLI::App& verb, ReadOptions& options);

/// Adds --flip-y and --no-flip-y of verbs that draw landmarks.
void add_flip_option(CLI::App& verb, ReadOptions& options);

}  // namespace pulson
