// The program: one verb per file.

#include <cstdio>
#include <exception>
#include <new>

#include <CLI/Error.hpp>
#include <fmt/core.h>

#include "pulson/core/errors.hpp"
#include "pulson/core/version.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "verbs.hpp"

namespace {

int complain(std::string message, int exit_code) {
  for (char& c : message)
    if (c == '\n') c = ' ';
  fmt::print(stderr, "pulson: {}\n", message);
  return exit_code;
}

int run(int argc, char** argv) {
  int exit_code = pulson::kDone;
  CLI::App program("Stochastic LDDMM landmark registration", "pulson");
  program.set_version_flag("--version", [] {
    return fmt::format("pulson {} ({} vector code)", pulson::version(), pulson::vector_target());
  });
  program.require_subcommand(1);
  program.get_formatter()->column_width(34);
  pulson::add_register_verb(program, exit_code);
  pulson::add_info_verb(program);
  try {
    program.parse(argc, argv);
    return exit_code;
  } catch (const CLI::Success& success) {
    return program.exit(success);
  } catch (const CLI::ParseError& error) {
    return complain(fmt::format("{} (see pulson --help)", error.what()), pulson::kBadInput);
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const pulson::InputError& error) {
    return complain(error.what(), pulson::kBadInput);
  } catch (const std::bad_alloc&) {
    return complain("out of memory", pulson::kInternalError);
  } catch (const std::exception& error) {
    return complain(fmt::format("internal error: {}", error.what()), pulson::kInternalError);
  }
}
