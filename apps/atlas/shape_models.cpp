// Linear models of the shapes: which columns they take, and what is made of them.

#include "atlas/shape_models.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "atlas/arguments.hpp"
#include "atlas/results.hpp"
#include "core/text.hpp"
#include "pulson/core/alignment.hpp"
#include "pulson/core/errors.hpp"
#include "shell/messages.hpp"
#include "shell/specimen_columns.hpp"

namespace pulson {
namespace {

constexpr double kLevel = 0.05;       // of tests, for the note on two that differ
constexpr double kEqualSizes = 1e-3;  // standard deviation over mean, below which sizes are what rounding left

std::vector<std::string> fields_of(const Eigen::VectorXd& numbers) {
  std::vector<std::string> fields;
  for (const double x : numbers) fields.push_back(std::isfinite(x) ? fmt::format("{:.17g}", x) : "NA");
  return fields;
}

std::vector<std::string> size_fields(const std::vector<Points>& shapes) {
  Eigen::VectorXd sizes(std::ssize(shapes));
  for (std::size_t i = 0; i < shapes.size(); ++i) sizes[static_cast<Eigen::Index>(i)] = centroid_size(shapes[i]);
  return fields_of(sizes);
}

void note_equal_sizes(const std::vector<std::string>& fields, std::vector<std::string>& notes) {
  Eigen::VectorXd sizes(std::ssize(fields));
  for (std::size_t i = 0; i < fields.size(); ++i) sizes[static_cast<Eigen::Index>(i)] = std::stod(fields[i]);
  const double deviation = std::sqrt((sizes.array() - sizes.mean()).square().mean());
  if (deviation < kEqualSizes * sizes.mean())
    notes.push_back(
        fmt::format("the centroid sizes differ by {:.2g} % only: these shapes were scaled, and `size` says "
                    "nothing of them",
                    100 * deviation / sizes.mean()));
}

// Of a formula, from the table, the shapes' comments, or the shapes.
ShapeModelInput input_of_formula(const AtlasArguments& arguments, const std::vector<Landmarks>& shapes,
                                 std::vector<std::string>& notes) {
  ShapeModelInput input{cohort::ModelFormula::parse(arguments.model), {}, false};
  const std::vector<std::string> of_table =
      arguments.data.empty() ? std::vector<std::string>() : columns_in_table(arguments.data);
  std::vector<std::string> of_shapes = properties_of(shapes);
  for (const std::string& name : input.formula.columns()) {
    std::vector<std::string>& fields = input.data.columns[name];
    if (has_name(of_table, name)) {
      fields = column_of_table({arguments.data, "--data", arguments.by_order, name}, shapes, notes);
    } else if (has_name(of_shapes, name)) {
      fields = property_of(shapes, name);
    } else if (name == "size") {
      input.uses_centroid_size = true;
      std::vector<Points> points;
      for (const Landmarks& shape : shapes) points.push_back(shape.points);
      fields = size_fields(points);
      note_equal_sizes(fields, notes);
    } else {
      std::vector<std::string> known = of_table;
      known.insert(known.end(), of_shapes.begin(), of_shapes.end());
      known.emplace_back("size (centroid size)");
      throw InputError(fmt::format("--model: there is no column '{}'{}; there are {}", name,
                                   arguments.data.empty() ? ", and --data names no table" : " in " + arguments.data,
                                   fmt::join(known, ", ")));
    }
  }
  return input;
}

ShapeModelInput input_of_column(const std::string& address, bool is_factor, std::vector<std::string> fields) {
  const std::string name = address.substr(address.rfind(':') + 1);  // all of it where there is no ':'
  return {cohort::ModelFormula::of_column(name, is_factor), {{}, {{name, std::move(fields)}}}, false};
}

// Of columns of the specimens' shapes: Σ_i w_i y_i.
std::vector<Points> coefficients(const cohort::ModelDesign& design, const std::vector<Points>& all) {
  std::vector<Points> found;
  for (Eigen::Index c = 0; c < design.weights.rows(); ++c) {
    Points sum = Points::Zero(all.front().rows(), all.front().cols());
    for (Eigen::Index i = 0; i < design.weights.cols(); ++i)
      sum += design.weights(c, i) * all[static_cast<std::size_t>(design.specimens[static_cast<std::size_t>(i)])];
    found.push_back(sum);
  }
  return found;
}

std::vector<Points> procrustes_coordinates(const cohort::ShapeModes& modes) {
  std::vector<Points> all;
  for (Eigen::Index i = 0; i < modes.scores.rows(); ++i) {
    Points sum = Points::Zero(modes.directions.front().rows(), modes.directions.front().cols());
    for (Eigen::Index k = 0; k < modes.scores.cols(); ++k)
      sum += modes.scores(i, k) * modes.directions[static_cast<std::size_t>(k)];
    all.push_back(sum);
  }
  return all;
}

// Both see the same specimens with other weights of the directions of shape.
void note_disagreement(const ShapeModel& model, std::vector<std::string>& notes) {
  for (std::size_t t = 0; t < model.design.terms.size(); ++t) {
    const double p = model.procrustes.terms[t].p_value, of_momenta = model.momenta.terms[t].p_value;
    if ((p <= kLevel) != (of_momenta <= kLevel))
      notes.push_back(
          fmt::format("{}: p {:.3g} by Procrustes coordinates and {:.3g} by momenta, whose metric gives "
                      "smooth deformations less weight",
                      model.design.terms[t].label, p, of_momenta));
  }
}

}  // namespace

std::vector<ShapeModelInput> read_shape_models(const AtlasArguments& arguments, const std::vector<Landmarks>& shapes,
                                               std::vector<std::string>& notes) {
  std::vector<ShapeModelInput> inputs;
  if (!arguments.model.empty()) inputs.push_back(input_of_formula(arguments, shapes, notes));
  if (!arguments.covariate.empty())
    inputs.push_back(input_of_column(
        arguments.covariate, false,
        fields_of(numbers_of_table({arguments.covariate, "--covariate", arguments.by_order}, shapes, notes))));
  if (!arguments.groups.empty())
    inputs.push_back(input_of_column(arguments.groups, true,
                                     groups_of({arguments.groups, "--groups", arguments.by_order}, shapes, notes)));
  for (ShapeModelInput& input : inputs) {
    for (const Landmarks& shape : shapes) input.data.specimens.push_back(shape.name);
    static_cast<void>(make_design(input.formula, input.data));  // before the search for the template
  }
  return inputs;
}

ShapeModel fit_shape_model(ShapeModelInput input, const AtlasResults& results, const std::vector<Points>& shapes,
                           const cohort::PermutationOptions& options, std::vector<std::string>& notes) {
  if (input.uses_centroid_size) input.data.columns["size"] = size_fields(shapes);
  ShapeModel model{std::move(input.formula), {}, {}, {}, {}, {}};
  model.design = make_design(model.formula, input.data);
  model.procrustes = test_model(model.design, results.procrustes.modes.scores, options);
  model.momenta = test_model(model.design, results.modes.scores, options);
  model.procrustes_coefficients = coefficients(model.design, procrustes_coordinates(results.procrustes.modes));
  std::vector<Points> momenta;
  for (const cohort::AtlasSpecimen& specimen : results.atlas.specimens) momenta.push_back(specimen.momenta);
  model.momenta_coefficients = coefficients(model.design, momenta);
  notes.insert(notes.end(), model.design.notes.begin(), model.design.notes.end());
  note_disagreement(model, notes);
  return model;
}

std::vector<std::string> groups_of_model(const ShapeModelInput& input) {
  constexpr std::size_t kMostColours = 12;  // of a plot whose legend can be read
  const cohort::ModelDesign design = make_design(input.formula, input.data);
  for (auto term = design.terms.rbegin(); term != design.terms.rend(); ++term) {
    if (term->groups.empty() || term->groups.size() > kMostColours) continue;
    std::vector<std::string> groups(input.data.specimens.size());
    for (std::size_t i = 0; i < design.specimens.size(); ++i)
      groups[static_cast<std::size_t>(design.specimens[i])] =
          term->groups[static_cast<std::size_t>(term->group_of[i])].name;
    return groups;
  }
  return {};
}

}  // namespace pulson
