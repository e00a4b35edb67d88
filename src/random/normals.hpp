#pragma once

#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

namespace pulson {

/// Standard normal numbers as a pure function of (seed, path, step, channel): no state is kept between calls, so
/// order, batches and threads change no bit.
///
/// Philox4x32-10 (J. Salmon, M. Moraes, R. Dror, D. Shaw, "Parallel random numbers: as easy as 1, 2, 3", 2011) with the
/// key (seed low, seed high) maps the counter (path low, path high, step / 4, channel) to words x₀ … x₃. The numbers of
/// the block's first two steps are
///
///     ±√(−2 ln u) cos θ, ±√(−2 ln u) sin θ,   u = (x₀ + ½)/2³², θ = (π/2)(⌊x₁/4⌋ + ½)/2³⁰
///
/// with bits 1 and 0 of x₁ for the signs (1 is minus) (G. Box, M. Muller, 1958); x₂ and x₃ give the last two. So
/// |normal| < 6.77, and the distribution is symmetric. Rounding is below 1e-15·√(−2 ln u). The code is vectorised with
/// run-time dispatch (SSE4, AVX2, AVX-512): a number has the same bits in every batch of one machine, and agrees
/// between vector instruction sets within rounding.
///
/// @return channels×steps. Thread-safe.
Eigen::MatrixXd standard_normals(std::uint64_t seed, std::uint64_t path, int channels, int steps);

/// The numbers of `paths` neighbouring paths in one channel and one block of four steps:
/// out[s·paths + i] is the number of (seed, first_path + i, 4·block + s, channel), s = 0 … 3.
/// @param block below 2³⁰ @param out room for 4·paths numbers
void fill_standard_normals(std::uint64_t seed, std::uint64_t first_path, std::size_t paths, std::uint32_t block,
                           std::uint32_t channel, double* out);

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
