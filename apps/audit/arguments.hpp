#pragma once

#include <string>
#include <vector>

#include "shell/options.hpp"
#include "shell/outputs.hpp"

namespace pulson {

/// The command line of `pulson audit`.
struct AuditArguments {
  std::vector<std::string> files;
  formats::ReadOptions reading;
  bool by_order = false;
  OutputOptions output;
  std::string fix;
  std::string repeats;  ///< FILE:COLUMN, a comment of the shapes, or `names`

  void add_to(CLI::App& verb);
};

}  // namespace pulson
