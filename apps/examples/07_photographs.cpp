// Landmarks in space that are seen in two photographs, by cameras of unknown pose: the flow that carries a template to
// them and both poses in one problem of Ceres Solver, by component pulson::ceres.
//
//   $ 07_photographs
//   reprojection error 22.4 pixels by the template, 0.0441 by its flow
//   shape off by 0.243, 0.0064

#include <cmath>
#include <iostream>
#include <memory>
#include <vector>

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <pulson/ceres/shot_cost.hpp>
#include <pulson/core/alignment.hpp>
#include <pulson/kernels/kernel_operator.hpp>
#include <pulson/noise/noise_table.hpp>

namespace {

using Eigen::Index;
using pulson::Points;
using Pose = Eigen::Matrix<double, 6, 1>;  // angle times axis, then translation

constexpr double kFocalLength = 1000;  // pixels

template <class T>
void project(const T* pose, const T* x, T* pixel) {
  T seen[3];
  ceres::AngleAxisRotatePoint(pose, x, seen);
  for (int i = 0; i < 3; ++i) seen[i] += pose[3 + i];
  for (int i = 0; i < 2; ++i) pixel[i] = kFocalLength * seen[i] / seen[2];
}

Points photograph(const Points& landmarks, const Pose& pose) {
  Points pixels(2, landmarks.cols());
  for (Index a = 0; a < pixels.cols(); ++a) project(pose.data(), landmarks.col(a).data(), pixels.col(a).data());
  return pixels;
}

// The residual of one photograph as a function of momenta and pose: pixels to one pixel.
class Photograph {
 public:
  Photograph(const pulson::Shot& shot, Points pixels) : flow_(new pulson::ShotCost(shot)), pixels_(std::move(pixels)) {}

  template <class T>
  bool operator()(T const* const* parameters, T* residuals) const {
    std::vector<T> landmarks(static_cast<std::size_t>(3 * pixels_.cols()));
    if (!flow_(parameters, landmarks.data())) return false;
    for (Index a = 0; a < pixels_.cols(); ++a) {
      project(parameters[1], &landmarks[static_cast<std::size_t>(3 * a)], residuals + 2 * a);
      for (int i = 0; i < 2; ++i) residuals[2 * a + i] -= pixels_(i, a);
    }
    return true;
  }

 private:
  ceres::DynamicCostFunctionToFunctor flow_;
  Points pixels_;
};

ceres::CostFunction* cost_of(const pulson::Shot& shot, const Points& pixels) {
  auto* cost = new ceres::DynamicAutoDiffCostFunction<Photograph, 12>(new Photograph(shot, pixels));
  cost->AddParameterBlock(static_cast<int>(shot.q0.size()));
  cost->AddParameterBlock(6);
  cost->SetNumResiduals(static_cast<int>(pixels.size()));
  return cost;
}

Points flowed(const pulson::Shot& shot, const Points& p0) {
  return shot.integrator->integrate(shot.system, {shot.q0, p0}, shot.grid, Eigen::MatrixXd::Zero(0, shot.grid.steps))
      .final()
      .q;
}

double rms(const Points& differences) {
  return std::sqrt(differences.squaredNorm() / static_cast<double>(differences.cols()));
}

// Of shapes, wherever and however large they are: what two cameras of unknown pose can tell.
double shape_distance(const Points& x, const Points& y) {
  return rms(pulson::align(x, y, pulson::AlignmentKind::kSimilarity).apply(x) - y);
}

}  // namespace

int main() {
  // A template on a bumpy ellipsoid, and an individual that a flow makes of it.
  constexpr int kCount = 24;
  Points q0(3, kCount), truth(3, kCount);
  for (int a = 0; a < kCount; ++a) {
    const double z = 1 - (2 * a + 1.0) / kCount, r = std::sqrt(1 - z * z), angle = 2.4 * a;
    q0.col(a) << 1.3 * r * std::cos(angle), r * std::sin(angle), 0.8 * z;
    truth.col(a) = 0.12 * Eigen::Vector3d(q0(1, a), std::sin(3 * q0(0, a)), std::cos(2 * q0(1, a)));
  }
  const pulson::Shot shot{{pulson::make_kernel("gaussian:alpha=0.9"), pulson::make_noise("none")},
                          pulson::make_integrator("rk4"),
                          {1, 10},
                          q0};
  const Points individual = flowed(shot, truth);

  // Two cameras some 8 away, 70 degrees apart, and guesses of their poses.
  const std::vector<Pose> cameras = {{0.1, 0.05, 0, 0.1, 0, 8}, {0, 1.2, 0.1, 0, 0.2, 8.5}};
  std::vector<Pose> poses = {{0, 0, 0, 0, 0, 7}, {0, 1.4, 0, 0, 0, 7}};
  std::vector<Points> photographs;
  for (const Pose& camera : cameras) {
    photographs.push_back(photograph(individual, camera));
    for (Index i = 0; i < photographs.back().size(); ++i)  // errors of some half a pixel
      photographs.back().reshaped()[i] += 0.7 * std::sin(5.0 * static_cast<double>(i * i + 1));
  }
  Points p0 = Points::Zero(3, kCount);
  ceres::Problem problem;
  for (std::size_t i = 0; i < cameras.size(); ++i)
    problem.AddResidualBlock(cost_of(shot, photographs[i]), nullptr, p0.data(), poses[i].data());
  constexpr double kLambda = 25;  // displacements of some 1/5
  problem.AddResidualBlock(pulson::energy_prior(shot.system.kernel, q0, kLambda).release(), nullptr, p0.data());

  // The poses alone, then the flow with them.
  ceres::Solver::Options options;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = 200;
  ceres::Solver::Summary summary;
  const auto error = [&] {
    double squares = 0;
    for (std::size_t i = 0; i < cameras.size(); ++i)
      squares += std::pow(rms(photograph(flowed(shot, p0), poses[i]) - photographs[i]), 2);
    return std::sqrt(squares / 2);
  };
  problem.SetParameterBlockConstant(p0.data());
  ceres::Solve(options, &problem, &summary);
  const double before = error();
  problem.SetParameterBlockVariable(p0.data());
  ceres::Solve(options, &problem, &summary);

  std::cout.precision(3);
  std::cout << "reprojection error " << before << " pixels by the template, " << error() << " by its flow\n"
            << "shape off by " << shape_distance(q0, individual) << ", " << shape_distance(flowed(shot, p0), individual)
            << '\n';
}
