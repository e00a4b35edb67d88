#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "matching/defaults.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/core/time_grid.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson {

/// `--time`, `--steps` or `--dt`.
struct TimeOptions {
  std::optional<double> time;
  int steps = 20;
  bool automatic = false;    ///< steps are chosen by the verb unless they are given
  std::optional<double> dt;  ///< where it is given, the default of --steps is not used
  bool chosen = false;       ///< --steps was given, as a number

  static TimeOptions of(const matching::TaskDefaults& defaults);

  /// `default_time` is what help says of it.
  void add_to(CLI::App& verb, const std::string& default_time);
  /// Whether the verb chooses the steps.
  bool is_automatic() const { return automatic && !chosen && !dt; }
  /// K equal steps over --time or `default_time`, none longer than --dt where that is given. @throws InputError
  TimeGrid grid(double default_time = 1) const;
};

/// @throws InputError that names the option
void check_at_least(int value, int least, std::string_view option);

/// "-2,-1.5"; none where the text is empty. @throws InputError that names the option
std::optional<std::array<double, 2>> parse_place(std::string_view option, const std::string& text);

/// `--seed` of the random numbers.
void add_seed_option(CLI::App& verb, std::uint64_t& seed);

/// `--threads`; sets the number at once.
void add_threads_option(CLI::App& verb);

/// `--max-pixels`, of verbs that read images.
CLI::Option* add_max_pixels_option(CLI::App& verb, std::int64_t& max_pixels);

/// A message of the library in the program's words: settings that it names as its options have them, in backticks,
/// become options of the command line: "more `grid.steps`" is "more --steps", "`data.kind = varifold`" is "--data
/// varifold". Other text in backticks stays.
std::string in_option_words(std::string_view message);
std::vector<std::string> in_option_words(std::vector<std::string> messages);

/// `--missing`, `--format`, `--columns`, `--dim`, `--landmarks`, `--curves`, `--scale` and `--links`, of every verb
/// that reads landmarks.
void add_read_options(CLI::App& verb, formats::ReadOptions& options);

/// `--by-order`, of every verb that pairs landmarks of several files or rows of tables with them.
void add_order_option(CLI::App& verb, bool& by_order);

/// Adds --flip-y and --no-flip-y of verbs that draw landmarks.
void add_flip_option(CLI::App& verb, formats::ReadOptions& options);

/// The names of a table's rows.
template <class Make>
std::vector<std::string> names_in(const NameTable<Make>& table) {
  std::vector<std::string> names;
  for (const auto& row : table.rows()) names.push_back(row.name);
  return names;
}

/// The words that an option takes: of `--mode` deterministic, map, … Empty where it takes others as well.
const std::vector<std::string>& known_values(const std::string& option);

/// Refuses other words, with a suggestion. `what` is what messages call them; `more` are words of this verb alone.
/// @throws InputError from the parser
CLI::Option* only_known(CLI::Option* option, const std::string& what, const std::vector<std::string>& more = {});

/// What is written in place of an option that there is no more: "; …", or nothing for other names.
std::string advice_on_former(std::string_view name);

/// "; did you mean 'register'?" or nothing.
std::string suggestion(const std::string& name, const std::vector<std::string>& valid);

/// The long names of a verb's options, without the dashes.
std::vector<std::string> long_names(const CLI::App& verb);

/// The names of the verbs.
std::vector<std::string> verb_names(const CLI::App& program);

/// Whether it has blanks alone, or nothing.
bool is_blank(std::string_view text);

/// A first word that is no verb, or a word that looks like an option of it and is none, gets an answer of its own: the
/// parser would take its value for a file and miss something else. No word may be empty. @throws InputError
void check_names(const CLI::App& program, const std::vector<std::string>& arguments);

}  // namespace pulson
