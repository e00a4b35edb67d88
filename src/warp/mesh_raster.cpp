#include "warp/mesh_raster.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "band_writers.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::warp {

void DeformedMesh::check() const {
  const std::string size = std::to_string(columns) + " x " + std::to_string(rows);
  if (columns < 2 || rows < 2) throw InputError("mesh of " + size + " vertices: at least 2 x 2 are needed");
  if (vertices.size() != static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows))
    throw InputError("mesh of " + size + " vertices has " + std::to_string(vertices.size()) + " of them");
}

std::vector<SplitCell>::const_iterator DeformedMesh::split_from(int column, int row) const {
  return std::partition_point(split.begin(), split.end(), [&](const SplitCell& cell) {
    return cell.row < row || (cell.row == row && cell.column < column);
  });
}

namespace {

constexpr int kCellsPerBlock = 32;
constexpr int kMaxSupersampling = 8;
constexpr int kMaxSamples = 1 << 18;  // in a row or a column

void check_output(const RasterOptions& options) {
  if (options.width < 1 || options.height < 1)
    throw InputError("output of " + std::to_string(options.width) + " x " + std::to_string(options.height) +
                     " pixels: sizes must be positive");
  if (options.supersampling < 1 || options.supersampling > kMaxSupersampling)
    throw InputError("supersampling " + std::to_string(options.supersampling) + " is not between 1 and " +
                     std::to_string(kMaxSupersampling));
  if (std::max(options.width, options.height) > kMaxSamples / options.supersampling)
    throw InputError("output of " + std::to_string(options.width) + " x " + std::to_string(options.height) +
                     " pixels: with supersampling " + std::to_string(options.supersampling) + " at most " +
                     std::to_string(kMaxSamples / options.supersampling) + " a side");
  if (options.rows_per_band < 0)
    throw InputError("rows per band " + std::to_string(options.rows_per_band) + " must not be negative");
}

void check_priority(std::span<const float> priority, SheetOrder over, std::size_t cells) {
  const std::size_t expected = over == SheetOrder::kPriority ? cells : 0;
  if (priority.size() != expected)
    throw InputError(std::to_string(priority.size()) + " priorities of cells: " + over_name(over) + " takes " +
                     std::to_string(expected));
  if (std::any_of(priority.begin(), priority.end(), [](float value) { return std::isnan(value); }))
    throw InputError("priorities of cells must be numbers");
}

int rows_per_band(const RasterOptions& options) {
  constexpr int kSamplesPerBand = 1 << 18;  // with their scratch they fit a core's cache
  const std::int64_t row = std::int64_t{options.width} * options.supersampling * options.supersampling;
  const int rows = options.rows_per_band > 0 ? options.rows_per_band : static_cast<int>(kSamplesPerBand / row);
  return std::clamp(rows, 1, options.height);
}

}  // namespace

MeshRaster::MeshRaster(DeformedMesh mesh, const RasterOptions& options, std::vector<float> priority)
    : MeshRaster(std::make_shared<const DeformedMesh>(std::move(mesh)), options, std::move(priority)) {}

MeshRaster MeshRaster::for_counts() const {
  constexpr int kCounted = 2;
  RasterOptions options = options_;
  options.supersampling = std::min(kCounted, kMaxSamples / std::max(options.width, options.height));
  options.over = SheetOrder::kFirst;
  return {mesh_, options, {}};
}

MeshRaster::MeshRaster(std::shared_ptr<const DeformedMesh> mesh, const RasterOptions& options,
                       std::vector<float> priority)
    : mesh_(std::move(mesh)), options_(options), priority_(std::move(priority)) {
  mesh_->check();
  check_output(options_);
  check_priority(priority_, options_.over, as_index(mesh_->cell_columns()) * as_index(mesh_->cell_rows()));
  options_.rows_per_band = rows_per_band(options_);
  blocks_per_row_ = (mesh_->cell_columns() + kCellsPerBlock - 1) / kCellsPerBlock;
  block_rows_.resize(as_index(blocks_per_row_) * as_index(mesh_->cell_rows()));
  parallel_for(mesh_->cell_rows(), [&](int row) {
    for (int block = 0; block < blocks_per_row_; ++block)
      block_rows_[as_index(row) * as_index(blocks_per_row_) + as_index(block)] = rows_of_block(block, row);
  });
}

int MeshRaster::bands() const { return (options_.height + options_.rows_per_band - 1) / options_.rows_per_band; }

RasterBand MeshRaster::band(int index) const {
  RasterBand band = empty_band(index);
  TopSheetWriter writer(band, options_.over);
  write_cells(writer);
  return band;
}

RasterBand MeshRaster::sheet(int index, int n) const {
  if (n < 0 || n >= kMaxSheets)
    throw InputError("sheet " + std::to_string(n) + " is not between 0 and " + std::to_string(kMaxSheets - 1));
  RasterBand band = empty_band(index);
  NthSheetWriter writer(band, n);
  write_cells(writer);
  return band;
}

RasterBand MeshRaster::empty_band(int index) const {
  if (index < 0 || index >= bands())
    throw InputError("band " + std::to_string(index) + " is not between 0 and " + std::to_string(bands() - 1));
  RasterBand band;
  band.first_row = index * options_.rows_per_band;
  band.rows = std::min(options_.rows_per_band, options_.height - band.first_row);
  band.width = options_.width;
  band.supersampling = options_.supersampling;
  const std::size_t samples =
      as_index(band.rows) * as_index(band.width) * as_index(band.supersampling) * as_index(band.supersampling);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  band.labels.assign(samples, {nan, nan});
  band.counts.assign(samples, 0);
  band.reversed.assign(samples, 0);
  return band;
}

bool MeshRaster::is_of_block(std::vector<SplitCell>::const_iterator cell, int row, int end) const {
  return cell != mesh_->split.end() && cell->row == row && cell->column < end;
}

MeshRaster::SampleRows MeshRaster::rows_of_block(int block, int row) const {
  constexpr std::int32_t kLargest = std::numeric_limits<std::int32_t>::max() / 2;
  FixedPoint low = {kLargest, kLargest};
  FixedPoint high = {-kLargest, -kLargest};
  const int begin = block * kCellsPerBlock;
  const int end = std::min(begin + kCellsPerBlock, mesh_->cell_columns());
  const auto add = [&](const std::array<float, 2>& place) {
    const FixedPoint vertex = snapped(place, options_.supersampling);
    if (!vertex.is_valid()) return;
    low = {std::min(low.x, vertex.x), std::min(low.y, vertex.y)};
    high = {std::max(high.x, vertex.x), std::max(high.y, vertex.y)};
  };
  for (int r = row; r <= row + 1; ++r)
    for (int column = begin; column <= end; ++column) add(mesh_->at(column, r));
  for (auto cell = mesh_->split_from(begin, row); is_of_block(cell, row, end); ++cell)
    for (const MeshTriangle& triangle : cell->triangles)
      for (const auto& place : triangle.places) add(place);
  if (last_sample(high.x) < 0 || first_sample(low.x) >= options_.width * options_.supersampling) return {0, -1};
  return {first_sample(low.y), last_sample(high.y)};
}

template <class Writer>
void MeshRaster::write_cells(Writer& writer) const {
  const SampleBox window = writer.window();
  const SampleRows* rows = block_rows_.data();
  for (int row = 0; row < mesh_->cell_rows(); ++row)
    for (int block = 0; block < blocks_per_row_; ++block, ++rows)
      if (rows->first <= window.bottom && rows->last >= window.top && rows->first <= rows->last)
        write_block(writer, block, row);
}

template <class Writer>
void MeshRaster::write_block(Writer& writer, int block, int row) const {
  const int begin = block * kCellsPerBlock;
  const int end = std::min(begin + kCellsPerBlock, mesh_->cell_columns());
  std::array<std::array<FixedPoint, kCellsPerBlock + 1>, 2> vertices;
  for (int r = 0; r < 2; ++r)
    for (int column = begin; column <= end; ++column)
      vertices[as_index(r)][as_index(column - begin)] = snapped(mesh_->at(column, row + r), options_.supersampling);
  auto split = mesh_->split_from(begin, row);
  for (int column = begin; column < end; ++column) {
    const float priority =
        priority_.empty() ? 0 : priority_[as_index(row) * as_index(mesh_->cell_columns()) + as_index(column)];
    if (is_of_block(split, row, end) && split->column == column) {
      write_split(writer, *split++, priority);
      continue;
    }
    const std::size_t left = as_index(column - begin);
    const auto corner = [&](const std::array<int, 2>& offset) -> const FixedPoint& {
      return vertices[as_index(offset[1])][left + as_index(offset[0])];
    };
    if (!(corner({0, 0}).is_valid() && corner({1, 0}).is_valid() && corner({0, 1}).is_valid() &&
          corner({1, 1}).is_valid()))
      continue;
    for (std::size_t triangle = 0; triangle < 2; ++triangle) {
      const auto& [a, b, c] = kCellTriangles[triangle];
      const TriangleSamples samples({corner(a), corner(b), corner(c)}, writer.window());
      if (!samples.is_empty()) writer.write(samples, LabelMap(column, row, triangle), priority);
    }
  }
}

template <class Writer>
void MeshRaster::write_split(Writer& writer, const SplitCell& cell, float priority) const {
  for (const MeshTriangle& triangle : cell.triangles) {
    std::array<FixedPoint, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) corners[i] = snapped(triangle.places[i], options_.supersampling);
    if (!(corners[0].is_valid() && corners[1].is_valid() && corners[2].is_valid())) continue;
    const TriangleSamples samples(corners, writer.window());
    if (!samples.is_empty()) writer.write(samples, LabelMap(triangle), priority);
  }
}

}  // namespace pulson::warp
