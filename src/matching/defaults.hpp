#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace pulson::matching {

/// A default as its option takes it, and why it is not that of `register`; no value where there is no such option.
struct Default {
  std::string value;
  std::string reason{};
};

/// What the options of a task are where they are not given.
struct TaskDefaults {
  std::string task;  ///< a verb, or a use of it
  Default kernel, sigma, lambda, integrator, steps, dt, align;
};

/// A setting by its name, which that of its option begins with.
struct DefaultColumn {
  std::string_view name;
  Default TaskDefaults::*setting;
};

/// All of them, for `pulson info defaults`: no verb has others.
const std::vector<TaskDefaults>& default_table();
const std::vector<DefaultColumn>& default_columns();

/// A row of the table.
const TaskDefaults& register_defaults();
const TaskDefaults& sample_defaults();         ///< of one target
const TaskDefaults& sample_cohort_defaults();  ///< of several
const TaskDefaults& sample_tree_defaults();
const TaskDefaults& compare_defaults();
const TaskDefaults& atlas_defaults();
const TaskDefaults& path_defaults();  ///< of `simulate` and `ensemble`

}  // namespace pulson::matching
