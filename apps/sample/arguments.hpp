#pragma once

#include <string>
#include <vector>

#include "pulson/inference/posterior.hpp"
#include "shell/loss_options.hpp"
#include "shell/open_model.hpp"
#include "shell/options.hpp"
#include "shell/outputs.hpp"
#include "shell/units.hpp"

namespace pulson {

/// What `pulson sample` reads, in the order of the source's landmarks.
struct SampleShapes {
  Landmarks source;
  std::vector<Landmarks> targets;
  std::vector<TreeNode> tree;  ///< empty: each target has a path of its own
};

/// Of each node name, parent and length, as saved runs have them.
nlohmann::ordered_json tree_facts(const std::vector<TreeNode>& tree);

/// The command line of `pulson sample`.
struct SampleArguments {
  std::string source;
  std::vector<std::string> targets;
  formats::ReadOptions reading;
  bool by_order = false;
  OutputOptions output;
  TimeOptions time = TimeOptions::of(matching::sample_defaults());
  std::string kernel, sigma, lambda;  ///< empty: the default, which depends on the number of targets
  std::string noise = "none";
  std::string integrator = matching::sample_defaults().integrator.value;
  std::string align = matching::sample_defaults().align.value;
  std::string momenta = "kernel";
  std::string tree;  ///< a Newick file, or empty
  LossOptions loss;
  inference::SamplerOptions sampler;
  int calibrate = 0;  ///< simulations; 0: sample the posterior
  std::string fault;  ///< NAME=FACTOR, or empty
  int ranks = 63;
  UnitOptions units;

  void add_to(CLI::App& verb);

  /// @throws InputError
  SampleShapes read(std::vector<std::string>& notes) const;
  const matching::TaskDefaults& defaults(const SampleShapes& shapes) const;
  OpenModel model(const matching::TaskDefaults& usual) const;
  inference::PosteriorProblem problem(const SampleShapes& shapes, std::vector<std::string>& notes) const;
  inference::CalibrationOptions calibration() const;
};

}  // namespace pulson
