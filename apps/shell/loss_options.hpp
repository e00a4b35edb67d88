#pragma once

#include <optional>
#include <string>

#include <CLI/App.hpp>

#include "pulson/matching/robust_loss.hpp"

namespace pulson {

/// `--robust` and `--loss NAME[:K]`.
struct LossOptions {
  std::string loss;  ///< a specification, or empty: least squares
  bool robust = false;

  /// Two options, the first in the verb's group of the model. @param what the loss is of and what comes of it, for the
  /// help
  void add_to(CLI::App& verb, const std::string& what);

  /// @throws InputError
  std::optional<matching::RobustLoss> chosen() const;
};

}  // namespace pulson
