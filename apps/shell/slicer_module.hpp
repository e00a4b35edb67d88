#pragma once

#include <string>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace pulson {

/// `--xml` of the verbs that 3D Slicer can call as modules: prints slicer_module_xml() and exits. Other verbs get none.
void add_slicer_option(CLI::App& verb);

/// The verb as a module of the Slicer Execution Model: each option with its type, default and place on the command
/// line, from the same table as `--help`. Slicer makes a panel of it and calls the verb with what is in the panel:
/// options of a number or a choice always, with the value that is shown; others where they are not empty; then the
/// arguments.
std::string slicer_module_xml(const CLI::App& verb);

}  // namespace pulson
