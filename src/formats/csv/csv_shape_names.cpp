#include "csv_shape_names.hpp"

#include "core/text.hpp"
#include "formats/text/text_lines.hpp"

namespace pulson::io {
namespace {

constexpr std::string_view kNameSeparators = " ._-:()[]";

std::string_view without_separators(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kNameSeparators);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kNameSeparators) - begin + 1);
}

/// `1`, `LM 1` or, as R renames columns that begin with a digit, `x1`
std::optional<std::size_t> parse_landmark(std::string_view text) {
  for (const std::string_view word : {"landmark", "point", "lm", "pt", "p", "x"})
    if (text.starts_with(word)) return parse_count(without_separators(text.substr(word.size())));
  return parse_count(text);
}

bool is_separator(char c) { return kNameSeparators.find(c) != kNameSeparators.npos; }
bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }

/// Whether the last letter stands apart from those before it: `nose_x`, `noseX`, `L1x`.
bool ends_in_letter(std::string_view text) {
  const char before = text[text.size() - 2];
  return is_separator(before) || is_digit(before) || (is_upper(text.back()) && !is_upper(before));
}

}  // namespace

std::optional<CoordinateName> parse_numbered_coordinate(std::string_view name) {
  const std::string lower = to_lower(name);
  const std::string_view text = lower;
  if (text.size() < 2) return std::nullopt;
  std::optional<CoordinateName> found;
  if (const std::size_t axis = kAxisLetters.find(text.back()); axis != kAxisLetters.npos)
    found = {axis, parse_landmark(without_separators(text.substr(0, text.size() - 1))), ""};
  else if (const std::size_t first = kAxisLetters.find(text.front()); first != kAxisLetters.npos)
    found = {first, parse_landmark(without_separators(text.substr(1))), ""};
  return found && found->number ? found : std::nullopt;
}

std::optional<CoordinateName> parse_named_coordinate(std::string_view name) {
  const std::string_view text = name.substr(0, name.find_last_not_of(")]") + 1);
  if (text.size() < 2) return std::nullopt;
  const std::string lower = to_lower(text);
  std::optional<CoordinateName> found;
  if (const std::size_t axis = kAxisLetters.find(lower.back()); axis != kAxisLetters.npos && ends_in_letter(text))
    found = {axis, {}, std::string(without_separators(text.substr(0, text.size() - 1)))};
  else if (const std::size_t first = kAxisLetters.find(lower.front());
           first != kAxisLetters.npos && is_separator(text[1]))
    found = {first, {}, std::string(without_separators(text.substr(1)))};
  return found && !found->label.empty() ? found : std::nullopt;
}

}  // namespace pulson::io
