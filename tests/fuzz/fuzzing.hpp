#pragma once

// What the targets share.

#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "pulson/core/errors.hpp"

namespace pulson::fuzz {

/// A law that does not hold.
class BrokenLaw : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

inline void require(bool holds, const std::string& law) {
  if (!holds) throw BrokenLaw(law);
}

/// A message, as people read it: not empty, one line.
inline void require_one_line(std::string_view message) {
  require(!message.empty() && message.find_first_of("\r\n") == std::string_view::npos,
          "a message is not one line: " + std::string(message));
}

/// What `action` returns, or nothing where it throws a `Refusal`, whose message must be one line: an InputError, or
/// Error for what also computes, where the numbers may fail.
template <class Refusal = InputError, class Action>
auto attempt(const Action& action) -> std::optional<decltype(action())> {
  try {
    return action();
  } catch (const Refusal& error) {
    require_one_line(error.what());
    return std::nullopt;
  }
}

/// What `action` returns, which may not refuse. @param law what an InputError would break
template <class Action>
auto demand(const std::string& law, const Action& action) -> decltype(action()) {
  try {
    return action();
  } catch (const InputError& error) {
    throw BrokenLaw(law + ": " + error.what());
  }
}

/// A file in memory, for readers that take a path.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes);
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

/// Whether readers get to see such a text: read_text_file refuses others.
inline bool has_text(std::string_view text) { return text.find_first_not_of(" \t\r\n") != std::string_view::npos; }

}  // namespace pulson::fuzz
