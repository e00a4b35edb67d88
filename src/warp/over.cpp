#include "pulson/core/name_table.hpp"
#include "pulson/warp/mesh_raster.hpp"

namespace pulson {
namespace {

constexpr EnumNames<Over, 4> kRules = {"rule for what is on top",
                                       {{{"least-stretched", Over::kLeastStretched},
                                         {"average", Over::kAverage},
                                         {"first", Over::kFirst},
                                         {"label-order", Over::kPriority}}}};

}  // namespace

Over parse_over(std::string_view name) { return kRules.parse(name); }

std::string over_name(Over over) { return kRules.name(over); }

}  // namespace pulson
