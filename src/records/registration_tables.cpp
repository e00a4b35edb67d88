// The tables of a registration: residuals.csv and trajectory.csv.

#include <utility>
#include <vector>

#include "csv_rows.hpp"
#include "pulson/records/records.hpp"

namespace pulson::records {
namespace {

// One column, or one for each axis: rows are landmarks.
struct ResidualColumn {
  std::string name;
  bool of_axes;
  Eigen::MatrixXd values;
};

std::vector<ResidualColumn> residual_columns(const matching::Registration& registration,
                                             const RegistrationFacts& facts) {
  const matching::LandmarkShares& shares = facts.shares;
  const bool landmarks = registration.data.kind == matching::DataKind::kLandmarks;
  std::vector<ResidualColumn> columns;
  const auto vectors = [&](const char* name, const Points& values) {
    if (values.size() > 0) columns.push_back({name, true, values.transpose()});
  };
  const auto numbers = [&](const char* name, const Eigen::VectorXd& values) {
    if (values.size() > 0) columns.push_back({name, false, values});
  };
  if (landmarks) vectors("target", registration.target.points);
  vectors("result", registration.result);
  if (landmarks) vectors("residual", registration.result - registration.target.points);
  numbers("distance", registration.distances());
  vectors("spread", registration.spread);
  vectors("flow", shares.flow);
  if (registration.noise != "none") vectors("noise", shares.noise);
  numbers("energy", shares.energy);
  numbers("action", shares.action);
  numbers("data", shares.data);
  numbers("predicted_over_sigma", facts.verdicts.predicted);
  numbers("weight", facts.verdicts.weight);
  if (registration.uncertainty) {
    vectors("result_deviation", registration.uncertainty->end_deviation);
    vectors("momentum_deviation", registration.uncertainty->momentum_deviation);
    vectors("velocity_deviation", registration.uncertainty->velocity_deviation);
  }
  return columns;
}

}  // namespace

std::string residuals_csv(const matching::Registration& registration, const RegistrationFacts& facts) {
  const std::vector<ResidualColumn> columns = residual_columns(registration, facts);
  const std::vector<std::string>& labels = registration.source.labels;
  text::CsvTable table;
  table.words({"landmark", "label"});
  for (const ResidualColumn& column : columns)
    if (column.of_axes)
      add_axis_names(table, column.name, registration.result.rows());
    else
      table.word(column.name);
  table.end_row();
  for (int a = 0; a < registration.source.count(); ++a) {
    table.number(registration.source.number(a));
    if (labels.empty())
      table.empty();
    else
      table.text(labels[static_cast<std::size_t>(a)]);
    for (const ResidualColumn& column : columns) table.numbers(column.values.row(a));
    table.end_row();
  }
  return std::move(table).take();
}

std::string trajectory_csv(const matching::Registration& registration, const Trajectory& path) {
  text::CsvTable table;
  table.words({"step", "time", "landmark"});
  add_state_names(table, registration.result.rows());
  table.end_row();
  add_states(table, path, "", 1, registration.source.numbers);
  return std::move(table).take();
}

}  // namespace pulson::records
