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

const Facts<ModelRow>& model_facts();
const Facts<PathRow>& path_facts();
const Facts<ShapeRow>& shape_facts();

/// In the order given; the greatest score first.
std::vector<ModelRow> model_rows(const compare::Comparison& comparison);
std::vector<ModelRow> ranked_rows(const compare::Comparison& comparison);

/// Of the rows of models; none where no model has paths of least cost.
std::vector<PathRow> path_rows(const std::vector<ModelRow>& models);
std::vector<ShapeRow> shape_rows(const std::vector<ModelRow>& models);

}  // namespace pulson
