// Searches over paths against direct transcription: all momenta and controls of all steps are unknowns of a dense
// least-squares problem, which another library solves, from paths that are simulated forwards.

#include <cmath>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "path_examples.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// J = ½|r|² of z = (p_1 … p_K, u_1 … u_K): r = √(λΔt) Lᵀp_k with LLᵀ = K(q̄_k), √Δt u_k, and what the data have.
class Transcription {
 public:
  explicit Transcription(const PathMatch& match)
      : problem_(match.problem()),
        size_(match.source.size()),
        channels_(problem_.system.noise->channels(static_cast<int>(match.source.rows()),
                                                  static_cast<int>(match.source.cols()))) {}

  Index unknowns() const { return problem_.grid.steps * (size_ + channels_); }
  Index residuals() const { return unknowns() + problem_.data->residual(problem_.source).size(); }

  bool operator()(double const* const* parameters, double* residuals) const {
    const Eigen::Map<const VectorXd> z(parameters[0], unknowns());
    const double dt = problem_.grid.dt();
    const Index d = problem_.source.rows(), n = problem_.source.cols(), steps = problem_.grid.steps;
    Eigen::Map<VectorXd> r(residuals, this->residuals());
    Points q = problem_.source;
    for (Index k = 0; k < steps; ++k) {
      const Points p = z.segment(k * size_, size_).reshaped(d, n);
      const VectorXd u = z.segment(steps * size_ + k * channels_, channels_);
      Points next = q, middle = q, before;
      for (int i = 0; i < 200 && (i == 0 || (next - before).norm() > 1e-15 * q.norm()); ++i) {
        before = next;
        next = q + dt * velocity(middle, p, u);
        middle = 0.5 * (q + next);
      }
      const MatrixXd root = problem_.system.kernel.gram(middle, middle).llt().matrixL();
      r.segment(k * size_, size_) = std::sqrt(problem_.lambda * dt) * (p * root).reshaped();
      r.segment(steps * size_ + k * channels_, channels_) = std::sqrt(dt) * u;
      q = next;
    }
    r.tail(r.size() - unknowns()) = problem_.data->residual(q);
    return q.allFinite();
  }

 private:
  Points velocity(const Points& q, const Points& p, const VectorXd& u) const {
    Points v = problem_.system.kernel.apply(q, q, p);
    if (channels_ > 0) v += problem_.system.noise->gradient({q, p}, u).p;
    return v;
  }

  MatchingProblem problem_;
  Index size_;
  Index channels_;
};

// The lowest J by direct transcription, from landmarks at rest.
double transcribed(const PathMatch& match) {
  const Transcription transcription(match);
  auto* cost = new ceres::DynamicNumericDiffCostFunction<Transcription, ceres::CENTRAL>(new Transcription(match));
  cost->AddParameterBlock(static_cast<int>(transcription.unknowns()));
  cost->SetNumResiduals(static_cast<int>(transcription.residuals()));
  VectorXd z = VectorXd::Zero(transcription.unknowns());
  ceres::Problem problem;
  problem.AddResidualBlock(cost, nullptr, z.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-11;
  options.gradient_tolerance = 1e-9;
  options.parameter_tolerance = 1e-10;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  EXPECT_EQ(summary.termination_type, ceres::CONVERGENCE) << summary.message;
  return summary.final_cost;
}

void expect_transcribed(const PathMatch& match) {
  SCOPED_TRACE(match.noise);
  const double right = transcribed(match);
  EXPECT_NEAR(match.search().cost.total(), right, 1e-9 * right);
}

TEST(PathTranscription, HasTheSameMinimumForEachNoise) {
  for (const std::string& noise : linear_noise_specs()) {
    PathMatch match = nearby_shapes(noise, 2, 3);
    match.kernel = "gaussian:alpha=0.8";
    match.grid = {0.7, 4};
    match.sigma = 0.03;
    match.lambda = 1.6;
    expect_transcribed(match);
  }
}

TEST(PathTranscription, HasTheSameMinimumForEachKernelAndDimension) {
  for (const int d : {1, 2, 3})
    for (const std::string& kernel : kernel_specs()) {
      PathMatch match = nearby_shapes("ch-sd-screened:beta=0.4,gamma=0.8", d, 2);
      match.kernel = kernel;
      match.grid = {1, 4};
      match.sigma = 0.03;
      expect_transcribed(match);
    }
}

TEST(PathTranscription, HasTheSameMinimumForSwaps) {
  for (const double beta : {0.5, 1.0}) {
    PathMatch match{Points{{0, 1}}, Points{{1, 0}}, "gaussian:alpha=1", ch_sd(beta), {1, 6}, 0.02};
    expect_transcribed(match);
  }
}

}  // namespace
}  // namespace pulson::matching
