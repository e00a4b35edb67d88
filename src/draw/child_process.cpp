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
#include <sys/wait.h>
#include <unistd.h>

#include "pulson/core/errors.hpp"

extern char** environ;  // NOLINT(readability-redundant-declaration): only some systems declare it

namespace pulson::draw {
namespace {

namespace fs = std::filesystem;

void require_success(std::string_view program, int failure) {
  if (failure != 0) throw InputError(fmt::format("{} could not be started: {}", program, std::strerror(failure)));
}

/// How a child starts: its streams, its group and its signals.
struct SpawnSettings {
  SpawnSettings(int input, int output) {
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
    for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) posix_spawn_file_actions_adddup2(&actions, output, stream);
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;
  ~SpawnSettings() {
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
  }

  posix_spawn_file_actions_t actions{};
  posix_spawnattr_t attributes{};
};

}  // namespace

fs::path find_program(std::string_view name) {
  const char* const search_path = std::getenv("PATH");
  std::istringstream folders(search_path != nullptr ? search_path : "/usr/bin:/bin");
  std::error_code error;
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path file = fs::absolute(fs::path(folder) / name, error);
    if (!error && fs::is_regular_file(file, error) && ::access(file.c_str(), X_OK) == 0) return file;
  }
  return {};
}

ChildProcess::ChildProcess(fs::path program, std::vector<std::string> arguments, int input)
    : program_(program.filename().string()), printed_(std::tmpfile(), &std::fclose) {
  if (!printed_) require_success(program_, errno);
  fcntl(fileno(printed_.get()), F_SETFD, FD_CLOEXEC);
  const SpawnSettings settings(input, fileno(printed_.get()));
  std::string path = program.string();
  std::vector<char*> pointers{path.data()};
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  require_success(program_, ::posix_spawn(&child_, path.c_str(), &settings.actions, &settings.attributes,
                                          pointers.data(), environ));
}

ChildProcess::~ChildProcess() {
  if (child_ == 0) return;
  ::kill(child_, SIGKILL);
  while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

bool ChildProcess::wait() {
  const pid_t child = std::exchange(child_, 0);
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) throw InputError(fmt::format("{} was lost: {}", program_, std::strerror(errno)));
  if (WIFSIGNALED(status)) killed_by_ = fmt::format("it was killed by signal {}", WTERMSIG(status));
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

std::string ChildProcess::printed() const {
  std::rewind(printed_.get());
  std::string text;
  std::array<char, 4096> buffer;
  while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), printed_.get()))
    text.append(buffer.data(), n);
  return text;
}

}  // namespace pulson::draw
