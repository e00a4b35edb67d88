#pragma once

#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace pulson {

/// The words that an option takes: of `--mode` deterministic, map, … Empty where it takes others as well.
const std::vector<std::string>& known_values(const std::string& option);

/// Refuses other words, with a suggestion. `what` is what messages call them; `more` are words of this verb alone.
/// @throws InputError from the parser
CLI::Option* only_known(CLI::Option* option, const std::string& what, const std::vector<std::string>& more = {});

}  // namespace pulson
