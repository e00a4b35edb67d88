#include "determined.hpp"

#include <algorithm>

#include <fmt/core.h>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {

void require_determined_parameters(std::string_view what, Eigen::Index parameters, Eigen::Index coordinates,
                                   std::string_view remedy) {
  if (parameters == 0 || parameters < coordinates) return;
  const Eigen::Index observed = std::max<Eigen::Index>(coordinates, 0);
  throw InputError(fmt::format("{} undetermined: there {} {}, and {} {} observed beyond the alignment; {}", what,
                               parameters == 1 ? "is" : "are",
                               io::counted(static_cast<std::size_t>(parameters), "parameter"),
                               observed == 0 ? "no" : io::counted(static_cast<std::size_t>(observed), "coordinate"),
                               observed == 0   ? "coordinate is"
                               : observed == 1 ? "is"
                                               : "are",
                               remedy));
}

}  // namespace pulson
