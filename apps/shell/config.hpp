#pragma once

#include <string>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace pulson {

/// `--config FILE`, whose settings fill in the options that the command line does not give, and `--print-config`.
void add_config_options(CLI::App& verb);

/// Whether --print-config is given.
bool asks_for_config(const CLI::App& verb);

/// The options of a parsed verb and the defaults of the others as TOML that `--config` reads.
std::string config_text(const CLI::App& verb);

}  // namespace pulson
