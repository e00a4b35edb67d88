#pragma once

#include <cstddef>
#include <cstdint>

namespace pulson {

/// Numbers for `count` neighbouring counters, one per lane, at steps 4·block + 0 … rows − 1: row s goes to
/// out[s·stride + 0 … count − 1].
struct NormalBatch {
  enum class Over { kPaths, kChannels };
  Over over = Over::kPaths;
  std::uint64_t seed = 0;
  std::uint64_t path = 0;  ///< the first, where it runs over paths
  std::uint32_t block = 0;
  std::uint32_t channel = 0;  ///< the first, where it runs over channels
  std::size_t count = 0;
  std::size_t rows = 4;
  std::size_t stride = 0;
  double* out = nullptr;
};

void fill_normals(const NormalBatch& batch);

}  // namespace pulson
