#pragma once

#include <any>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "shell/host.hpp"

namespace pulson::python {

/// What a run said.
struct Said {
  std::string printed;
  std::vector<std::string> warnings;
  std::vector<std::string> notes;
};

/// How work is run.
struct __attribute__((visibility("hidden"))) RunOptions {
  py::object progress = py::none();  ///< called as progress(fraction or None, text)
  bool numbers_only = true;
  Said* said = nullptr;
  std::shared_ptr<const NoiseModel> noise{};  ///< of one's own, for verbs that start paths
};

/// Runs work of the verbs without the interpreter's lock, one at a time in this process. Where the work asks whether to
/// stop, and says how far it is, it looks for Ctrl-C and shows the progress. @throws what the work did, or a signal's
/// handler
void run_hosted(const std::function<void()>& work, const RunOptions& options = {});

template <class Result>
Result in_host(const std::function<Result()>& work, const RunOptions& options = {}) {
  std::optional<Result> result;
  run_hosted([&] { result.emplace(work()); }, options);
  return std::move(*result);
}

/// The arguments of a verb by words of the command line. Their table is made once, as that takes longer than to parse
/// them. Within run_hosted() @throws InputError
template <class Arguments>
Arguments hosted_arguments(const std::vector<std::string>& words) {
  struct Table {
    Table() {
      arguments.add_to(options);
      defaults = arguments;
    }
    CLI::App options;
    Arguments arguments;  // which the options write to
    Arguments defaults;
  };
  static Table table;
  table.arguments = table.defaults;
  parse_hosted(table.options, words);
  return table.arguments;
}

}  // namespace pulson::python
