#include "audit_warnings.hpp"

#include <algorithm>
#include <optional>

#include <fmt/core.h>

#include "audit/audit.hpp"
#include "messages.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson {

void warn_of_pair(const Landmarks& reference, const Landmarks& shape) {
  const std::optional<audit::Finding> found = audit::audit_pair(reference, shape);
  if (found && found->problem != audit::Problem::kMirrored)
    print_warning(fmt::format("{}: {}", shape.source, describe(*found, shape)));
}

void warn_of_cohort(std::vector<Landmarks> shapes) {
  if (shapes.empty()) return;
  constexpr std::size_t kMost = 10;
  const int count = shapes.front().count();
  std::erase_if(shapes, [count](const Landmarks& shape) { return shape.count() != count; });
  const std::vector<audit::Finding> found = audit::audit_cohort(shapes);
  for (std::size_t i = 0; i < std::min(found.size(), kMost); ++i) {
    const Landmarks& shape = shapes[static_cast<std::size_t>(found[i].specimen)];
    print_warning(
        fmt::format("specimen {} ({}): {}", quoted_line(shape.name), shape.source, describe(found[i], shape)));
  }
  if (found.size() > kMost)
    print_warning(fmt::format("landmarks of {} more specimens look wrong", found.size() - kMost));
}

}  // namespace pulson
