// The program: one folder per verb.

#include <algorithm>
#include <string>
#include <string_view>

#include "shell/program.hpp"
#include "shell/verbs.hpp"

namespace {

void add_verbs(CLI::App& program, int& exit_code) {
  pulson::add_register_verb(program, exit_code);
  pulson::add_atlas_verb(program, exit_code);
  pulson::add_audit_verb(program);
  pulson::add_warp_verb(program, exit_code);
  pulson::add_simulate_verb(program, exit_code);
  pulson::add_ensemble_verb(program, exit_code);
  pulson::add_merge_verb(program, exit_code);
  pulson::add_compare_verb(program, exit_code);
  pulson::add_sample_verb(program, exit_code);
  pulson::add_fokker_planck_verb(program, exit_code);
  pulson::add_reproduce_verb(program, exit_code);
  pulson::add_view_verb(program);
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
  return pulson::run_program(argc, argv, add_verbs);
}
