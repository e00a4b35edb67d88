#pragma once

#include <iterator>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "pulson/integrators/integrator.hpp"

namespace pulson::records {

/// Header fields `,prefix_x,prefix_y` for d axes.
std::string axis_names(std::string_view prefix, Eigen::Index d);

/// Header fields of a state: `,q_x,…,p_x,…`.
std::string state_names(Eigen::Index d);

/// `,value` for each.
template <class Column>
void append_values(std::string& text, const Column& column) {
  for (const double value : column) fmt::format_to(std::back_inserter(text), ",{}", value);
}

/// Rows `first step,time,landmark,q…,p…`: every `every`-th step of a path, and its last.
void append_states(std::string& text, const Trajectory& path, std::string_view first, int every,
                   const std::vector<int>& numbers = {});

}  // namespace pulson::records
