#pragma once

#include <optional>
#include <string>
#include <vector>

#include "atlas/cohort_pictures.hpp"
#include "audit/audit.hpp"
#include "pulson/cohort/atlas.hpp"
#include "pulson/cohort/prediction.hpp"
#include "pulson/cohort/statistics.hpp"
#include "shell/run_results.hpp"

namespace pulson {

/// Everything that `pulson atlas` finds.
struct AtlasResults {
  cohort::Atlas atlas;
  std::vector<Landmarks> given;    ///< the shapes
  std::vector<std::string> names;  ///< of the specimens
  cohort::ShapeModes modes;
  cohort::ProcrustesModes procrustes;
  /// Of each specimen, what it misses; empty where none does.
  std::vector<cohort::PredictedLandmarks> predicted;
  std::vector<Landmarks> complete;  ///< the shapes as given with predictions for what is missing; empty likewise
  std::vector<double> covariate;    ///< empty: none
  std::string covariate_name;
  std::vector<double> shown_values;  ///< of it, in pictures
  std::optional<cohort::MomentumRegression> regression;
  std::vector<std::string> groups;  ///< empty: none
  std::optional<cohort::GroupComparison> comparison;
  std::optional<CohortPictures> pictures;  ///< where pictures or a page are made
  audit::Audit accused;                    ///< of the shapes as given
  std::vector<std::string> notes;
  double seconds = 0;

  bool converged() const;
};

/// `atlas.json`
std::string atlas_json(const AtlasResults& results);
std::string specimens_csv(const AtlasResults& results);
/// A row per specimen with its scores; `group` and covariate where there are any.
std::string scores_csv(const AtlasResults& results, const Eigen::MatrixXd& scores);
std::string modes_csv(const AtlasResults& results);
std::string predicted_csv(const AtlasResults& results);
std::string momenta_csv(const AtlasResults& results);
std::string momenta_npy(const AtlasResults& results);
std::string groups_csv(const cohort::GroupComparison& comparison);
std::string regression_csv(const AtlasResults& results);

void print_atlas(const AtlasResults& results);

/// Names of the pictures, without extension: shapes on a line have none of shapes.
std::vector<std::string> picture_stems(int dimension, bool has_regression, bool has_groups);
std::vector<std::string> picture_stems(const AtlasResults& results);
void draw_atlas(const AtlasResults& results, int modes, RunResults& files);

/// @param files that were drawn before
html::HtmlReport atlas_report(const AtlasResults& results, int modes, const RunResults& files);

/// The momenta that carry the template s standard deviations along mode k, and its path there.
Points mode_momenta(const AtlasResults& results, int k, double deviations);
Trajectory mode_path(const AtlasResults& results, int k, double deviations);

}  // namespace pulson
