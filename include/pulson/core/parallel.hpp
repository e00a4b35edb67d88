#pragma once

#include <functional>

namespace pulson {

/// Threads that `parallel_for` may use; 0, the default, means one per core.
void set_thread_count(int count);
/// How many there are: no more than the cores that the process may run on (its CPU affinity).
int thread_count();

/// Runs task(0) … task(count−1), each once, on up to thread_count() threads, and returns when all are done. Tasks are
/// independent pieces of a fixed partition, so a result that each task writes to its own location has the same bits for
/// any number of threads. Called from inside a task it uses the threads that have no task, too; while it waits, its
/// thread takes no others than its own. The first exception of a task is rethrown.
void parallel_for(int count, const std::function<void(int)>& task);

/// While one lives, BLAS computes on the thread that calls it: threads are pulson's to share out, and products of
/// matrices have the same bits whatever number of threads BLAS was given. parallel_for() and the long computations of
/// the library hold one. BLAS keeps that number for the whole process, so the last one to go restores what the first
/// one found. Thread-safe.
class SerialBlas {
 public:
  SerialBlas();
  ~SerialBlas();
  SerialBlas(const SerialBlas&) = delete;
  SerialBlas& operator=(const SerialBlas&) = delete;

 private:
  bool counted_;
};

}  // namespace pulson
