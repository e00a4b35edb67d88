#pragma once

#include <optional>
#include <string>
#include <vector>

#include "atlas/cohort_pictures.hpp"
#include "atlas/shape_models.hpp"
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
  std::vector<double> shown_values;                      ///< of it, in pictures
  std::optional<cohort::MomentumRegression> regression;  ///< of --covariate
  std::vector<std::string> groups;                       ///< of --groups or the model; empty: none
  std::vector<cohort::GroupMean> means;                  ///< of --groups
  std::vector<ShapeModel> models;                        ///< of --model, or of --covariate and of --groups
  std::optional<CohortPictures> pictures;                ///< where pictures or a page are made
  audit::Audit accused;                                  ///< of the shapes as given
  std::vector<std::string> notes;
  double seconds = 0;

  bool converged() const;
  const ShapeModel& model_of_covariate() const { return models.front(); }
  const ShapeModel& model_of_groups() const { return models.back(); }
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
std::string regression_csv(const AtlasResults& results);

void print_atlas(const AtlasResults& results);

/// Names of the pictures, without extension: shapes on a line have none of shapes.
struct AtlasPictures {
  int dimension = 2;
  bool has_regression = false, has_groups = false, has_models = false;

  std::vector<std::string> stems() const;
};
void draw_atlas(const AtlasResults& results, int modes, RunResults& files);

/// @param files that were drawn before
html::HtmlReport atlas_report(const AtlasResults& results, int modes, const RunResults& files);

/// The momenta that carry the template s standard deviations along mode k, and its path there.
Points mode_momenta(const AtlasResults& results, int k, double deviations);
Trajectory mode_path(const AtlasResults& results, int k, double deviations);

}  // namespace pulson
