#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <CLI/App.hpp>

#include "pulson/core/time_grid.hpp"

namespace pulson {

/// `--time`, `--steps` or `--dt`.
struct TimeOptions {
  std::optional<double> time;
  int steps = 20;
  bool automatic = false;    ///< steps are chosen by the verb unless they are given
  std::optional<double> dt;  ///< where it is given, the default of --steps is not used
  bool chosen = false;       ///< --steps or --dt was given

  /// `default_time` is what help says of it.
  void add_to(CLI::App& verb, const std::string& default_time);
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

}  // namespace pulson
