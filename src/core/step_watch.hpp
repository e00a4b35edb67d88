#pragma once

#include <atomic>

namespace pulson {

/// While one lives, integrate() and contraction_bound() call `check` before each step and parallel_for() before each
/// task, on the thread that takes it; what it throws ends them. One that begins meanwhile takes over from it.
class StepWatch {
 public:
  explicit StepWatch(void (*check)()) : before_(current.exchange(check)) {}
  ~StepWatch() { current = before_; }
  StepWatch(const StepWatch&) = delete;
  StepWatch& operator=(const StepWatch&) = delete;

  static void before_step() {
    if (of_thread != nullptr) {
      of_thread();
    } else if (void (*const check)() = current.load(std::memory_order_relaxed); check != nullptr) {
      check();
    }
    if (failed != nullptr && failed->load(std::memory_order_relaxed)) throw TaskEnded();
  }

  /// The same on the thread that it was made on, in place of that.
  class OfThread {
   public:
    explicit OfThread(void (*check)()) : before_(of_thread) { of_thread = check; }
    ~OfThread() { of_thread = before_; }
    OfThread(const OfThread&) = delete;
    OfThread& operator=(const OfThread&) = delete;

   private:
    void (*before_)();
  };

  /// While one lives, what this thread works on ends at its next step where another task has failed.
  class OfTask {
   public:
    explicit OfTask(const std::atomic<bool>& another_failed) : before_(failed) { failed = &another_failed; }
    ~OfTask() { failed = before_; }
    OfTask(const OfTask&) = delete;
    OfTask& operator=(const OfTask&) = delete;

   private:
    const std::atomic<bool>* before_;
  };

 private:
  struct TaskEnded {};  // its task's exception is another's

  void (*before_)();
  static inline std::atomic<void (*)()> current{nullptr};
  static inline thread_local void (*of_thread)() = nullptr;
  static inline thread_local const std::atomic<bool>* failed = nullptr;
};

}  // namespace pulson
