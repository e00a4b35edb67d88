// `pulson merge`: the shards of a run as one.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "pulson/records/records.hpp"
#include "results.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

struct MergeArguments {
  std::vector<std::string> parts;
  EnsembleOutput results;
};

std::string part_contents(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) throw InputError(fmt::format("'{}' cannot be read", path));
  return {std::istreambuf_iterator<char>(file), {}};
}

int run_merge(const MergeArguments& arguments) {
  arguments.results.check();
  std::vector<records::EnsembleRun> parts;
  for (const std::string& path : arguments.parts)
    parts.push_back(records::read_ensemble_part(part_contents(path), path));
  const records::EnsembleRun run = records::merge_ensembles(std::move(parts), arguments.parts);
  for (const std::string& file : {arguments.results.save_final, arguments.results.save_paths})
    if (!file.empty() && run.options.keep == ensemble::KeepStates::kNone)
      throw InputError(fmt::format("'{}' cannot be written: give --save-final or --save-paths to the parts", file));
  if (!arguments.results.save_paths.empty() && run.options.keep != ensemble::KeepStates::kAll)
    throw InputError("--save-paths: the parts hold final states alone; give --save-paths to them");
  log_step(fmt::format("merged {} parts", arguments.parts.size()));
  return arguments.results.finish(run);
}

}  // namespace

void add_merge_verb(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("merge", "Merge the parts of an ensemble that --shard made");
  auto arguments = std::make_shared<MergeArguments>();
  verb->add_option("PART", arguments->parts, "all parts of one run, in any order")->required();
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
