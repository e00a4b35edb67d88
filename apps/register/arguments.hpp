#pragma once

#include <optional>
#include <string>

#include "matching/defaults.hpp"
#include "pulson/matching/registration.hpp"
#include "shell/field_files.hpp"
#include "shell/loss_options.hpp"
#include "shell/open_model.hpp"
#include "shell/options.hpp"
#include "shell/outputs.hpp"
#include "shell/units.hpp"
#include "underlay.hpp"

namespace pulson {

/// The command line of `pulson register`.
struct RegisterArguments {
  std::string source;
  std::vector<std::string> targets;
  std::string from;  ///< --template: a shape, `mean`, or empty: SOURCE is the source
  formats::ReadOptions reading;
  OutputOptions output;
  FieldOptions field;
  matching::RegistrationOptions options;
  TimeOptions time = TimeOptions::of(matching::register_defaults());
  std::string kernel = matching::register_defaults().kernel.value;
  std::string noise = "none";
  std::optional<std::string> mode;
  std::string sigma = matching::register_defaults().sigma.value;
  std::string lambda = matching::register_defaults().lambda.value;
  std::string align = matching::register_defaults().align.value;
  std::string solver = "auto";
  std::string data = "landmarks";
  std::string data_width = "auto";
  std::string curve_ends = "auto";
  std::string weights;      ///< a file, or empty
  std::string covariances;  ///< a file, or empty
  LossOptions loss;
  bool homotopy = false;
  std::string image;                 ///< of the source; empty: the one that its file names
  std::optional<double> pixel_size;  ///< of that image
  std::string origin;                ///< of its first pixel: x,y
  std::int64_t max_pixels = images::kMaxPixels;
  std::string mesh;  ///< surface of the source; empty: the one beside its file

  UnitOptions units;  ///< of several shapes

  void add_to(CLI::App& verb);

  /// Whether several shapes are asked for: a template, or other than one target, or a target file that holds several.
  /// @throws InputError
  bool asks_for_cohort() const;

  OpenModel model() const;

  /// None: least squares. @throws InputError

  /// The image of the source, whose size and pixels its frame then has. @throws InputError
  SourceImage source_image(Landmarks& shape, std::vector<std::string>& notes) const;

  /// What is asked for a source of `count` landmarks in R^d; reads the files of weights and covariances.
  /// @throws InputError
  matching::RegistrationOptions registration_options(const Landmarks& source, std::vector<std::string>& notes) const;
};

}  // namespace pulson
