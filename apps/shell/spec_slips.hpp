#pragma once

#include <string>
#include <vector>

#include <CLI/App.hpp>

namespace pulson {

/// Where `name` is a parameter of noises or kernels and no option of the verb: ", which is a parameter of --noise, as
/// in
/// --noise ch-sd:beta=1"; else empty. @param value that was given to it, or empty
std::string parameter_advice(const CLI::App& verb, const std::string& name, const std::string& value);

/// Refuses what is not written as a specification behind `--noise` and `--kernel`: a parameter as a word of its own,
/// `--noise ch-sd beta=1`, and several models in one word, `--noise none,ch-sd`. @throws InputError that says how
void check_specs(const CLI::App& verb, const std::vector<std::string>& arguments);

}  // namespace pulson
