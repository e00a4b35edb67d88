#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "messages.hpp"
#include "outputs.hpp"
#include "records/unit_parts.hpp"

namespace pulson {

/// `--shard` and `--resume` of verbs whose work is many independent units: simulations, cohorts, fits.
struct UnitOptions {
  std::string shard;
  bool resume = false;

  /// @param units what they are, for help: `simulations`
  void add_to(CLI::App& verb, const std::string& units);
};

/// Of `i/n`. @throws InputError
ensemble::Shard parse_shard(const std::string& text);

/// When work in progress is saved: every ten seconds, more often where that takes little of the time.
class SavingPace {
 public:
  bool is_due() const;
  void save(const std::function<void()>& how);
  bool has_saved() const { return has_saved_; }

 private:
  double saved_ = seconds_now();
  double taken_ = 0.01;  // seconds
  bool has_saved_ = false;
};

/// What an unfinished run saved is in `file`. @param part whether that is a shard
/// @return whether it is there, to be continued @throws InputError where it is there and is not to be continued
bool saved_before(const std::filesystem::path& file, bool resume, bool part = false);

/// Of a run that was asked to resume, and of which nothing is saved. @param record where the results go
/// @param fingerprint of the run, as the key `run` of its record has it
/// @return whether the results are there: what is to be done is done. A note says so, or that the run begins.
bool is_done_before(const std::filesystem::path& record, const std::string& fingerprint);

/// After the results were written: what was saved of them is no longer needed. That it cannot be removed is a warning.
void remove_saved(const std::filesystem::path& file);

/// What is in such a file. @throws InputError where it cannot be read
records::UnitRun read_saved(const std::filesystem::path& file);

/// The options of a verb on which its results depend, as a configuration file: all but those of outputs, threads,
/// messages, shards and resuming.
std::string settings_of(const CLI::App& verb);

/// Gives `verb` such settings. @param name what messages call them
void apply_settings(const std::string& settings, const std::string& name, CLI::App& verb);

/// A run of units, and where it is saved.
class UnitJob {
 public:
  /// Checks the outputs, on rank 0. @param record of the results in the folder
  /// @param check_outputs of a run that is no shard @throws InputError
  UnitJob(const std::string& verb, const UnitOptions& options, const OutputOptions& output, const std::string& record,
          const std::function<void()>& check_outputs);

  /// Works on the units of the shard that are not saved, on all threads of all ranks, until they are done or a signal
  /// comes; saves their results every so often. @param what is counted: `simulations`
  /// @throws InputError where what is saved is of another run
  void run(records::UnitRun run, const std::function<nlohmann::ordered_json(int unit)>& work, const std::string& what);

  /// Whether the results are to be written: on rank 0, where all units of a run that is no shard are done. If not,
  /// prints what there is to say.
  bool is_whole(const OutputOptions& output, const std::string& what) const;
  /// Where is_whole() is false.
  int exit_code() const;
  /// After the results were written.
  void remove_saved() const { pulson::remove_saved(file_); }

  const records::UnitRun& result() const { return run_; }

 private:
  void resume();
  void save() const;

  records::UnitRun run_;
  std::string verb_;
  ensemble::Shard shard_;
  bool asked_to_resume_ = false;
  bool resumes_ = false;
  bool done_before_ = false;
  std::filesystem::path file_;
  std::filesystem::path record_;
};

}  // namespace pulson
