#pragma once

#include <atomic>

namespace pulson {

/// While one lives, integrate() and contraction_bound() call `check` before each step, on the thread that takes it;
/// what it throws ends them. One at a time.
class StepWatch {
 public:
  explicit StepWatch(void (*check)()) { current = check; }
  ~StepWatch() { current = nullptr; }
  StepWatch(const StepWatch&) = delete;
  StepWatch& operator=(const StepWatch&) = delete;

  static void before_step() {
    if (void (*const check)() = current.load(std::memory_order_relaxed); check != nullptr) check();
  }

 private:
  static inline std::atomic<void (*)()> current{nullptr};
};

}  // namespace pulson
