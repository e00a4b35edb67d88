#include <cmath>
#include <iterator>
#include <vector>

#include <fmt/format.h>

#include "csv_rows.hpp"
#include "pulson/records/registration_record.hpp"

namespace pulson {
namespace {

std::string quoted_label(const Landmarks& shape, int a) {
  if (shape.labels.empty()) return {};
  std::string text = "\"";
  for (const char c : shape.labels[static_cast<std::size_t>(a)])
    text += c == '"' ? std::string("\"\"") : std::string(1, c);
  return text + '"';
}

// One column, or one for each axis: rows are landmarks.
struct Column {
  std::string names;  // with a comma before each
  Eigen::MatrixXd values;
};

std::vector<Column> residual_columns(const Registration& registration, const LandmarkShares& shares) {
  const Eigen::Index d = registration.result.rows();
  const bool landmarks = registration.data.kind == DataKind::kLandmarks;
  std::vector<Column> columns;
  const auto vectors = [&](const char* name, const Points& values) {
    if (values.size() > 0) columns.push_back({axis_names(name, d), values.transpose()});
  };
  const auto numbers = [&](const char* name, const Eigen::VectorXd& values) {
    if (values.size() > 0) columns.push_back({std::string(",") + name, values});
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
  if (registration.uncertainty) {
    vectors("result_deviation", registration.uncertainty->end_deviation);
    vectors("momentum_deviation", registration.uncertainty->momentum_deviation);
    vectors("velocity_deviation", registration.uncertainty->velocity_deviation);
  }
  return columns;
}

}  // namespace

std::string residuals_csv(const Registration& registration, const LandmarkShares& shares) {
  const std::vector<Column> columns = residual_columns(registration, shares);
  std::string text = "landmark,label";
  for (const Column& column : columns) text += column.names;
  text += "\n";
  for (int a = 0; a < registration.source.count(); ++a) {
    text += fmt::format("{},{}", registration.source.number(a), quoted_label(registration.source, a));
    for (const Column& column : columns)
      for (const double value : column.values.row(a)) text += std::isnan(value) ? ",NA" : fmt::format(",{}", value);
    text += "\n";
  }
  return text;
}

std::string trajectory_csv(const Registration& registration, const Trajectory& path) {
  std::string text = "step,time,landmark" + state_names(registration.result.rows()) + "\n";
  append_states(text, path, "", 1, registration.source.numbers);
  return text;
}

}  // namespace pulson
