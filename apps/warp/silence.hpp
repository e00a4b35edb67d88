#pragma once

#include <mutex>

namespace pulson {

/// While one lives, nothing that any thread writes to stderr arrives: libpng, libjpeg and OpenCV's readers print lines
/// about damaged files there, and the program prints one line of its own. One at a time: a second waits for the first.
class SilentStderr {
 public:
  SilentStderr();
  ~SilentStderr();
  SilentStderr(const SilentStderr&) = delete;
  SilentStderr& operator=(const SilentStderr&) = delete;

 private:
  std::lock_guard<std::mutex> lock_;
  int before_;  ///< a copy of stderr's descriptor, or -1 where it could not be replaced
};

}  // namespace pulson
