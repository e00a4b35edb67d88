#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "messages.hpp"
#include "pulson/core/parallel.hpp"
#include "ranks.hpp"

namespace pulson::ranks {

/// Takes pieces of rank 0 until there are none, on all its threads.
class OwnWork {
 public:
  explicit OwnWork(const Deal& deal) : deal_(deal) {}

  /// For the threads of this rank and whoever serves the others, one at a time.
  std::optional<std::string> next() {
    const std::lock_guard lock(turn_);
    return stopped_ || Interrupt::came() ? std::nullopt : deal_.next();
  }
  void take(std::string_view piece, std::string result) {
    const std::lock_guard lock(turn_);
    deal_.take(piece, std::move(result));
  }
  /// Nothing more is dealt out.
  void stop() { stopped_ = true; }

  void run() {
    const auto turn = [this](const std::function<void()>& action) {
      const std::lock_guard lock(turn_);
      action();
    };
    parallel_for(thread_count(), [&](int) {
      try {
        while (const std::optional<std::string> piece = next()) deal_.work_here(*piece, turn);
      } catch (...) {
        stop();
        throw;
      }
    });
  }

 private:
  const Deal& deal_;
  std::mutex turn_;
  std::atomic<bool> stopped_ = false;
};

}  // namespace pulson::ranks
