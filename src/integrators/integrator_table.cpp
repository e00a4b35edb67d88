#include <fmt/core.h>

#include "pulson/integrators/variational.hpp"

namespace pulson {

StepError::StepError(int step, const TimeGrid& grid, const std::string& reason)
    : InputError(fmt::format("step {} of {} (dt = {:.4g}): {}; use more steps, as in --steps {}", step + 1, grid.steps,
                             grid.dt(), reason, 2 * grid.steps)),
      step_(step) {}

const NameTable<MakeIntegrator>& integrator_table() {
  static const NameTable<MakeIntegrator> kTable(
      "integrator",
      {{"variational",
        {},
        "the stochastic variational integrator, equation (20): symplectic, implicit in the positions",
        []() -> std::unique_ptr<const Integrator> { return std::make_unique<VariationalIntegrator>(); }}});
  return kTable;
}

std::unique_ptr<const Integrator> make_integrator(std::string_view name) {
  return integrator_table().find(name).make();
}

Eigen::MatrixXd acting_increments(const Eigen::MatrixXd& increments) {
  Eigen::MatrixXd w = 0.5 * increments;
  const Eigen::Index k = increments.cols();
  if (k > 1) w.rightCols(k - 1) += 0.5 * increments.leftCols(k - 1);
  return w;
}

Eigen::MatrixXd acting_increments_transposed(const Eigen::MatrixXd& acting_bar) {
  Eigen::MatrixXd bar = 0.5 * acting_bar;
  const Eigen::Index k = acting_bar.cols();
  if (k > 1) bar.leftCols(k - 1) += 0.5 * acting_bar.rightCols(k - 1);
  return bar;
}

}  // namespace pulson
