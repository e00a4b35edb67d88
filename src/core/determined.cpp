#include "determined.hpp"

#include <algorithm>

#include <fmt/core.h>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {

void require_determined_parameters(std::string_view what, Eigen::Index parameters, Eigen::Index coordinates,
                                   std::string_view remedy) {
  if (parameters == 0 || parameters < coordinates) return;
  const Eigen::Index left = std::max<Eigen::Index>(coordinates, 0);
  throw InputError(fmt::format("{} undetermined: there {} {}, and {} {} to determine {}; {}", what,
                               parameters == 1 ? "is" : "are",
                               text::counted(static_cast<std::size_t>(parameters), "parameter"), left,
                               left == 1 ? "coordinate" : "coordinates", parameters == 1 ? "it" : "them", remedy));
}

}  // namespace pulson
