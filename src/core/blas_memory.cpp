#include "blas_memory.hpp"

#include <cstdint>
#include <cstdio>
#include <vector>

#include <cblas.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

// Exported by OpenBLAS, without a header.
extern "C" {
void* blas_memory_alloc(int kind);
void blas_memory_free(void* buffer);
}

namespace pulson {

namespace {

constexpr std::uint64_t kBuffer = 128ULL << 20;    // BUFFER_SIZE of OpenBLAS 0.3 on x86-64
constexpr std::uint64_t kPerThread = 72ULL << 20;  // a stack of 8 MiB, and the 64 MiB that glibc maps for its heap
constexpr std::uint64_t kOfRun = 128ULL << 20;     // small shapes with their pictures take half of that

/// Bytes that are mapped; 0 where that is not known.
std::uint64_t mapped_bytes() {
  std::FILE* const file = std::fopen("/proc/self/statm", "re");
  if (file == nullptr) return 0;
  unsigned long long pages = 0;
  const bool is_read = std::fscanf(file, "%llu", &pages) == 1;
  std::fclose(file);
  return is_read ? pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) : 0;
}

}  // namespace

void reserve_blas_memory() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
  const auto threads = static_cast<std::uint64_t>(thread_count());
  const std::uint64_t needed = mapped_bytes() + threads * (kBuffer + kPerThread) + kOfRun;
  if (limit.rlim_cur < needed)
    throw InputError(fmt::format("the limit of memory (ulimit -v) is {} kB; {} kB are needed for {} threads: raise it",
                                 limit.rlim_cur / 1024, needed / 1024, threads));
  std::vector<void*> buffers;
  for (std::uint64_t i = 0; i < threads; ++i) buffers.push_back(blas_memory_alloc(0));
  for (void* buffer : buffers) blas_memory_free(buffer);
}

}  // namespace pulson
