#pragma once

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

namespace pulson {

/// Exit codes of the program, see docs: 1 is an internal error.
enum ExitCode { kDone = 0, kInternalError = 1, kBadInput = 2, kNotConverged = 3 };

/// Each adds its verb to the program; the verb's callback sets `exit_code` where it is not kDone.
void add_register_verb(CLI::App& program, int& exit_code);
void add_atlas_verb(CLI::App& program, int& exit_code);
void add_warp_verb(CLI::App& program, int& exit_code);
void add_simulate_verb(CLI::App& program, int& exit_code);
void add_ensemble_verb(CLI::App& program, int& exit_code);
void add_merge_verb(CLI::App& program, int& exit_code);
void add_compare_verb(CLI::App& program, int& exit_code);
void add_sample_verb(CLI::App& program, int& exit_code);
void add_fokker_planck_verb(CLI::App& program, int& exit_code);
void add_reproduce_verb(CLI::App& program, int& exit_code);
void add_audit_verb(CLI::App& program);
void add_view_verb(CLI::App& program);
void add_convert_verb(CLI::App& program);
void add_info_verb(CLI::App& program);
/// `pulson completion bash`: prints the script for the verbs that `program` has by then.
void add_completion_verb(CLI::App& program);

}  // namespace pulson
