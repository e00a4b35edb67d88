#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arguments.hpp"
#include "html/html_report.hpp"
#include "pulson/records/records.hpp"
#include "records/unit_parts.hpp"

namespace pulson {

/// One shape of a cohort, and what was found.
struct SpecimenMatch {
  std::string name;    ///< as given
  std::string folder;  ///< of its files: the name made safe
  std::string source;  ///< where its landmarks came from
  double centroid_size = 0;
  std::optional<matching::Registration> registration{};  ///< none where it failed
  std::optional<matching::PredictionOfMatch> prediction{};
  /// Of its record, residuals and trajectory; empty where it failed.
  std::vector<std::pair<std::string, std::string>> files{};
  std::string error{};  ///< why it failed

  /// √(p0ᵀKp0), the length of the geodesic, length units.
  double momenta_norm() const;
};

/// A source and the matches of several shapes.
struct CohortMatches {
  Landmarks source;
  std::vector<SpecimenMatch> specimens;
  std::vector<std::string> notes;
  double seconds = 0;

  int failed() const;
  int matched() const;
  int unconverged() const;  ///< of those that did not fail
};

/// Registers the source to each of several shapes, in parallel. A shape that fails is reported, and the others are
/// kept.
/// @param settings the options, see settings_of() @return the exit code @throws InputError where all of them fail
int run_register_cohort(const RegisterArguments& arguments, const std::string& settings);

/// Writes what run_register_cohort() would have, from the parts of such a run. @return the exit code
int merge_cohort(const records::UnitRun& whole, const OutputOptions& output);

/// The merged table: a row per specimen, NA where it failed. `specimen` is its name as given, `folder` that of its
/// files.
std::string cohort_csv(const CohortMatches& cohort);
/// `cohort.json`
std::string cohort_json(const CohortMatches& cohort);
/// The report: a table with a thumbnail for each specimen, which sorts by each column.
html::HtmlReport cohort_report(const CohortMatches& cohort);

/// Fits the parameters named to all targets, and sets the options to them. None where no name is given.
std::optional<inference::FittedParameters> fit_first(const Landmarks& source, const std::vector<Landmarks>& targets,
                                                     const std::vector<std::string>& names,
                                                     matching::RegistrationOptions& options, Progress& progress);

}  // namespace pulson
