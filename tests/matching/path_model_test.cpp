// The derivatives of the cost of a path against differences, and its Gauss–Newton model against dense matrices.

#include "path_model.hpp"

#include <ostream>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "kernel_definition.hpp"
#include "path_examples.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const std::string kPlainKernel = "gaussian:alpha=0.9";

// ∂F along a change of the nodes by differences of F, and by the model.
void expect_gradient(PathExample& example, const DataTerm& data) {
  ASSERT_TRUE(example.path);
  const NodeCovector gradient = PathModel(*example.system, data, *example.path, kWeight).gradient();
  EXPECT_TRUE(gradient.front().isZero(0));
  for (int i = 0; i < 3; ++i) {
    const std::vector<Points> change = example.change();
    const auto cost = [&](double s) {
      const std::optional<DiscretePath> path = along(*example.system, example.grid, example.moved(s, change));
      return VectorXd::Constant(1, path.value().energy + kWeight * data.value(path->end()));
    };
    const double right = derivative(cost, 2e-3)[0];
    EXPECT_NEAR(stacked(gradient).dot(stacked(change)), right, 1e-8 * stacked(gradient).norm());
  }
}

// ∂²F along a direction of the model against differences of ∂F; D, whose second derivative is not exact, by itself.
void expect_hessian(PathExample& example, const DataTerm& data) {
  ASSERT_TRUE(example.path);
  const PathModel model(*example.system, data, *example.path, kWeight);
  PathDirection direction = model.solve(example.change());
  direction.scale(1 / stacked(direction.nodes).norm());
  const auto gradient = [&](double s) {
    const std::optional<DiscretePath> path = along(*example.system, example.grid, example.moved(s, direction.nodes));
    NodeCovector all = PathModel(*example.system, data, path.value(), kWeight).gradient();
    all.back() -= kWeight * data.gradient(path->end());
    return stacked(all);
  };
  VectorXd right = derivative(gradient, 5e-3);
  const MatrixXd end = direction.nodes.back().reshaped();
  const MatrixXd all = MatrixXd::Identity(end.size(), end.size());
  const MatrixXd f = data.linearise(example.path->end(), all).changes;
  right.tail(end.size()) += kWeight * f.transpose() * f * end;
  VectorXd found = stacked(model.hessian(direction));
  found.head(end.size()).setZero();
  right.head(end.size()).setZero();
  EXPECT_LE((found - right).norm(), 1e-7 * right.norm());
}

struct Model {
  std::string kernel, noise;
  int d;
};

std::ostream& operator<<(std::ostream& out, const Model& model) {
  return out << model.kernel << "__" << model.noise << "_in_" << model.d << "d";
}

// Each noise with one kernel, and each kernel with two noises.
std::vector<Model> all_models() {
  std::vector<Model> all;
  for (const int d : {1, 2, 3}) {
    for (const std::string& noise : linear_noise_specs()) all.push_back({kPlainKernel, noise, d});
    for (const std::string& kernel : kernel_specs()) {
      if (kernel == kPlainKernel) continue;
      for (const char* noise : {"none", "ch-sd-screened:beta=0.3,gamma=0.8"}) all.push_back({kernel, noise, d});
    }
  }
  return all;
}

class PathModelContract : public testing::TestWithParam<Model> {
 protected:
  PathExample example_{GetParam().kernel, GetParam().noise, GetParam().d, 4, 3};
};

INSTANTIATE_TEST_SUITE_P(Table, PathModelContract, testing::ValuesIn(all_models()),
                         [](const auto& instance) { return test_name(testing::PrintToString(instance.param)); });

// The momenta are those of least energy that move the landmarks so: by H_tot, their velocity is what moves them.
TEST_P(PathModelContract, PathHasTheMomentaAndTheEnergyOfItsNodes) {
  ASSERT_TRUE(example_.path);
  const DiscretePath& path = *example_.path;
  double energy = 0;
  for (std::size_t k = 0; k < path.middles.size(); ++k) {
    const Points moved = example_.nodes[k + 1] - example_.nodes[k];
    EXPECT_LE((path.grid.dt() * example_.system->velocity(path.middles[k]) - moved).norm(), 1e-8 * moved.norm());
    energy += path.grid.dt() * example_.system->value(path.middles[k]);
  }
  EXPECT_NEAR(path.energy, energy, 1e-8 * energy);
}

TEST_P(PathModelContract, FieldsCarryTheLandmarksAlongThePath) {
  ASSERT_TRUE(example_.path);
  std::vector<Points> guess = example_.nodes;
  for (std::size_t k = 1; k < guess.size(); ++k) guess[k] += 1e-3 * example_.numbers(example_.d, example_.n);
  const auto nodes = carried(example_.system->system(), example_.grid, example_.nodes.front(),
                             fields_of(*example_.system, *example_.path), guess);
  ASSERT_TRUE(nodes);
  EXPECT_LE((stacked(*nodes) - stacked(example_.nodes)).norm(), 1e-9);
}

TEST_P(PathModelContract, HasTheGradientOfTheCost) { expect_gradient(example_, *plain_data(example_)); }

TEST_P(PathModelContract, HasTheSecondDerivativesOfTheCost) { expect_hessian(example_, *plain_data(example_)); }

TEST(PathModel, HasTheDerivativesOfPartialData) {
  for (const int d : {1, 2, 3}) {
    PathExample example(kPlainKernel, "ch-sd:beta=0.3", d, 4, 3);
    const auto data = partial_data(example);
    expect_gradient(example, *data);
    expect_hessian(example, *data);
  }
}

TEST(PathModel, HasTheDerivativesOfCurves) {
  for (const int d : {2, 3}) {
    PathExample example(kPlainKernel, "ch-sd:beta=0.3", d, 5, 3);
    const auto data = curve_data(example);
    expect_gradient(example, *data);
    expect_hessian(example, *data);
  }
}

}  // namespace
}  // namespace pulson::matching
