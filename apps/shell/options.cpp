#include "options.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "core/text.hpp"
#include "help_groups.hpp"
#include "path_options.hpp"
#include "pulson/core/alignment.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/images/image_warp.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/warp/material_flow.hpp"
#include "pulson/warp/sheet_order.hpp"
#include "ranks.hpp"
#include "spec_slips.hpp"

namespace pulson {

namespace {

constexpr int kMaxSteps = 10'000'000;

}  // namespace

void check_at_least(int value, int least, std::string_view option) {
  if (value < least) throw InputError(fmt::format("{} is {}; it must be at least {}", option, value, least));
}

TimeOptions TimeOptions::of(const matching::TaskDefaults& defaults) {
  TimeOptions options;
  options.automatic = defaults.steps.value == "auto";
  if (!options.automatic && !defaults.steps.value.empty()) options.steps = std::stoi(defaults.steps.value);
  if (!defaults.dt.value.empty()) options.dt = std::stod(defaults.dt.value);
  return options;
}

void TimeOptions::add_to(CLI::App& verb, const std::string& default_time) {
  verb.add_option("--time", time, "length T of the time interval [" + default_time + "]");
  const auto take = [this](int count) {
    steps = count;
    chosen = true;
    dt.reset();
  };
  const std::string what = "number of time steps" + (dt          ? std::string(", instead of --dt")
                                                     : automatic ? " [auto]"
                                                                 : fmt::format(" [{}]", steps));
  CLI::Option* by_steps = nullptr;
  if (automatic) {
    by_steps = verb.add_option_function<std::string>(
        "--steps",
        [take](const std::string& text) {
          if (text == "auto") return;
          int count = 0;
          const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
          if (error != std::errc() || end != text.data() + text.size())
            throw InputError(fmt::format("--steps is {}; it must be a whole number or auto", quoted_line(text)));
          take(count);
        },
        what);
    by_steps->type_name("COUNT");
  } else {
    by_steps = verb.add_option_function<int>("--steps", take, what);
  }
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

CLI::Option* add_max_pixels_option(CLI::App& verb, std::int64_t& max_pixels) {
  static constexpr double kMost = 1 << 30;  // that images are read of at all
  return verb
      .add_option_function<double>(
          "--max-pixels",
          [&max_pixels](double count) {
            if (!(count >= 1 && count <= kMost && count == std::floor(count)))
              throw InputError(
                  fmt::format("--max-pixels is {}; it must be a whole number from 1 to {:.0f}", count, kMost));
            max_pixels = static_cast<std::int64_t>(count);
          },
          "most pixels of an image; one of more is refused before it is decoded")
      ->type_name("COUNT")
      ->default_str(std::to_string(max_pixels));
}

void add_threads_option(CLI::App& verb) {
  verb.add_option_function<int>(
      "--threads",
      [](int count) {
        if (count < 0) throw InputError(fmt::format("--threads is {}; it must be 0 (one per core) or more", count));
        set_thread_count(count > 0 ? count : ranks::default_threads());
      },
      "threads to use, at most one per core; 0: one per core, shared out where there are several ranks");
}

namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 21> kOptionOf{{
    {"align", "--align"},
    {"applies_scale", "--scale apply"},
    {"by_order", "--by-order"},
    {"columns", "--columns x=NAME,y=NAME"},
    {"curve_points", "--curves"},
    {"data.kind", "--data"},
    {"dimension", "--dim"},
    {"grid.steps", "--steps"},
    {"inverse", "--inverse"},
    {"max_pixels", "--max-pixels"},
    {"max_points", "--max-pixels"},
    {"merge_coincident", "--merge-coincident"},
    {"method", "--method"},
    {"missing_codes", "--missing"},
    {"mirror_y", "pulson convert --flip-y HEIGHT"},
    {"negative_is_missing", "--missing negative"},
    {"noise", "--noise"},
    {"points.row(1) *= -1", "pulson convert --flip-y"},
    {"reflect", "--reflect"},
    {"y_down", "--flip-y (up) or --no-flip-y (down)"},
    {"zero_is_missing", "--missing zero"},
}};

std::string_view option_of(std::string_view name) {
  const auto* found =
      std::find_if(kOptionOf.begin(), kOptionOf.end(), [&](const auto& row) { return row.first == name; });
  return found == kOptionOf.end() ? std::string_view() : found->second;
}

// Of `NAME` or `NAME = VALUE`; empty where the program has no such option.
std::string option_text(std::string_view setting) {
  constexpr std::string_view kEquals = " = ";
  if (const std::string_view option = option_of(setting); !option.empty()) return std::string(option);
  const std::size_t equals = setting.find(kEquals);
  if (equals == std::string_view::npos) return {};
  const std::string_view option = option_of(setting.substr(0, equals));
  if (option.empty()) return {};
  return std::string(option) + ' ' + std::string(setting.substr(equals + kEquals.size()));
}

}  // namespace

std::string in_option_words(std::string_view message) {
  std::string text;
  for (;;) {
    const std::size_t begin = message.find('`');
    const std::size_t end = begin == std::string_view::npos ? begin : message.find('`', begin + 1);
    if (end == std::string_view::npos) return text.append(message);
    const std::string option = option_text(message.substr(begin + 1, end - begin - 1));
    text.append(message.substr(0, option.empty() ? end : begin)).append(option);
    message.remove_prefix(option.empty() ? end : end + 1);
  }
}

std::vector<std::string> in_option_words(std::vector<std::string> messages) {
  for (std::string& message : messages) message = in_option_words(message);
  return messages;
}

namespace {

/// The names of all values of an enum that counts from 0.
template <class Enum>
std::vector<std::string> names_of(std::string (*name)(Enum)) {
  std::vector<std::string> names;
  for (int value = 0; !name(static_cast<Enum>(value)).empty(); ++value) names.push_back(name(static_cast<Enum>(value)));
  return names;
}

std::vector<std::string> with_auto(std::vector<std::string> names) {
  names.insert(names.begin(), "auto");
  return names;
}

}  // namespace

const std::vector<std::string>& known_values(const std::string& option) {
  static const std::map<std::string, std::vector<std::string>> kValues = {
      {"--mode", names_of(&matching::mode_name)},
      {"--data", names_of(&matching::data_kind_name)},
      {"--curve-ends", names_of(&matching::curve_ends_name)},
      {"--align", names_of(&alignment_name)},
      {"--solver", names_of(&matching::solver_name)},
      {"--missing", {"negative", "zero", "absent:NA"}},
      {"--format", formats::landmark_format_names()},
      {"--dim", {"2", "3"}},
      {"--scale", {"apply"}},
      {"--axes", {"LPS", "RAS"}},
      {"--from-axes", {"LPS", "RAS"}},
      {"--labels", names_of(&warp::label_kernel_name)},
      {"--method", {"auto", "pull", "push"}},
      {"--over", names_of(&warp::over_name)},
      {"--interpolation", names_in(images::interpolation_table())},
      {"--border", with_auto(names_in(images::border_table()))}};
  static const std::vector<std::string> kNone;
  const auto found = kValues.find(option);
  return found == kValues.end() ? kNone : found->second;
}

CLI::Option* only_known(CLI::Option* option, const std::string& what, const std::vector<std::string>& more) {
  std::vector<std::string> valid = more;
  const std::vector<std::string>& known = known_values(option->get_name());
  valid.insert(valid.end(), known.begin(), known.end());
  return option->check([what, valid](const std::string& text) {
    if (std::find(valid.begin(), valid.end(), text) == valid.end())
      throw InputError(fmt::format("unknown {} '{}'{}", what, text, advice_on_name(text, valid)));
    return std::string();
  });
}

namespace {

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

std::string advice_on_former(std::string_view name) {
  constexpr std::string_view kFit =
      "; a number that is fitted is marked where it stands: --noise ch-sd:beta=fit, --kernel gaussian:alpha=fit, "
      "--lambda fit, --sigma fit";
  if (name == "fit") return std::string(kFit);
  if (name == "parameters") return fmt::format("{}; with a prior 'fit(0.5)'", kFit);
  return {};
}

namespace {

/// @param value of the option, where it is known
[[noreturn]] void refuse(const std::string& word, const std::string& value, const CLI::App& verb,
                         const std::vector<std::string>& valid) {
  const std::string text = word.substr(0, word.find('='));
  const std::string name = text.substr(std::min(text.find_first_not_of('-'), text.size()));
  std::string advice = advice_on_former(name);
  if (advice.empty()) advice = parameter_advice(verb, name, value);
  if (const std::string near = nearest_name(name, valid); advice.empty() && !near.empty())
    advice = "; did you mean '--" + near + "'";
  throw InputError(fmt::format("unknown option '{}'{} (see pulson {}--help)", text, advice,
                               verb.get_parent() == nullptr ? "" : verb.get_name() + " "));
}

/// The option that a word names, or null where it is none. @throws InputError where it only looks like one
/// @param next the word behind it, or empty
const CLI::Option* named_option(const std::string& word, const std::string& next, const CLI::App& verb,
                                const std::vector<std::string>& valid) {
  if (word.size() < 2 || word[0] != '-' || std::isdigit(static_cast<unsigned char>(word[1])) != 0 || word[1] == '.')
    return nullptr;
  const bool is_long = word[1] == '-';
  const std::string name = word.substr(0, is_long ? word.find('=') : 2);
  const CLI::Option* option = verb.get_option_no_throw(name);
  // -out is not -o with the value ut.
  const bool misses_a_dash = !is_long && word.size() > 3 && contains(valid, word.substr(1, word.find('=') - 1));
  const std::size_t equals = word.find('=');
  if (option == nullptr || misses_a_dash)
    refuse(word, equals == std::string::npos ? next : word.substr(equals + 1), verb, valid);
  return option;
}

std::string empty_value_text(const std::string& name) {
  return fmt::format("{} is empty; give it a value or leave it out (is a variable of the shell unset?)", name);
}

/// What the empty word at `i` is: the value of the option before it, or an argument.
std::string name_of_empty(std::size_t i, const std::vector<std::string>& arguments, const CLI::App& verb) {
  const std::string& before = arguments[i - 1];
  const CLI::Option* const option = before.starts_with('-') ? verb.get_option_no_throw(before) : nullptr;
  if (option != nullptr && option->get_items_expected_max() > 0) return before;
  return fmt::format("argument {} of {}", i, verb.get_name());
}

/// An empty value, of an unset shell variable in most cases, is refused: what it would stand for differs from option to
/// option. So is `--option=`, after which the parser would take the next word.
void refuse_empty_values(const CLI::App& verb, const std::vector<std::string>& arguments) {
  bool options_ended = false;
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    const std::string& word = arguments[i];
    options_ended = options_ended || word == "--";
    if (is_blank(word)) throw InputError(empty_value_text(name_of_empty(i, arguments, verb)));
    if (!options_ended && word.starts_with("--") && word.ends_with('='))
      throw InputError(empty_value_text(word.substr(0, word.find('='))));
  }
}

void check_options(const CLI::App& verb, const std::vector<std::string>& arguments) {
  const std::vector<std::string> valid = long_names(verb);
  for (std::size_t i = 1; i < arguments.size() && arguments[i] != "--"; ++i) {
    const std::string& word = arguments[i];
    const CLI::Option* option = named_option(word, i + 1 < arguments.size() ? arguments[i + 1] : "", verb, valid);
    if (option != nullptr && option->get_items_expected_max() == 0 && word.find('=') != std::string::npos)
      throw InputError(fmt::format("{} is a switch and takes no value; leave '{}' out", word.substr(0, word.find('=')),
                                   word.substr(word.find('='))));
    const bool holds_value = word.find('=') != std::string::npos || (word.size() > 2 && word[1] != '-');
    // The value may begin with a dash: --lambda -1.
    if (option != nullptr && !holds_value) i += static_cast<std::size_t>(std::max(0, option->get_items_expected_min()));
  }
}

}  // namespace

bool is_blank(std::string_view text) { return text.find_first_not_of(" \t\r\n") == std::string_view::npos; }

std::string suggestion(const std::string& name, const std::vector<std::string>& valid) {
  const std::string near = nearest_name(name, valid);
  return near.empty() ? "" : "; did you mean '" + near + "'";
}

std::vector<std::string> long_names(const CLI::App& verb) {
  std::vector<std::string> names;
  for (const CLI::Option* option : verb.get_options())
    names.insert(names.end(), option->get_lnames().begin(), option->get_lnames().end());
  return names;
}

std::vector<std::string> verb_names(const CLI::App& program) {
  std::vector<std::string> names;
  for (const CLI::App* verb : program.get_subcommands({})) names.push_back(verb->get_name());
  return names;
}

void check_names(const CLI::App& program, const std::vector<std::string>& arguments) {
  if (arguments.empty()) return;
  const std::string& first = arguments.front();
  if (!first.empty() && first.front() == '-') {
    const std::vector<std::string> valid = long_names(program);
    if (named_option(first, "", program, valid) == nullptr) refuse(first, "", program, valid);
    return;
  }
  if (is_blank(first)) throw InputError(empty_value_text("the verb"));
  const std::vector<std::string> verbs = verb_names(program);
  if (!contains(verbs, first))
    throw InputError(fmt::format("unknown verb '{}'{}", first, advice_on_name(first, verbs)));
  const CLI::App& verb = *program.get_subcommand(first);
  refuse_empty_values(verb, arguments);
  check_options(verb, arguments);
  check_specs(verb, arguments);
}

}  // namespace pulson
