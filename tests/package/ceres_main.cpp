// Two points in the plane are shot at a target by Ceres, by the installed component pulson::ceres.

#include <iostream>

#include <ceres/ceres.h>
#include <pulson/ceres/shot_cost.hpp>
#include <pulson/kernels/kernel_operator.hpp>
#include <pulson/noise/noise_table.hpp>

int main() {
  const pulson::Points q0{{0.0, 1.0}, {0.0, 0.0}}, target{{0.2, 1.1}, {0.3, -0.2}};
  pulson::Points p0 = pulson::Points::Zero(2, 2);
  ceres::Problem problem;
  problem.AddResidualBlock(new pulson::ShotCost({{pulson::make_kernel("gaussian:alpha=1"), pulson::make_noise("none")},
                                                 pulson::make_integrator("rk4"),
                                                 {1, 10},
                                                 q0},
                                                target),
                           nullptr, p0.data());
  ceres::Solver::Options options;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  std::cout << summary.BriefReport() << '\n';
  return summary.final_cost < 1e-12 ? 0 : 1;
}
