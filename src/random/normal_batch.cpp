// Compiled once per vector target by foreach_target.h; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "normal_batch.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
#include "normals.hpp"
#include "normal_lanes_body.hpp"
// clang-format on

// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson {
namespace HWY_NAMESPACE {

// Stores the first lanes of a vector.
HWY_INLINE void StorePart(NormalLanes::Vector vector, std::size_t lanes, double* to) {
  HWY_ALIGN double buffer[hn::MaxLanes(NormalLanes::Tag())];
  hn::Store(vector, NormalLanes::Tag(), buffer);
  for (std::size_t lane = 0; lane < lanes; ++lane) to[lane] = buffer[lane];
}

// One block of steps: `rows` of its four rows, from `out` on.
class BlockFill {
 public:
  HWY_INLINE BlockFill(const NormalBatch& batch, std::uint32_t block, std::size_t rows, double* out)
      : batch_(batch), rows_(rows), out_(out) {
    const NormalLanes::Words index = hn::Iota(NormalLanes::WordTag(), 0);
    const NormalLanes::Words zero = hn::Zero(NormalLanes::WordTag());
    const bool over_paths = batch.over == NormalBatch::Over::kPaths;
    first_.path = hn::Add(NormalLanes::Word(batch.path), over_paths ? index : zero);
    first_.block = NormalLanes::Word(block);
    first_.channel = hn::Add(NormalLanes::Word(batch.channel), over_paths ? zero : index);
    path_step_ = over_paths ? 1 : 0;
  }

  // The columns from i on, as many as n vectors hold or as there are.
  template <int n>
  HWY_INLINE void Columns(const NormalLanes& lanes, std::size_t i) const {
    const std::size_t width = hn::Lanes(NormalLanes::Tag());
    NormalLanes::Counter counters[n];
    NormalLanes::Vector normals[n][4];
    for (int v = 0; v < n; ++v) {
      const std::size_t offset = i + v * width;
      counters[v].path = hn::Add(first_.path, NormalLanes::Word(offset * path_step_));
      counters[v].block = first_.block;
      counters[v].channel = hn::Add(first_.channel, NormalLanes::Word(offset * (1 - path_step_)));
    }
    lanes.Draw(counters, normals);
    for (int v = 0; v < n; ++v, i += width)
      for (std::size_t row = 0; row < rows_; ++row) {
        double* to = out_ + row * batch_.stride + i;
        if (i + width <= batch_.count)
          hn::StoreU(normals[v][row], NormalLanes::Tag(), to);
        else
          StorePart(normals[v][row], batch_.count - i, to);
      }
  }

 private:
  const NormalBatch& batch_;
  std::size_t rows_;
  double* out_;
  NormalLanes::Counter first_;
  std::size_t path_step_;
};

void FillNormals(const NormalBatch& batch) {
  const NormalLanes lanes(batch.seed);
  const std::size_t width = hn::Lanes(NormalLanes::Tag());
  for (std::size_t row = 0; row < batch.rows; row += 4) {
    const BlockFill fill(batch, batch.block + static_cast<std::uint32_t>(row / 4), HWY_MIN(batch.rows - row, 4),
                         batch.out + row * batch.stride);
    std::size_t i = 0;
    for (; i + width < batch.count; i += 2 * width) fill.Columns<2>(lanes, i);
    for (; i < batch.count; i += width) fill.Columns<1>(lanes, i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#if HWY_ONCE

namespace pulson {

HWY_EXPORT(FillNormals);

void fill_normals(const NormalBatch& batch) { HWY_DYNAMIC_DISPATCH(FillNormals)(batch); }

}  // namespace pulson

#endif  // HWY_ONCE
