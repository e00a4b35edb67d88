// What programs share: verbs, errors, exit codes.

#include "program.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <vector>

#include <CLI/Error.hpp>
#include <fmt/format.h>

#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/core/version.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "verbs.hpp"

namespace pulson {
namespace {

using AddVerbs = std::function<void(CLI::App&, int&)>;

int complain(std::string message, int exit_code) {
  for (char& c : message)
    if (c == '\n') c = ' ';
  fmt::print(stderr, "pulson: {}\n", message);
  return exit_code;
}

// A first word that is no verb gets an answer of its own: the parser would only miss a verb.
void check_verb(const CLI::App& program, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  std::vector<std::string> verbs;
  for (const CLI::App* verb : program.get_subcommands({})) verbs.push_back(verb->get_name());
  if (std::find(verbs.begin(), verbs.end(), argv[1]) != verbs.end()) return;
  const std::string near = nearest_name(argv[1], verbs);
  throw InputError(fmt::format("unknown verb '{}'{}; valid: {}", argv[1],
                               near.empty() ? "" : "; did you mean '" + near + "'", fmt::join(verbs, ", ")));
}

int run(int argc, char** argv, const AddVerbs& add_verbs) {
  int exit_code = kDone;
  CLI::App program("Stochastic LDDMM landmark registration", "pulson");
  program.set_version_flag("--version",
                           [] { return fmt::format("pulson {} ({} vector code)", version(), vector_target()); });
  program.require_subcommand(1);
  program.get_formatter()->column_width(34);
  add_verbs(program, exit_code);
  check_verb(program, argc, argv);
  try {
    program.parse(argc, argv);
    return exit_code;
  } catch (const CLI::Success& success) {
    return program.exit(success);
  } catch (const CLI::ParseError& error) {
    const bool has_verb = argc > 1 && argv[1][0] != '-';
    return complain(fmt::format("{} (see pulson {}--help)", error.what(), has_verb ? argv[1] + std::string(" ") : ""),
                    kBadInput);
  }
}

}  // namespace

int run_program(int argc, char** argv, const AddVerbs& add_verbs) {
  try {
    const int exit_code = run(argc, argv, add_verbs);
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
      return complain("standard output could not be written", kBadInput);
    return exit_code;
  } catch (const InputError& error) {
    return complain(error.what(), kBadInput);
  } catch (const std::bad_alloc&) {
    return complain("out of memory", kInternalError);
  } catch (const std::exception& error) {
    return complain(fmt::format("internal error: {}", error.what()), kInternalError);
  }
}

}  // namespace pulson
