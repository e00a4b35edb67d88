#include "option_words.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace pulson {
namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 10> kOptionOf{{
    {"applies_scale", "--scale apply"},
    {"curve_points", "--curves"},
    {"data.kind", "--data"},
    {"dimension", "--dim"},
    {"grid.steps", "--steps"},
    {"merge_coincident", "--merge-coincident"},
    {"negative_is_missing", "--missing negative"},
    {"noise", "--noise"},
    {"points.row(1) *= -1", "pulson convert --flip-y"},
    {"reflect", "--reflect"},
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

}  // namespace pulson
