#include "draw/child_process.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pulson/core/errors.hpp"

extern char** environ;  // NOLINT(readability-redundant-declaration): only some systems declare it

namespace pulson::draw {

namespace fs = std::filesystem;

fs::path find_program(std::string_view name) {
  const char* const search_path = std::getenv("PATH");
  std::istringstream folders(search_path != nullptr ? search_path : "/usr/bin:/bin");
  std::error_code error;
  for (std::string folder; std::getline(folders, folder, ':');) {
    fs::path file = fs::absolute(fs::path(folder) / name, error);
    if (!error && fs::is_regular_file(file, error) && ::access(file.c_str(), X_OK) == 0) return file;
  }
  return {};
}

ChildProcess::ChildProcess(const fs::path& program, std::vector<std::string> arguments)
    : program_(program.string()), printed_(std::tmpfile(), &std::fclose) {
  const auto require = [&](bool done, int failure) {
    if (!done) throw InputError(fmt::format("{} could not be started: {}", program_, std::strerror(failure)));
  };
  // Sockets, where a pipe would kill us by SIGPIPE once the child has ended; it gets only what is given to it.
  std::array<int, 2> ends{};
  require(printed_ != nullptr, errno);
  require(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) == 0, errno);
  input_ = ends[0];
  ::fcntl(::fileno(printed_.get()), F_SETFD, FD_CLOEXEC);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_adddup2(&actions, ::fileno(printed_.get()), stream);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  std::vector<char*> pointers{program_.data()};
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  const int failure = ::posix_spawn(&child_, program_.c_str(), &actions, &attributes, pointers.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  if (failure != 0) {
    child_ = 0;
    ::close(input_);
  }
  require(failure == 0, failure);
}

ChildProcess::~ChildProcess() {
  if (child_ == 0) return;
  ::close(input_);
  ::kill(child_, SIGKILL);
  while (::waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

bool ChildProcess::send(const std::vector<std::uint8_t>& bytes) const {
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t count = ::send(input_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count < 0 && errno != EINTR) return false;
    if (count > 0) sent += static_cast<std::size_t>(count);
  }
  return true;
}

std::string ChildProcess::wait() {
  ::close(input_);
  const pid_t child = std::exchange(child_, 0);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0)
    if (errno != EINTR) throw InputError(fmt::format("{} was lost: {}", program_, std::strerror(errno)));
  if (WIFSIGNALED(status)) return fmt::format("it was killed by signal {}", WTERMSIG(status));
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  std::rewind(printed_.get());
  std::string text;
  for (int byte = 0; (byte = std::fgetc(printed_.get())) != EOF;) text += static_cast<char>(byte);
  return text.empty() ? "it printed no message" : text;
}

}  // namespace pulson::draw
