#include "silence.hpp"

#include <cstdio>

#include <fcntl.h>
#include <unistd.h>

namespace pulson {
namespace {

std::mutex& only_one() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

SilentStderr::SilentStderr() : lock_(only_one()), before_(::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3)) {
  if (before_ < 0) return;
  std::fflush(stderr);
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nowhere < 0) return;
  ::dup2(nowhere, STDERR_FILENO);
  ::close(nowhere);
}

SilentStderr::~SilentStderr() {
  if (before_ < 0) return;
  std::fflush(stderr);
  ::dup2(before_, STDERR_FILENO);
  ::close(before_);
}

}  // namespace pulson
