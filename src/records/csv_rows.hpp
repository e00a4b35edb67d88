#pragma once

#include <string_view>
#include <vector>

#include "core/csv_table.hpp"
#include "pulson/integrators/integrator.hpp"

namespace pulson::records {

/// Header cells `prefix_x,prefix_y` for d axes.
void add_axis_names(text::CsvTable& table, std::string_view prefix, Eigen::Index d);

/// Header cells of a state: `q_x,…,p_x,…`.
void add_state_names(text::CsvTable& table, Eigen::Index d);

/// Rows `first,step,time,landmark,q…,p…`: every `every`-th step of a path, and its last. `first` are cells that begin
/// each row; empty: none.
void add_states(text::CsvTable& table, const Trajectory& path, std::string_view first, int every,
                const std::vector<int>& numbers = {});

}  // namespace pulson::records
