#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pulson/compare/comparison.hpp"
#include "shell/loss_options.hpp"
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
  std::string kernel = matching::compare_defaults().kernel.value;
  std::string align = matching::compare_defaults().align.value;
  std::string evidence = "importance";
  std::optional<std::string> sigma;
  std::string lambda = matching::compare_defaults().lambda.value;
  LossOptions loss;
  compare::CompareOptions options;
  bool no_maps = false;
  bool merge_coincident = false;
  std::vector<std::string> simulate;
  std::optional<double> true_lambda;
  std::string true_kernel;
  int count = 20;
  std::optional<int> cohort_size;
  TimeOptions time = TimeOptions::of(matching::compare_defaults());
  UnitOptions units;  ///< of --simulate
  OutputOptions output;

  void add_to(CLI::App& verb);

  /// The models of --noise, or the usual ones, with the numbers that are fitted left out. @throws InputError
  std::vector<NoiseChoice> candidates() const;
  /// Those of --simulate.
  std::vector<NoiseChoice> simulated() const;

  /// The shapes, and notes about them. @throws InputError
  compare::CohortShapes read(std::vector<std::string>& notes) const;
  /// What the options say of these shapes.
  compare::CompareOptions compare_options(const compare::CohortShapes& shapes, std::vector<std::string>& notes) const;

 private:
  static std::string open_noise(const std::string& noise);
  compare::CompareOptions options_about(const Landmarks& source) const;
};

}  // namespace pulson
