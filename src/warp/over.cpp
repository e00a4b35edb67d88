#include <algorithm>

#include "pulson/core/name_table.hpp"
#include "pulson/warp/mesh_raster.hpp"

namespace pulson {
namespace {

const NameTable<SheetOrder>& over_table() {
  static const NameTable<SheetOrder> table(
      "rule for what is on top", {{"least-stretched",
                                   {},
                                   "orientation-preserving first, then the least stretched sheet",
                                   SheetOrder::kLeastStretched},
                                  {"average", {}, "the mean of all sheets", SheetOrder::kAverage},
                                  {"first", {}, "the first in row-by-row order of the source", SheetOrder::kFirst},
                                  {"label-order",
                                   {},
                                   "by the order of labels of the source, then the least stretched sheet",
                                   SheetOrder::kPriority}});
  return table;
}

}  // namespace

SheetOrder parse_over(std::string_view name) { return over_table().find(name).make; }

std::string over_name(SheetOrder over) {
  const auto& rows = over_table().rows();
  return std::find_if(rows.begin(), rows.end(), [over](const auto& row) { return row.make == over; })->name;
}

}  // namespace pulson
