#pragma once

#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace pulson {

/// "; did you mean 'register'?" or nothing.
std::string suggestion(const std::string& name, const std::vector<std::string>& valid);

/// The long names of a verb's options, without the dashes.
std::vector<std::string> long_names(const CLI::App& verb);

/// The names of the verbs.
std::vector<std::string> verb_names(const CLI::App& program);

/// A first word that is no verb, or a word that looks like an option of it and is none, gets an answer of its own: the
/// parser would take its value for a file and miss something else. @throws InputError
void check_names(const CLI::App& program, const std::vector<std::string>& arguments);

}  // namespace pulson
