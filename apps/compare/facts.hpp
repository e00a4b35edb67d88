#pragma once

#include <vector>

#include "pulson/compare/comparison.hpp"
#include "shell/facts.hpp"

namespace pulson {

/// A model of a comparison.
struct ModelRow {
  const compare::Comparison* comparison;
  const compare::ComparedModel* model;
};

/// Its matches by the most probable paths, or by those of least cost.
struct PathRow {
  const compare::Comparison* comparison;
  const compare::ComparedModel* model;
  const compare::LeastCostPaths* paths;  ///< null: the most probable
};

/// One shape under one model.
struct ShapeRow {
  const compare::Comparison* comparison;
  const compare::ComparedModel* model;
  std::size_t shape;
};

/// A statistic of the shapes beside cohorts drawn from a model.
struct CheckRow {
  const compare::ComparedModel* model;
  std::string statistic;
  compare::PredictiveCheck check;
};

const Facts<ModelRow>& model_facts();
const Facts<PathRow>& path_facts();
const Facts<ShapeRow>& shape_facts();
const Facts<CheckRow>& check_facts();

/// In the order given; the greatest score first.
std::vector<ModelRow> model_rows(const compare::Comparison& comparison);
std::vector<ModelRow> ranked_rows(const compare::Comparison& comparison);

/// Of the rows of models; none where no model has paths of least cost.
std::vector<PathRow> path_rows(const std::vector<ModelRow>& models);
std::vector<ShapeRow> shape_rows(const std::vector<ModelRow>& models);
/// Of the models that were checked. @param with_landmarks the variance of each, too
std::vector<CheckRow> check_rows(const std::vector<ModelRow>& models, bool with_landmarks = false);

}  // namespace pulson
