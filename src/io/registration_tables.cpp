#include <iterator>

#include <fmt/format.h>

#include "pulson/io/registration_record.hpp"

namespace pulson {
namespace {

constexpr std::string_view kAxes = "xyz";

// Header fields `,prefix_x,prefix_y` for d axes.
std::string axis_names(std::string_view prefix, Eigen::Index d) {
  std::string text;
  for (Eigen::Index c = 0; c < d; ++c) text += fmt::format(",{}_{}", prefix, kAxes[static_cast<std::size_t>(c)]);
  return text;
}

template <class Column>
void append_values(std::string& text, const Column& column) {
  for (const double value : column) fmt::format_to(std::back_inserter(text), ",{}", value);
}

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
  const Eigen::Index d = registration.result.rows();
  std::string text = "step,time,landmark" + axis_names("q", d) + axis_names("p", d) + "\n";
  for (int k = 0; k <= path.grid.steps; ++k) {
    const PhaseState& state = path.states[static_cast<std::size_t>(k)];
    for (int a = 0; a < registration.source.count(); ++a) {
      fmt::format_to(std::back_inserter(text), "{},{},{}", k, path.grid.at(k), a + 1);
      append_values(text, Eigen::VectorXd(state.q.col(a)));
      append_values(text, Eigen::VectorXd(state.p.col(a)));
      text += '\n';
    }
  }
  return text;
}

}  // namespace pulson
