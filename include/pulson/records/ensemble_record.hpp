#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "pulson/ensemble/ensemble.hpp"

namespace pulson {

/// An ensemble and all that it was made from.
struct EnsembleRun {
  StochasticSystem system;
  std::string integrator;
  Landmarks shape;  ///< at q
  PhaseState start;
  EnsembleOptions options;
  std::vector<int> densities;  ///< steps of those histograms that are to be written
  EnsembleSums sums;
  std::string method;  ///< how paths were computed
  int threads = 1;
  double seconds = 0;

  bool partial() const { return sums.samples < options.samples; }
};

/// The text of ensemble.json; NaN and what is not defined, as crossing in the plane, are null.
std::string ensemble_json(const EnsembleRun& run);

/// `time,landmark,quantity,axis,mean,standard_error,standard_deviation,q05,q25,q50,q75,q95`: a row for each recorded
/// time and coordinate; quantiles are empty where there is no histogram.
std::string ensemble_means_csv(const EnsembleRun& run);

/// `time,landmark,quantity,axis,low,high,density`: the bins that are not empty, of the
/// histograms that are to be written.
std::string ensemble_densities_csv(const EnsembleRun& run);

/// The sums of an unfinished ensemble, exact, as a binary text (CBOR) that belongs to this run only: a run with
/// a different seed, noise or initial state cannot read it.
std::string ensemble_checkpoint(const EnsembleRun& run);

/// What ensemble_checkpoint wrote. @throws InputError if it is damaged or of another run; `name` is the file's
EnsembleSums read_ensemble_checkpoint(const EnsembleRun& run, std::string_view bytes, std::string_view name);

}  // namespace pulson
