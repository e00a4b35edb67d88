#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "charts/chart.hpp"
#include "pulson/core/name_table.hpp"
#include "records/sweep_record.hpp"
#include "saved_ensembles.hpp"

namespace pulson {

/// `0:6.5:0.25`, from, to and step, or `0,1.5,3`: in increasing order. @param option what messages begin with
/// @throws InputError where it is neither, a value is twice in it, or there are more than a thousand
std::vector<double> parse_values(std::string_view text, const std::string& option);

/// `beta=0:6.5:0.25`
struct SweepValues {
  std::string parameter;
  std::vector<double> values;
};

/// @throws InputError
SweepValues parse_sweep(const std::string& text);

/// The specification of a noise, in which the parameter that is swept need not be given: 1 where it lacks.
std::string with_parameter(const std::string& noise, const std::string& parameter);

/// A number of the noise or the kernel that a sweep changes: `beta` or, of a sum, `ch-sd.beta`; `kernel.alpha` or
/// `kernel.gaussian.alpha`.
class SweptParameter {
 public:
  /// @param shape that the noise was made for @throws InputError where no term or several have it
  SweptParameter(const std::string& name, const StochasticSystem& system, const Landmarks& shape);

  /// The system with this value. Noise has the same random numbers for all of them: the swept term is the last of a
  /// sum, and left out where its amplitude, β or σ, is 0. @throws InputError where the value is out of its range
  StochasticSystem at(double value) const;

  /// Noise and kernel for people, with … in place of the value.
  std::string noise() const { return of_kernel_ ? shortened_spec(system_.noise->spec()) : pattern(); }
  std::string kernel() const { return of_kernel_ ? pattern() : system_.kernel.spec(4); }

 private:
  std::string pattern() const;

  StochasticSystem system_;
  Landmarks shape_;
  bool of_kernel_;
  std::vector<Spec> terms_;  // of the noise or the kernel
  std::size_t term_ = 0;
  std::string key_;
};

/// Samples an ensemble for each value. The caller holds an Interrupt. @param base what all have in common
/// @param what for the line of progress @throws Interrupted; InputError, before anything is sampled
std::vector<records::SweepPoint> sample_sweep(const records::EnsembleRun& base, const SweepValues& sweep,
                                              const SavedEnsembles& saved, const std::string& what, Progress& progress);

/// The probability of crossing over the value, with bars of two standard errors; values without a clean path are left
/// out.
charts::Series probability_series(const std::vector<records::SweepPoint>& points, const std::string& name);

}  // namespace pulson
