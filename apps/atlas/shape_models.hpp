#pragma once

#include <string>
#include <vector>

#include "pulson/cohort/linear_model.hpp"
#include "shell/facts.hpp"

namespace pulson {

struct AtlasArguments;
struct AtlasResults;

/// A linear model that is asked for, and what it needs of the specimens.
struct ShapeModelInput {
  cohort::ModelFormula formula;
  cohort::ModelData data;
  bool uses_centroid_size = false;  ///< the column `size` is not of a table
};

/// A linear model of the shapes: of Procrustes coordinates, as in geomorph, and of momenta in their metric.
struct ShapeModel {
  cohort::ModelFormula formula;
  cohort::ModelDesign design;
  cohort::ModelTest procrustes, momenta;
  std::vector<Points> procrustes_coefficients;  ///< of each column of the design, d×N of the landmarks of all shapes
  std::vector<Points> momenta_coefficients;     ///< d×N
};

/// Of --model, else of --covariate and --groups, each by itself. Columns are those of --data, else comments of the
/// shapes' file, else `size`, the centroid size. @throws InputError also where it cannot be fitted
std::vector<ShapeModelInput> read_shape_models(const AtlasArguments& arguments, const std::vector<Landmarks>& shapes,
                                               std::vector<std::string>& notes);

/// Fits and tests it. @param shapes complete, for their sizes @param notes get a line where both metrics disagree
ShapeModel fit_shape_model(ShapeModelInput input, const AtlasResults& results, const std::vector<Points>& shapes,
                           const cohort::PermutationOptions& options, std::vector<std::string>& notes);

/// A line of an analysis of variance: a term, then residuals, then the total.
struct TermRow {
  const ShapeModel* model;
  std::size_t term;
};
/// Two groups of a term.
struct PairRow {
  const ShapeModel* model;
  std::size_t pair;
};

const Facts<TermRow>& term_facts();
const Facts<PairRow>& pair_facts();
std::vector<TermRow> term_rows(const std::vector<ShapeModel>& models);
std::vector<PairRow> pair_rows(const std::vector<ShapeModel>& models);

/// Of each specimen of the atlas its group by the last term of factors alone; empty where there is none, or none for
/// the specimen.
std::vector<std::string> groups_of_model(const ShapeModelInput& input);

/// `models` of atlas.json.
formats::Json models_json(const AtlasResults& results);
/// A row for each coefficient and landmark.
std::string coefficients_csv(const AtlasResults& results);
void print_models(const AtlasResults& results);

}  // namespace pulson
