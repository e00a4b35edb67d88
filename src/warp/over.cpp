#include "pulson/core/name_table.hpp"
#include "warp/mesh_raster.hpp"

namespace pulson {
namespace {

constexpr EnumNames<SheetOrder, 4> kRules = {"rule for what is on top",
                                             {{{"least-stretched", SheetOrder::kLeastStretched},
                                               {"average", SheetOrder::kAverage},
                                               {"first", SheetOrder::kFirst},
                                               {"label-order", SheetOrder::kPriority}}}};

}  // namespace

SheetOrder parse_over(std::string_view name) { return kRules.parse(name); }

std::string over_name(SheetOrder over) { return kRules.name(over); }

}  // namespace pulson
