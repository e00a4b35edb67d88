#include "misspelt.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson {
namespace {

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

[[noreturn]] void refuse(const std::string& word, const CLI::App& verb, const std::vector<std::string>& valid) {
  const std::string text = word.substr(0, word.find('='));
  const std::string near = nearest_name(text.substr(text.find_first_not_of('-')), valid);
  throw InputError(fmt::format("unknown option '{}'{} (see pulson {}--help)", text,
                               near.empty() ? "" : "; did you mean '--" + near + "'",
                               verb.get_parent() == nullptr ? "" : verb.get_name() + " "));
}

/// The option that a word names, or null where it is none. @throws InputError where it only looks like one
const CLI::Option* option_of(const std::string& word, const CLI::App& verb, const std::vector<std::string>& valid) {
  if (word.size() < 2 || word[0] != '-' || std::isdigit(static_cast<unsigned char>(word[1])) != 0 || word[1] == '.')
    return nullptr;
  const bool is_long = word[1] == '-';
  const std::string name = word.substr(0, is_long ? word.find('=') : 2);
  const CLI::Option* option = verb.get_option_no_throw(name);
  // -out is not -o with the value ut.
  const bool misses_a_dash = !is_long && word.size() > 3 && contains(valid, word.substr(1, word.find('=') - 1));
  if (option == nullptr || misses_a_dash) refuse(word, verb, valid);
  return option;
}

void check_options(const CLI::App& verb, const std::vector<std::string>& arguments) {
  const std::vector<std::string> valid = long_names(verb);
  for (std::size_t i = 1; i < arguments.size() && arguments[i] != "--"; ++i) {
    const std::string& word = arguments[i];
    const CLI::Option* option = option_of(word, verb, valid);
    const bool holds_value = word.find('=') != std::string::npos || (word.size() > 2 && word[1] != '-');
    // The value may begin with a dash: --lambda -1.
    if (option != nullptr && !holds_value) i += static_cast<std::size_t>(std::max(0, option->get_items_expected_min()));
  }
}

}  // namespace

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
    if (option_of(first, program, valid) == nullptr) refuse(first, program, valid);
    return;
  }
  const std::vector<std::string> verbs = verb_names(program);
  if (!contains(verbs, first))
    throw InputError(fmt::format("unknown verb '{}'{}", first, advice_on_name(first, verbs)));
  check_options(*program.get_subcommand(first), arguments);
}

}  // namespace pulson
