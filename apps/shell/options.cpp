#include "options.hpp"

#include <charconv>
#include <cmath>

#include <fmt/core.h>

#include "core/number_checks.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson {
namespace {

constexpr int kMaxSteps = 10'000'000;

}  // namespace

void check_at_least(int value, int least, std::string_view option) {
  if (value < least) throw InputError(fmt::format("{} is {}; it must be at least {}", option, value, least));
}

void TimeOptions::add_to(CLI::App& verb, const std::string& default_time) {
  verb.add_option("--time", time, "length T of the time interval [" + default_time + "]");
  CLI::Option* by_steps = verb.add_option_function<int>(
      "--steps",
      [this](int count) {
        steps = count;
        chosen = true;
        dt.reset();
      },
      "number of time steps" + (dt          ? std::string(", instead of --dt")
                                : automatic ? " [auto]"
                                            : fmt::format(" [{}]", steps)));
  verb.add_option("--dt", dt, dt ? fmt::format("longest time step [{}]", *dt) : "longest time step, instead of --steps")
      ->excludes(by_steps);
}

TimeGrid TimeOptions::grid(double default_time) const {
  const double length = time.value_or(default_time);
  require_positive("--time", length);
  if (!dt) {
    if (steps < 1 || steps > kMaxSteps)
      throw InputError(fmt::format("--steps is {}; it must be from 1 to {}", steps, kMaxSteps));
    return {length, steps};
  }
  if (!(std::isfinite(*dt) && *dt > 0 && length / *dt <= kMaxSteps))
    throw InputError(fmt::format("--dt is {}; it must be greater than 0 and give at most {} steps", *dt, kMaxSteps));
  return {length, std::max(1, static_cast<int>(std::ceil(length / *dt * (1 - 1e-12))))};
}

std::optional<std::array<double, 2>> parse_place(std::string_view option, const std::string& text) {
  if (text.empty()) return std::nullopt;
  std::array<double, 2> numbers{};
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, numbers[0]);
  const bool has_comma = first.ec == std::errc() && first.ptr < end && *first.ptr == ',';
  const auto second = has_comma ? std::from_chars(first.ptr + 1, end, numbers[1]) : first;
  if (!has_comma || second.ec != std::errc() || second.ptr != end || !std::isfinite(numbers[0]) ||
      !std::isfinite(numbers[1]))
    throw InputError(fmt::format("{} is '{}'; it must be two numbers, as in -2,-1.5", option, text));
  return numbers;
}

void add_seed_option(CLI::App& verb, std::uint64_t& seed) {
  verb.add_option_function<std::string>(
          "--seed",
          [&seed](const std::string& text) {
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seed);
            if (error != std::errc() || end != text.data() + text.size())
              throw InputError(fmt::format("--seed is '{}'; it must be a whole number from 0 to 2^64 - 1", text));
          },
          "random seed; path m depends only on (seed, m)")
      ->type_name("UINT")
      ->default_str(std::to_string(seed));
}

void add_threads_option(CLI::App& verb) {
  verb.add_option_function<int>(
      "--threads",
      [](int count) {
        if (count < 0) throw InputError(fmt::format("--threads is {}; it must be 0 (one per core) or more", count));
        set_thread_count(count);
      },
      "threads to use, at most one per core; 0: one per core");
}

}  // namespace pulson
