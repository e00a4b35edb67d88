#include "defaults.hpp"

namespace pulson::matching {
namespace {

constexpr std::size_t kRegister = 0, kSample = 1, kSampleCohort = 2, kSampleTree = 3, kCompare = 4, kAtlas = 5,
                      kPaths = 6;

std::vector<TaskDefaults> make_table() {
  const Default automatic{"auto"}, none{};
  const Default one_error{"0.5%"};
  const Default heun{"heun", "explicit: where paths bend no draw is lost, as no step searches for a root"};
  const Default fitted{"fit", "several shapes determine it"};
  TaskDefaults pair{"register", automatic, one_error, automatic, automatic, {"20"}, none, automatic};
  TaskDefaults posterior = pair;
  posterior.task = "sample, one target";
  posterior.integrator = heun;
  posterior.steps = {"auto", "so many that log p(y) is within 0.02 of the limit of fine steps"};
  TaskDefaults cohort = posterior;
  cohort.task = "sample, several targets";
  cohort.kernel = {"auto:alpha=fit", "several shapes determine its width"};
  cohort.sigma = fitted;
  cohort.lambda = fitted;
  TaskDefaults tree = posterior;
  tree.task = "sample of a tree";
  tree.kernel.reason = "matern32:alpha=auto: no target is matched, whose likelihood would choose";
  tree.sigma = fitted;
  tree.align = {"none", "position and size are taken to evolve, too"};
  const TaskDefaults comparison{
      "compare",
      {"gaussian:alpha=fit", "each model has its own width, from one family, so that they are compared by their noise"},
      fitted,
      fitted,
      heun,
      {"auto", "so many that the ends are exact to a tenth of sigma"},
      none,
      {"auto", "similarity about a mean, else none"}};
  const TaskDefaults atlas{"atlas",
                           automatic,
                           fitted,
                           fitted,
                           {"rk4", "of order 4: geodesics have no noise, and ten steps do"},
                           {"10", "see the integrator"},
                           none,
                           automatic};
  const TaskDefaults paths{"simulate, ensemble",
                           {"gaussian:alpha=auto", "no target is matched, whose likelihood would choose"},
                           none,
                           none,
                           {"variational", "the paper's (20), compensated: symplectic, for the paper's ensembles"},
                           none,
                           {"0.02", "the paper's time step"},
                           none};
  return {pair, posterior, cohort, tree, comparison, atlas, paths};
}

const TaskDefaults& row(std::size_t index) { return default_table()[index]; }

}  // namespace

const std::vector<TaskDefaults>& default_table() {
  static const std::vector<TaskDefaults> table = make_table();
  return table;
}

const std::vector<DefaultColumn>& default_columns() {
  static const std::vector<DefaultColumn> columns = {
      {"kernel", &TaskDefaults::kernel}, {"sigma", &TaskDefaults::sigma},
      {"lambda", &TaskDefaults::lambda}, {"integrator", &TaskDefaults::integrator},
      {"steps", &TaskDefaults::steps},   {"dt", &TaskDefaults::dt},
      {"align", &TaskDefaults::align}};
  return columns;
}

const TaskDefaults& register_defaults() { return row(kRegister); }
const TaskDefaults& sample_defaults() { return row(kSample); }
const TaskDefaults& sample_cohort_defaults() { return row(kSampleCohort); }
const TaskDefaults& sample_tree_defaults() { return row(kSampleTree); }
const TaskDefaults& compare_defaults() { return row(kCompare); }
const TaskDefaults& atlas_defaults() { return row(kAtlas); }
const TaskDefaults& path_defaults() { return row(kPaths); }

}  // namespace pulson::matching
