// The program: one folder per verb.

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include <unistd.h>

#include "pulson/core/errors.hpp"
#include "shell/completion.hpp"
#include "shell/images_program.hpp"
#include "shell/program.hpp"
#include "shell/verbs.hpp"
#include "warp/arguments.hpp"

namespace {

// The program beside this one takes over.
int run_beside(char** argv) {
  const std::filesystem::path images = pulson::images_program();
  execv(images.c_str(), argv);
  throw pulson::InputError(images.string() + ", which belongs to this program, cannot be run");
}

// For the list of verbs and for shells: run_beside() runs it.
void list_warp_verb(CLI::App& program) {
  const auto arguments = std::make_shared<pulson::WarpArguments>();
  CLI::App* verb = program.add_subcommand("warp", pulson::kWarpHelp);
  arguments->add_to(*verb);
  verb->callback([arguments] {});
}

void add_verbs(CLI::App& program, int& exit_code) {
  pulson::add_register_verb(program, exit_code);
  list_warp_verb(program);
  pulson::add_simulate_verb(program, exit_code);
  pulson::add_ensemble_verb(program, exit_code);
  pulson::add_compare_verb(program, exit_code);
  pulson::add_fokker_planck_verb(program, exit_code);
  pulson::add_reproduce_verb(program, exit_code);
  pulson::add_convert_verb(program);
  pulson::add_info_verb(program);
  pulson::add_completion_verb(program);
}

}  // namespace

int main(int argc, char** argv) {
  std::string help = "--help";
  if (argc > 1 && std::string_view(argv[1]) == "help") {  // `help VERB` is `VERB --help`
    argv[1] = argc > 2 ? argv[2] : help.data();
    if (argc > 2) argv[2] = help.data();
    argc = std::min(argc, 3);
    argv[argc] = nullptr;
  }
  const bool of_images = argc > 1 && std::string_view(argv[1]) == "warp";
  return pulson::run_program(argc, argv, [&](CLI::App& program, int& exit_code) {
    if (of_images) run_beside(argv);
    add_verbs(program, exit_code);
  });
}
