#include "csv_rows.hpp"

namespace pulson {

std::string axis_names(std::string_view prefix, Eigen::Index d) {
  std::string text;
  for (Eigen::Index c = 0; c < d; ++c) text += fmt::format(",{}_{}", prefix, "xyz"[c]);
  return text;
}

std::string state_names(Eigen::Index d) { return axis_names("q", d) + axis_names("p", d); }

void append_states(std::string& text, const Trajectory& path, std::string_view first, int every,
                   const std::vector<int>& numbers) {
  const auto last = static_cast<int>(path.states.size()) - 1;
  for (int k = 0; k <= last; ++k) {
    if (k % every != 0 && k != last) continue;
    const PhaseState& state = path.states[static_cast<std::size_t>(k)];
    for (Eigen::Index a = 0; a < state.q.cols(); ++a) {
      fmt::format_to(std::back_inserter(text), "{}{},{},{}", first, k, path.grid.at(k),
                     numbers.empty() ? static_cast<int>(a) + 1 : numbers[static_cast<std::size_t>(a)]);
      append_values(text, Eigen::VectorXd(state.q.col(a)));
      append_values(text, Eigen::VectorXd(state.p.col(a)));
      text += '\n';
    }
  }
}

}  // namespace pulson
