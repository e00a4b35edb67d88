#include <iterator>

#include <fmt/format.h>

#include "csv_rows.hpp"
#include "pulson/io/registration_record.hpp"

namespace pulson {
namespace {

std::string quoted_label(const Landmarks& shape, int a) {
  if (shape.labels.empty()) return {};
  std::string text = "\"";
  for (const char c : shape.labels[static_cast<std::size_t>(a)])
    text += c == '"' ? std::string("\"\"") : std::string(1, c);
  return text + '"';
}

}  // namespace

std::string residuals_csv(const Registration& registration) {
  const Eigen::Index d = registration.result.rows();
  std::string text =
      "landmark,label" + axis_names("target", d) + axis_names("result", d) + axis_names("residual", d) + ",distance\n";
  const Eigen::VectorXd distances = registration.distances();
  for (int a = 0; a < registration.source.count(); ++a) {
    const Eigen::VectorXd target = registration.target.points.col(a);
    const Eigen::VectorXd result = registration.result.col(a);
    text += fmt::format("{},{}", a + 1, quoted_label(registration.source, a));
    append_values(text, target);
    append_values(text, result);
    append_values(text, Eigen::VectorXd(result - target));
    text += fmt::format(",{}\n", distances[a]);
  }
  return text;
}

std::string trajectory_csv(const Registration& registration, const Trajectory& path) {
  std::string text = "step,time,landmark" + state_names(registration.result.rows()) + "\n";
  append_states(text, path, "", 1);
  return text;
}

}  // namespace pulson
