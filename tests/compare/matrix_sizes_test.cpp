// Matrices of sizes that do not fit together are refused where they enter the library, in every build.

#include <functional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pulson/compare/comparison.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/ensemble/ensemble.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/matching/objective.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/warp/material_flow.hpp"
#include "pulson/warp/sampled_map.hpp"
#include "random/normals.hpp"

namespace pulson::compare {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::HasSubstr;

const Points kSquare{{0, 1, 1, 0}, {0, 0, 1, 1}};
const Points kTriangle = kSquare.leftCols(3);
const Points kLine = kSquare.topRows(1);

/// @param sizes the size found, and the one needed, as the message has them
void expect_refused(const std::function<void()>& action, const std::string& found, const std::string& needed) {
  try {
    action();
    ADD_FAILURE() << found << " was taken for " << needed;
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("a matrix of " + found + "; " + needed + " is needed"));
  }
}

StochasticSystem noisy_system() { return {make_kernel("gaussian:alpha=1"), make_noise("ch-sd:beta=0.1")}; }

TEST(MatrixSizes, OfKernelSums) {
  const KernelOperator kernel = make_kernel("gaussian:alpha=1");
  MatrixXd jacobian;
  expect_refused([&] { kernel.apply(kSquare, kLine, kLine); }, "1 x 4", "2 x 4");
  expect_refused([&] { kernel.apply(kSquare, kTriangle, kSquare); }, "2 x 4", "2 x 3");
  expect_refused([&] { kernel.apply_with_jacobian(kSquare, kSquare, kTriangle, jacobian); }, "2 x 3", "2 x 4");
  expect_refused([&] { kernel.apply_tangent(kSquare, kSquare, kTriangle); }, "2 x 3", "2 x 4");
  expect_refused([&] { kernel.gradient(kSquare, kTriangle, kSquare); }, "2 x 3", "2 x 4");
  expect_refused([&] { kernel.hessian(kSquare, kTriangle, kSquare); }, "2 x 3", "2 x 4");
  expect_refused([&] { kernel.gram(kSquare, kLine); }, "1 x 4", "2 x 4");
  expect_refused([&] { kernel.step_matrices(kSquare, kTriangle, 0.1, CoordinateOrder::kByLandmark); }, "2 x 3",
                 "2 x 4");
  EXPECT_THROW(kernel.gram(MatrixXd::Zero(4, 2), MatrixXd::Zero(4, 2)), InputError);
}

TEST(MatrixSizes, OfPaths) {
  const StochasticSystem system = noisy_system();
  const TimeGrid grid{1, 5};
  const MatrixXd increments = MatrixXd::Zero(8, 5);
  for (const auto& row : integrator_table().rows()) {
    const auto integrator = row.make();
    const StochasticSystem own{system.kernel, integrator->traits().noise ? system.noise : make_noise("none")};
    const MatrixXd dw = integrator->traits().noise ? increments : MatrixXd::Zero(0, 5);
    expect_refused([&] { integrator->integrate(own, {kSquare, kTriangle}, grid, dw); }, "2 x 3", "2 x 4");
    const std::string channels = std::to_string(dw.rows());
    expect_refused(
        [&] {
          integrator->integrate(own, {kSquare, kSquare}, grid, dw.leftCols(4));
        },
        channels + " x 4", channels + " x 5");
    const Trajectory path = integrator->integrate(own, {kSquare, kSquare}, grid, dw);
    expect_refused([&] { integrator->tangent(own, path, {{kSquare, kTriangle}, dw, {}}); }, "2 x 3", "2 x 4");
    expect_refused(
        [&] {
          integrator->tangent(own, path, {{kSquare, kSquare}, dw.leftCols(4), {}});
        },
        channels + " x 4", channels + " x 5");
    expect_refused([&] { integrator->adjoint(own, path, {kTriangle, kSquare}); }, "2 x 3", "2 x 4");
    expect_refused([&] { integrator->endpoint_changes(own, path, MatrixXd::Zero(6, 2)); }, "6 x 2", "8 x 2");
  }
  const auto integrator = make_integrator("variational");
  expect_refused(
      [&] {
        ensemble::sample_paths(system, *integrator, {kSquare, kTriangle}, {.grid = grid});
      },
      "2 x 3", "2 x 4");
  expect_refused(
      [&] {
        ensemble::Ensemble(system, "variational", {kSquare, kTriangle}, {.grid = grid});
      },
      "2 x 3", "2 x 4");
  EXPECT_THROW(standard_normals(1, 0, -1, 5), InputError);
}

TEST(MatrixSizes, OfMatching) {
  expect_refused([&] { align(kSquare, kTriangle, AlignmentKind::kRigid); }, "2 x 3", "2 x 4");
  expect_refused([&] { align(kSquare, kSquare, AlignmentKind::kNone).apply(kLine); }, "1 x 4", "2 x 4");
  expect_refused([&] { matching::fit_displacements(kSquare, kTriangle, {.sigma = 0.1}); }, "2 x 3", "2 x 4");
  expect_refused([&] { matching::distances(kSquare, kTriangle); }, "2 x 3", "2 x 4");
  expect_refused([&] { matching::order_inversions(kSquare, kSquare); }, "2 x 4", "1 x 4");
  const matching::LandmarkTerm term({.target = kSquare, .sigma = 0.1});
  expect_refused([&] { term.value(kTriangle); }, "2 x 3", "2 x 4");
  expect_refused([&] { term.gradient(kTriangle); }, "2 x 3", "2 x 4");
  expect_refused([&] { term.linearise(kSquare, MatrixXd::Zero(6, 1)); }, "6 x 1", "8 x 1");
  expect_refused([&] { term.moved(kTriangle); }, "2 x 3", "2 x 4");

  matching::MatchingProblem problem{noisy_system(),
                                    make_integrator("variational-2"),
                                    {1, 5},
                                    kSquare,
                                    std::make_shared<matching::LandmarkTerm>(term),
                                    0.1,
                                    1};
  const matching::MatchingObjective objective(problem);
  const MatrixXd increments = MatrixXd::Zero(8, 5);
  expect_refused([&] { objective.evaluate(VectorXd::Zero(7)); }, "7 x 1", "48 x 1");
  expect_refused([&] { objective.increments(VectorXd::Zero(7)); }, "7 x 1", "48 x 1");
  expect_refused([&] { objective.white(kTriangle, increments); }, "2 x 3", "2 x 4");
  expect_refused([&] { objective.white(kSquare, increments.leftCols(4)); }, "8 x 4", "8 x 5");
  problem.realisations = {increments, increments.leftCols(4)};
  expect_refused([&] { matching::MatchingObjective{problem}; }, "8 x 4", "8 x 5");

  Landmarks named;
  named.points = kSquare;
  Landmarks short_of_names = named;
  short_of_names.labels = {"a", "b"};
  EXPECT_THROW(matching::register_shapes(short_of_names, named), InputError);
}

TEST(MatrixSizes, OfMapsAndPredictions) {
  const StochasticSystem system = noisy_system();
  const Trajectory path = make_integrator("variational")
                              ->integrate(system, {kSquare, 0.1 * kSquare}, {1, 5}, MatrixXd::Constant(8, 5, 0.1));
  for (const warp::LabelKernel labels : {warp::LabelKernel::kMetric, warp::LabelKernel::kThinPlate}) {
    const warp::MaterialFlow flow(system, path, labels);
    expect_refused([&] { flow.end(kLine); }, "1 x 4", "2 x 4");
    expect_refused([&] { flow.end_with_gradients(kLine); }, "1 x 4", "2 x 4");
    expect_refused([&] { flow.paths(kLine); }, "1 x 4", "2 x 4");
    const auto space = warp::LabelSpace::make(labels, system.kernel, kSquare);
    expect_refused([&] { space->coefficients(kTriangle); }, "2 x 3", "2 x 4");
    expect_refused([&] { space->basis(kLine); }, "1 x 4", "2 x 4");
  }
  expect_refused([&] { warp::delaunay_triangles(kLine); }, "1 x 4", "2 x 4");
  expect_refused([&] { warp::flipped_triangles(kSquare, kTriangle); }, "2 x 3", "2 x 4");
  expect_refused([&] { energy_score(MatrixXd::Zero(3, 5), VectorXd::Zero(4)); }, "3 x 5", "4 x 5");
  expect_refused([&] { coverage(MatrixXd::Zero(3, 5), VectorXd::Zero(4), 0.9); }, "3 x 5", "4 x 5");
}

}  // namespace
}  // namespace pulson::compare
