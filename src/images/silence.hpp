#pragma once

#include <mutex>

namespace pulson::images {

/// While it lives, nothing that any thread writes to stderr arrives. libpng, libjpeg and OpenCV's readers print lines
/// on damaged files there, to which the program adds its own one line. One at a time: a second waits for the first.
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

}  // namespace pulson::images
