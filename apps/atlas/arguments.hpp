#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pulson/cohort/atlas.hpp"
#include "pulson/cohort/statistics.hpp"
#include "shell/loss_options.hpp"
#include "shell/options.hpp"
#include "shell/outputs.hpp"

namespace pulson {

/// The command line of `pulson atlas`.
struct AtlasArguments {
  std::vector<std::string> shapes;
  formats::ReadOptions reading;
  bool by_order = false;
  OutputOptions output;
  std::string kernel = matching::atlas_defaults().kernel.value;
  std::string lambda = matching::atlas_defaults().lambda.value;
  std::string sigma = matching::atlas_defaults().sigma.value;
  std::string noise = "none";
  LossOptions loss;
  std::string align = matching::atlas_defaults().align.value;
  std::string model;       ///< formula, or empty
  std::string data;        ///< FILE with its columns, or empty
  std::string covariate;   ///< FILE:COLUMN, or empty
  std::string groups;      ///< FILE:COLUMN or a property that the file has, or empty
  std::vector<double> at;  ///< values of the covariate that are drawn
  int modes = 3;           ///< in pictures
  cohort::AtlasOptions options{.steps = TimeOptions::of(matching::atlas_defaults()).steps};
  cohort::PermutationOptions permutations;
  bool resume = false;

  void add_to(CLI::App& verb);

  bool has_models() const { return !(model.empty() && covariate.empty() && groups.empty()); }

  /// The shapes, alike, in the order of the first. @throws InputError
  std::vector<Landmarks> read(std::vector<std::string>& notes) const;

  /// What is asked for. @throws InputError
  cohort::AtlasOptions atlas_options() const;
};

}  // namespace pulson
