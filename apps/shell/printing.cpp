#include "printing.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "core/text.hpp"
#include "host.hpp"

namespace pulson {

namespace {

bool output_was_closed = false;
bool exact_text_is_lost = false;

std::uint32_t code_point(std::string_view character) {
  constexpr std::array<unsigned, 5> kLeadBits = {0, 0x7F, 0x1F, 0x0F, 0x07};
  std::uint32_t code = static_cast<unsigned char>(character[0]) & kLeadBits.at(character.size());
  for (const char byte : character.substr(1)) code = (code << 6U) | (static_cast<unsigned char>(byte) & 0x3FU);
  return code;
}

/// Controls of ISO 6429, of the direction and lines of text (Unicode 15, chapter 23), and characters without width; not
/// the joiners U+200C and U+200D, which words have.
bool is_hidden(std::uint32_t code) {
  constexpr std::array<std::pair<std::uint32_t, std::uint32_t>, 11> kHidden = {{{0x00, 0x1F},
                                                                                {0x7F, 0x9F},
                                                                                {0xAD, 0xAD},
                                                                                {0x61C, 0x61C},
                                                                                {0x200B, 0x200B},
                                                                                {0x200E, 0x200F},
                                                                                {0x2028, 0x202E},
                                                                                {0x2060, 0x206F},
                                                                                {0xFEFF, 0xFEFF},
                                                                                {0xFFF9, 0xFFFB},
                                                                                {0xE0000, 0xE007F}}};
  for (const auto& [first, last] : kHidden)
    if (code >= first && code <= last) return true;
  return false;
}

std::string escaped(std::uint32_t code) {
  if (code == '\n') return "\\n";
  if (code == '\r') return "\\r";
  if (code == '\t') return "\\t";
  return code < 0x100 ? fmt::format("\\x{:02x}", code) : fmt::format("\\u{:04x}", code);
}

bool reader_has_ended = false;  // as `head` does when it has enough: nothing is lost that anybody waits for

int first_error = 0;  // of writing: what is longer than the buffer fails at once, the rest when it is flushed

bool write_out(std::string_view text) noexcept {
  if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size()) return true;
  if (first_error == 0) first_error = errno;
  reader_has_ended = reader_has_ended || errno == EPIPE;
  return reader_has_ended;
}

}  // namespace

std::string shown(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    if (length == 0) {
      result += escaped(static_cast<unsigned char>(text[i++]));
      continue;
    }
    const std::string_view character = text.substr(i, length);
    const std::uint32_t code = code_point(character);
    if (is_hidden(code))
      result += escaped(code);
    else
      result += character;
    i += length;
  }
  return result;
}

void print_exact(std::string_view text) noexcept {
  if (host() != nullptr) return host()->print(text);
  if (!write_out(text) || output_was_closed) exact_text_is_lost = true;
}

void printing::print_line_of_text(std::string_view text) noexcept {
  if (host() != nullptr) return host()->print(text);
  write_out(text);
}

void prepare_standard_streams() noexcept {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(descriptor, F_GETFD) >= 0) continue;
    if (descriptor == STDOUT_FILENO) output_was_closed = true;
    // The lowest free descriptor, which is this one. Where even that fails, nothing can be said.
    if (::open("/dev/null", O_RDWR) != descriptor) ::_exit(2);
  }
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

std::string fault_of_standard_output() {
  errno = 0;
  const bool is_written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if (reader_has_ended || (!is_written && errno == EPIPE)) return "";
  const int error = first_error == 0 ? errno : first_error;
  if (!is_written)
    return "standard output could not be written" +
           (error == 0 ? std::string() : ": " + std::generic_category().message(error));
  return exact_text_is_lost ? "standard output is closed, and was to hold what is asked for" : "";
}

}  // namespace pulson
