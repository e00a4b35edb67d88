#include "grid_header.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::io {
namespace {

std::string plain_key(std::string_view key) {
  std::string plain = to_lower(key);
  std::erase(plain, ' ');
  return plain;
}

}  // namespace

void GridHeader::add(std::size_t line, std::string_view key, std::string_view value) {
  const auto [entry, is_new] = entries_.try_emplace(plain_key(key), HeaderEntry{line, std::string(key), trim(value)});
  if (!is_new) fail(path_, line, fmt::format("{} was given on line {} already", in_quotes(key), entry->second.line));
}

const HeaderEntry* GridHeader::find(std::initializer_list<std::string_view> keys) const {
  for (const std::string_view key : keys)
    if (const auto entry = entries_.find(plain_key(key)); entry != entries_.end()) return &entry->second;
  return nullptr;
}

const HeaderEntry& GridHeader::need(std::initializer_list<std::string_view> keys) const {
  if (const HeaderEntry* const entry = find(keys)) return *entry;
  throw InputError(fmt::format("{}: its header has no '{}'", path_, *keys.begin()));
}

std::vector<double> GridHeader::numbers(const HeaderEntry& entry, std::string_view text, std::size_t count) const {
  const std::string what = fmt::format("{}:{}: a number of {}", path_, entry.line, entry.key);
  std::vector<double> values;
  for (const std::string_view word : split_words(text)) {
    values.push_back(parse_number(word, what));
    if (!std::isfinite(values.back())) refuse(entry, "its numbers must be finite");
  }
  if (values.size() != count)
    refuse(entry, fmt::format("{} needed", count == 1 ? "1 number is" : counted(count, "number") + " are"));
  return values;
}

std::vector<int> GridHeader::counts(const HeaderEntry& entry, std::size_t count) const {
  std::vector<int> values;
  for (const double number : numbers(entry, entry.value, count)) {
    if (!(number >= 1 && number <= std::numeric_limits<int>::max() && number == std::floor(number)))
      refuse(entry, "whole numbers from 1 to 2147483647 are needed");
    values.push_back(static_cast<int>(number));
  }
  return values;
}

void GridHeader::refuse(const HeaderEntry& entry, const std::string& what) const {
  fail(path_, entry.line, fmt::format("{} is {}; {}", entry.key, in_quotes(entry.value), what));
}

std::string_view take_header_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

}  // namespace pulson::io
