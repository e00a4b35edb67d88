
#include <fmt/core.h>

#include "pulson/core/name_table.hpp"

namespace pulson {

Length Length::percent(double value) {
  Length length(value);
  length.relative_ = true;
  return length;
}

Length Length::parse(std::string_view text, std::string_view what) {
  if (text.empty() || text.back() != '%') return parse_number(text, what);
  return percent(parse_number(text.substr(0, text.size() - 1), what));
}

std::string Length::text() const { return fmt::format("{}{}", value_, relative_ ? "%" : ""); }

}  // namespace pulson
