// `pulson merge`: the shards of a run as one.

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "compare/study.hpp"
#include "core/paths.hpp"
#include "pulson/records/records.hpp"
#include "records/unit_parts.hpp"
#include "register/cohort.hpp"
#include "results.hpp"
#include "sample/calibration.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/path_options.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

struct MergeArguments {
  std::vector<std::string> parts;
  EnsembleOutput results;
};

int merge_paths(const MergeArguments& arguments, const std::vector<std::string>& contents) {
  arguments.results.check();
  std::vector<records::EnsembleRun> parts;
  for (std::size_t i = 0; i < contents.size(); ++i)
    parts.push_back(records::read_ensemble_part(contents[i], arguments.parts[i]));
  const records::EnsembleRun run = records::merge_ensembles(std::move(parts), arguments.parts);
  for (const std::string& file : {arguments.results.save_final, arguments.results.save_paths})
    if (!file.empty() && run.options.keep == ensemble::KeepStates::kNone)
      throw InputError(fmt::format("'{}' cannot be written: give --save-final or --save-paths to the parts", file));
  if (!arguments.results.save_paths.empty() && run.options.keep != ensemble::KeepStates::kAll)
    throw InputError("--save-paths: the parts hold final states alone; give --save-paths to them");
  log_step(fmt::format("merged {} parts", arguments.parts.size()));
  return arguments.results.finish(run);
}

int merge_units_of(const MergeArguments& arguments, const std::vector<std::string>& contents) {
  const EnsembleOutput& results = arguments.results;
  if (!results.save_final.empty() || !results.save_paths.empty())
    throw InputError("--save-final and --save-paths are for parts of ensembles");
  std::vector<records::UnitRun> parts;
  for (std::size_t i = 0; i < contents.size(); ++i)
    parts.push_back(records::read_unit_part(contents[i], arguments.parts[i]));
  const records::UnitRun whole = merge_units(std::move(parts), arguments.parts);
  log_step(fmt::format("merged {} parts", arguments.parts.size()));
  if (whole.verb == "sample") return merge_calibration(whole, results.output);
  if (whole.verb == "compare") return merge_study(whole, results.output);
  if (whole.verb == "register") return merge_cohort(whole, results.output);
  throw InputError(fmt::format("'{}' is part of a run of '{}', which has none", arguments.parts.front(), whole.verb));
}

int run_merge(const MergeArguments& arguments) {
  std::vector<std::string> contents;
  for (const std::string& path : arguments.parts) contents.push_back(read_file(path));
  const auto units = std::count_if(contents.begin(), contents.end(),
                                   [](const std::string& bytes) { return records::is_unit_part(bytes); });
  return units > 0 ? merge_units_of(arguments, contents) : merge_paths(arguments, contents);
}

}  // namespace

void add_merge_verb(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("merge", "Merge the parts of a run that --shard made");
  auto arguments = std::make_shared<MergeArguments>();
  reads_file(verb->add_option("PART", arguments->parts, "all parts of one run, in any order"))->required();
  add_threads_option(*verb);
  arguments->results.add_to(*verb);
  verb->footer(
      "Example:\n"
      "  pulson ensemble --shape wings.tps#1 --noise ch-sd:beta=0.1 --shard 1/2 -o parts\n"
      "  pulson ensemble --shape wings.tps#1 --noise ch-sd:beta=0.1 --shard 2/2 -o parts\n"
      "  pulson merge parts/part-* -o out\n"
      "The results are those of one run, bit for bit but for times and threads; see docs/clusters.md.\n"
      "Exit codes: 0 done, 2 bad input, as where a part is missing, 3 not all paths are clean (results are written).");
  verb->callback([arguments, &exit_code] { exit_code = run_merge(*arguments); });
}

}  // namespace pulson
