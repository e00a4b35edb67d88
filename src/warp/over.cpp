#include <algorithm>

#include "pulson/core/name_table.hpp"
#include "pulson/warp/mesh_raster.hpp"

namespace pulson {
namespace {

const NameTable<Over>& over_table() {
  static const NameTable<Over> table(
      "rule for what is on top",
      {{"least-stretched", {}, "orientation-preserving first, then the least stretched sheet", Over::kLeastStretched},
       {"average", {}, "the mean of all sheets", Over::kAverage},
       {"first", {}, "the first in row-by-row order of the source", Over::kFirst},
       {"label-order", {}, "by the order of labels of the source, then the least stretched sheet", Over::kPriority}});
  return table;
}

}  // namespace

Over parse_over(std::string_view name) { return over_table().find(name).make; }

std::string over_name(Over over) {
  const auto& rows = over_table().rows();
  return std::find_if(rows.begin(), rows.end(), [over](const auto& row) { return row.make == over; })->name;
}

}  // namespace pulson
