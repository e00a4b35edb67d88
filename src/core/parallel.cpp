#include "pulson/core/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <memory>
#include <mutex>
#include <utility>

#include <cblas.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include "core/step_watch.hpp"

namespace pulson {
namespace {

using oneapi::tbb::task_arena;

std::atomic<int> requested_threads{0};
thread_local bool inside_task = false;

// Of SerialBlas.
std::mutex blas_mutex;
int blas_holders = 0;
int blas_threads_before = 1;

// The cores that the process may run on, or fewer where a user of the library limits TBB.
int available_threads() {
  using oneapi::tbb::global_control;
  return static_cast<int>(global_control::active_value(global_control::max_allowed_parallelism));
}

// The arena of the last call, which the next takes where it may use as many threads: to end one, TBB waits until its
// threads have left it.
std::shared_ptr<task_arena> arena_of(int threads) {
  static std::mutex mutex;
  static auto* last = new std::shared_ptr<task_arena>();  // lives as long as TBB's threads
  const std::lock_guard lock(mutex);
  if (*last == nullptr || (*last)->max_concurrency() != threads) *last = std::make_shared<task_arena>(threads);
  return *last;
}

}  // namespace

void set_thread_count(int count) { requested_threads = std::max(count, 0); }

int thread_count() {
  const int requested = requested_threads;
  return requested > 0 ? std::min(requested, available_threads()) : available_threads();
}

// A task needs no count of its own: parallel_for() holds one until all tasks are done.
SerialBlas::SerialBlas() : counted_(!inside_task) {
  if (!counted_) return;
  const std::lock_guard lock(blas_mutex);
  if (blas_holders++ > 0) return;
  blas_threads_before = openblas_get_num_threads();
  if (blas_threads_before != 1) openblas_set_num_threads(1);
}

SerialBlas::~SerialBlas() {
  if (!counted_) return;
  const std::lock_guard lock(blas_mutex);
  if (--blas_holders > 0) return;
  if (blas_threads_before != 1) openblas_set_num_threads(blas_threads_before);
}

void parallel_for(int count, const std::function<void(int)>& task) {
  const SerialBlas serial;
  const int threads = thread_count();
  const auto run = [&](int i) {
    StepWatch::before_step();
    task(i);
  };
  if (std::min(threads, count) <= 1) {
    for (int i = 0; i < count; ++i) run(i);
    return;
  }
  std::atomic<bool> failed = false;
  std::exception_ptr first;  // of them; the others are ended by it
  const auto share_out = [&] {
    oneapi::tbb::parallel_for(
        oneapi::tbb::blocked_range<int>(0, count, 1),
        [&](const oneapi::tbb::blocked_range<int>& range) {
          const bool was_inside = std::exchange(inside_task, true);
          try {
            const StepWatch::OfTask watch(failed);
            for (int i = range.begin(); i < range.end(); ++i) run(i);
          } catch (...) {
            if (!failed.exchange(true)) first = std::current_exception();
          }
          inside_task = was_inside;
        },
        oneapi::tbb::simple_partitioner());
  };
  // Isolated, as a task that waits for its own must not take up another beside itself: that would find this one's
  // memory of the thread in use.
  if (inside_task)
    oneapi::tbb::this_task_arena::isolate(share_out);
  else
    arena_of(threads)->execute(share_out);
  if (first) std::rethrow_exception(first);
}

}  // namespace pulson
