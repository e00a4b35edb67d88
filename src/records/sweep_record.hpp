#pragma once

#include <string>
#include <vector>

#include "pulson/records/records.hpp"

namespace pulson::records {

/// The ensemble of one value of the number that a sweep changes.
struct SweepPoint {
  double value = 0;
  EnsembleRun run;
};

/// The text of sweep.json: what all ensembles have in common, and `sweep`, a list with the value, the specification,
/// crossing and counts of paths of each. @param parameter as it was named: `beta`, `kernel.alpha` @param points not
/// empty
std::string sweep_json(const std::string& parameter, const std::vector<SweepPoint>& points);

/// `value,probability,standard_error,ever,samples,clean,no_root,momentum_bound,tie`: a row for each value; NA where
/// there is no clean path, and for the error where all paths or none crossed.
std::string sweep_csv(const std::vector<SweepPoint>& points);

}  // namespace pulson::records
