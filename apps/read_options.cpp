#include "read_options.hpp"

#include <string>

#include "pulson/core/errors.hpp"

namespace pulson {

void add_missing_option(CLI::App& verb, ReadOptions& options) {
  verb.add_option_function<std::string>(
          "--missing",
          [&options](const std::string& text) {
            if (text != "negative") throw InputError("--missing is '" + text + "'; it must be negative, or left out");
            options.negative_is_missing = true;
          },
          "negative: each landmark with a negative coordinate is missing")
      ->type_name("NAME");
}

}  // namespace pulson
