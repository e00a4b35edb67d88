#include "pulson/report/gnuplot.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <sstream>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pulson/core/errors.hpp"
#include "utf8.hpp"

extern char** environ;  // NOLINT(readability-redundant-declaration): only some systems declare it

namespace pulson {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNotFound =
    "gnuplot was not found; install it (Debian: gnuplot-nox) or put the folder that holds it on PATH";

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

/// An unnamed temporary file: it feeds or catches a child's stream without the deadlock that two pipes invite.
File make_scratch_file() {
  File file(std::tmpfile(), &std::fclose);
  if (!file) throw InputError(fmt::format("cannot make a temporary file for gnuplot: {}", std::strerror(errno)));
  fcntl(fileno(file.get()), F_SETFD, FD_CLOEXEC);
  return file;
}

std::string contents(std::FILE* file) {
  std::rewind(file);
  std::string text;
  std::array<char, 4096> buffer;
  while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), file)) text.append(buffer.data(), n);
  return text;
}

/// gnuplot prints the offending line, a caret and then `"/dev/stdin" line N: message`, which is what a user can act on.
std::string complaint(const std::string& text) {
  const std::string mark = "\"/dev/stdin\" ";
  const std::size_t place = text.find(mark);
  const std::size_t begin = place == std::string::npos ? text.find_first_not_of(" \t\n^") : place + mark.size();
  if (begin == std::string::npos) return "it printed no message";
  return text.substr(begin, text.find('\n', begin) - begin);
}

pid_t spawn_gnuplot(int input, int errors) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, errors, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, errors, STDERR_FILENO);
  // -d: without the user's own start-up file. Named as a file, standard input is read three times as fast.
  std::array<char*, 4> arguments{const_cast<char*>("gnuplot"), const_cast<char*>("-d"), const_cast<char*>("/dev/stdin"),
                                 nullptr};
  pid_t child = 0;
  const int failure = posix_spawnp(&child, "gnuplot", &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failure == ENOENT || failure == EACCES || failure == ENOTDIR) throw InputError(kNotFound);
  if (failure != 0) throw InputError(fmt::format("gnuplot could not be started: {}", std::strerror(failure)));
  return child;
}

void run_script(const std::string& script) {
  const File input = make_scratch_file();
  const File errors = make_scratch_file();
  if (std::fwrite(script.data(), 1, script.size(), input.get()) != script.size() || std::fflush(input.get()) != 0)
    throw InputError(fmt::format("cannot write the script for gnuplot: {}", std::strerror(errno)));
  std::rewind(input.get());

  const pid_t child = spawn_gnuplot(fileno(input.get()), fileno(errors.get()));
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) throw InputError(fmt::format("gnuplot was lost: {}", std::strerror(errno)));
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127) throw InputError(kNotFound);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw InputError("gnuplot failed: " + complaint(contents(errors.get())));
}

/// A hidden name next to the file, so that the rename stays within one file system; the ending stays too.
fs::path temporary_name(const fs::path& file) {
  static std::atomic<unsigned> counter{0};
  return file.parent_path() /
         fmt::format(".{}.{}-{}.part{}", file.stem().string(), getpid(), counter++, file.extension().string());
}

}  // namespace

Gnuplot::~Gnuplot() {
  std::error_code ignored;
  for (const auto& [temporary, file] : outputs_) fs::remove(temporary, ignored);
}

void Gnuplot::command(std::string_view text) {
  script_ += text;
  script_ += '\n';
}

std::string Gnuplot::add_block(std::string_view rows) {
  std::string name = fmt::format("$block{}", blocks_++);
  script_ += fmt::format("{} << END_OF_BLOCK\n{}", name, rows);
  script_ += rows.ends_with('\n') ? "END_OF_BLOCK\n" : "\nEND_OF_BLOCK\n";
  return name;
}

void Gnuplot::set_output(const fs::path& file) {
  // An absolute name cannot begin with '|' or '~', which gnuplot would take for a command or a home folder.
  const fs::path absolute = fs::absolute(file);
  std::error_code ignored;
  if (absolute.filename().empty() || fs::is_directory(absolute, ignored))
    throw InputError(fmt::format("cannot write '{}': it is not the name of a file", file.string()));
  if (!fs::is_directory(absolute.parent_path(), ignored))
    throw InputError(fmt::format("cannot write '{}': its folder does not exist", file.string()));
  const std::string name = absolute.string();
  if (std::any_of(name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }))
    throw InputError(fmt::format("cannot write '{}': the name holds a control character", file.string()));

  const fs::path temporary = temporary_name(absolute);
  if (const File created(std::fopen(temporary.c_str(), "wbx"), &std::fclose); !created)
    throw InputError(fmt::format("cannot write '{}': {}", file.string(), std::strerror(errno)));
  outputs_.emplace_back(temporary, absolute);
  std::string doubled;
  for (const char c : temporary.string()) doubled += c == '\'' ? "''" : std::string(1, c);
  command("set output '" + doubled + "'");
}

void Gnuplot::run() {
  command("unset output");
  run_script(script_);
  std::error_code failure;
  for (const auto& [temporary, file] : outputs_)
    if (fs::file_size(temporary, failure) == 0 || failure)
      throw InputError(fmt::format("gnuplot did not write '{}'", file.string()));
  for (const auto& [temporary, file] : outputs_) {
    fs::rename(temporary, file, failure);
    if (failure) throw InputError(fmt::format("cannot write '{}': {}", file.string(), failure.message()));
  }
}

bool Gnuplot::is_installed() {
  const char* const search_path = std::getenv("PATH");
  std::istringstream folders(search_path != nullptr ? search_path : "/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (::access((fs::path(folder) / "gnuplot").c_str(), X_OK) == 0) return true;
  return false;
}

std::string Gnuplot::quoted(std::string_view text) {
  std::string result = "'";
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = picture::utf8_length(text, i);
    const auto byte = static_cast<unsigned char>(text[i]);
    if (length == 0) {
      result += '?';
    } else if (byte < 0x20 || byte == 0x7F) {
      result += ' ';
    } else if (byte == '\'') {
      result += "''";
    } else {
      result += text.substr(i, length);
    }
    i += std::max<std::size_t>(length, 1);
  }
  return result + "'";
}

}  // namespace pulson
