#pragma once

// Everything that the program prints on standard output. Nothing here throws: a full disk or a closed pipe is reported
// once, at the end, by run_program().

#include <string>
#include <string_view>
#include <type_traits>

#include <fmt/format.h>

namespace pulson {

/// `text` fit for a terminal: control characters, invisible ones that change the direction or the end of a line, and
/// bytes that are not UTF-8 as "\n", "\x1b", "\u202e".
std::string shown(std::string_view text);

/// `text` as it is to standard output: records, tables of data, help.
void print_exact(std::string_view text) noexcept;

/// Opens /dev/null as each of the descriptors 0 to 2 that is closed, so that no file of results becomes standard error;
/// lets writing to a closed pipe, or beyond `ulimit -f`, fail in place of ending the process. Before anything is
/// opened.
void prepare_standard_streams() noexcept;

/// Why standard output is incomplete; empty where it is not. Writes it out before.
std::string fault_of_standard_output();

namespace printing {

template <class T>
inline constexpr bool kIsText = std::is_convertible_v<const T&, std::string_view>;

/// What an argument is formatted as: text is shown() before.
template <class T>
using Formatted = std::conditional_t<kIsText<T>, std::string, T>;

template <class T>
decltype(auto) formatted(const T& argument) {
  if constexpr (kIsText<T>)
    return shown(argument);
  else
    return (argument);
}

void print_line_of_text(std::string_view text) noexcept;

}  // namespace printing

/// As fmt::print to standard output; names and other text among the arguments are shown() in a terminal's way.
template <class... Arguments>
void print_text(fmt::format_string<printing::Formatted<Arguments>...> format, const Arguments&... arguments) {
  const auto text = [&](const auto&... ready) {
    return fmt::vformat(fmt::string_view(format), fmt::make_format_args(ready...));
  };
  printing::print_line_of_text(text(printing::formatted(arguments)...));
}

}  // namespace pulson
