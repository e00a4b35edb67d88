// The program: one verb per file.

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

namespace {

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
  const std::string near = pulson::nearest_name(argv[1], verbs);
  throw pulson::InputError(fmt::format("unknown verb '{}'{}; valid: {}", argv[1],
                                       near.empty() ? "" : "; did you mean '" + near + "'", fmt::join(verbs, ", ")));
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
  pulson::add_simulate_verb(program, exit_code);
  pulson::add_ensemble_verb(program, exit_code);
  pulson::add_fokker_planck_verb(program, exit_code);
  pulson::add_reproduce_verb(program, exit_code);
  pulson::add_info_verb(program);
  check_verb(program, argc, argv);
  try {
    program.parse(argc, argv);
    return exit_code;
  } catch (const CLI::Success& success) {
    return program.exit(success);
  } catch (const CLI::ParseError& error) {
    const bool has_verb = argc > 1 && argv[1][0] != '-';
    return complain(fmt::format("{} (see pulson {}--help)", error.what(), has_verb ? argv[1] + std::string(" ") : ""),
                    pulson::kBadInput);
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const int exit_code = run(argc, argv);
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
      return complain("standard output could not be written", pulson::kBadInput);
    return exit_code;
  } catch (const pulson::InputError& error) {
    return complain(error.what(), pulson::kBadInput);
  } catch (const std::bad_alloc&) {
    return complain("out of memory", pulson::kInternalError);
  } catch (const std::exception& error) {
    return complain(fmt::format("internal error: {}", error.what()), pulson::kInternalError);
  }
}
