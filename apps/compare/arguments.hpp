#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pulson/compare/comparison.hpp"
#include "shell/options.hpp"
#include "shell/outputs.hpp"
#include "shell/units.hpp"

namespace pulson {

/// What is compared where no model is named.
std::vector<std::string> usual_noises();

struct CompareArguments {
  std::vector<std::string> shapes;
  std::vector<std::string> noises;
  std::optional<std::string> source;
  formats::ReadOptions reading;
  bool by_order = false;
  std::string kernel = "gaussian:alpha=fit";
  std::string align = "auto";
  std::string evidence = "importance";
  std::string sigma = "auto";
  std::string lambda = "fit";
  compare::CompareOptions options;
  bool no_maps = false;
  bool merge_coincident = false;
  std::vector<std::string> simulate;
  std::optional<double> true_lambda;
  std::string true_kernel;
  int count = 20;
  std::optional<int> cohort_size;
  TimeOptions time{.time = {}, .automatic = true, .dt = {}};
  UnitOptions units;  ///< of --simulate
  OutputOptions output;

  void add_to(CLI::App& verb);

  /// The shapes, and notes about them. @throws InputError
  compare::CohortShapes read(std::vector<std::string>& notes) const;
  /// What the options say of these shapes.
  compare::CompareOptions compare_options(const compare::CohortShapes& shapes, std::vector<std::string>& notes) const;

 private:
  compare::CompareOptions options_about(const Landmarks& source, std::vector<std::string>& notes) const;
};

}  // namespace pulson
