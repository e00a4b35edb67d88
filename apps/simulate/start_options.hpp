#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "pulson/dynamics/stochastic_system.hpp"
#include "shell/options.hpp"

namespace pulson {

/// Where simulations start.
struct Start {
  Landmarks shape;   ///< at q
  PhaseState state;  ///< (q, p)
  StochasticSystem system{KernelOperator({KernelTerm{}}), nullptr};
  double default_time = 1;
  std::vector<std::string> notes;
};

/// `--q --p`, `--shape`, `--momenta` or `--from`, with `--kernel` and `--noise`.
struct StartOptions {
  std::optional<std::string> q;
  std::optional<std::string> p;
  std::optional<std::string> shape;
  std::optional<std::string> momenta;
  std::optional<std::string> from;
  std::optional<std::string> kernel;
  std::optional<std::string> noise;
  formats::ReadOptions reading;
  bool by_order = false;

  void add_to(CLI::App& verb);
  /// @throws InputError
  Start start() const;
};

}  // namespace pulson
