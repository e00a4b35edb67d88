#include "pulson/core/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include <cblas.h>

namespace pulson {
namespace {

std::atomic<int> requested_threads{0};
thread_local bool inside_task = false;

// Threads are ours to share out: products of matrices inside a task run on its own.
[[maybe_unused]] const bool kBlasIsSerial = (openblas_set_num_threads(1), true);

}  // namespace

void set_thread_count(int count) { requested_threads = std::max(count, 0); }

int thread_count() {
  const int requested = requested_threads;
  return requested > 0 ? requested : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void parallel_for(int count, const std::function<void(int)>& task) {
  const int threads = inside_task ? 1 : std::min(thread_count(), count);
  if (threads <= 1) {
    for (int i = 0; i < count; ++i) task(i);
    return;
  }
  std::atomic<int> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto work = [&] {
    inside_task = true;
    for (int i = next++; i < count; i = next++) {
      try {
        task(i);
      } catch (...) {
        const std::lock_guard lock(failure_mutex);
        if (!failure) failure = std::current_exception();
        next = count;
      }
    }
    inside_task = false;
  };
  {
    std::vector<std::jthread> helpers;
    for (int t = 1; t < threads; ++t) helpers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace pulson
