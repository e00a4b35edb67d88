#pragma once

// Verbs inside another process than the program's, as the Python module runs them: what they would print and the
// signals that they would handle are the host's.

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/App.hpp>

#include "messages.hpp"
#include "pulson/dynamics/noise_model.hpp"

namespace pulson {

/// All of it may be called by any thread, one at a time or not.
struct Host {
  std::function<void(Style, const std::string&)> message;                  ///< a warning or a note
  std::function<void(std::string_view)> print;                             ///< what goes to standard output
  std::function<void(double fraction, const std::string& text)> progress;  ///< negative: nobody knows how much is done
  std::function<bool()> interrupted;                                       ///< whether the work is to end
  /// A noise model that simulations take where their specification is its own; null: none.
  std::shared_ptr<const NoiseModel> noise{};
  bool numbers_only = false;  ///< neither pictures nor pages are made
};

/// Null in the program.
const Host* host();

/// Whether there is a host that wants numbers only.
bool makes_numbers_only();

/// What work throws that has nothing to save when the host ends it. No std::exception: nothing goes on after it.
struct HostStopped {};

/// While one lives, this process is the host's. One at a time.
class HostScope {
 public:
  explicit HostScope(const Host& host);
  ~HostScope();
  HostScope(const HostScope&) = delete;
  HostScope& operator=(const HostScope&) = delete;
};

/// Runs a verb of `add_verbs` by its words, without the program's name, and forgets what it chose for the process.
/// Within a HostScope. @return the exit code: kDone or kNotConverged @throws Error; HostStopped; what is no fault of
/// the caller's as std::exception
int run_hosted_verb(const std::vector<std::string>& words,
                    const std::function<void(CLI::App& program, int& exit_code)>& add_verbs);

/// Gives options the values of these words and runs what the command calls back. @throws InputError
void parse_hosted(CLI::App& program, const std::vector<std::string>& words);

/// Forgets what options chose for the process, and which they were.
void forget_run();

}  // namespace pulson
