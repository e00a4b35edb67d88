// The derivatives of the cost of a path against differences, and its Gauss–Newton model against dense matrices.

#include "path_model.hpp"

#include <array>
#include <ostream>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "kernel_definition.hpp"
#include "numbers.hpp"
#include "path_examples.hpp"
#include "pulson/matching/curve_term.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kWeight = 1.3;
const std::string kPlainKernel = "gaussian:alpha=0.9";

// A path by chance, from q0 = landmarks 0.6 apart.
struct PathExample {
  PathExample(const std::string& kernel, const std::string& noise, int dimension, int count, int steps)
      : d(dimension), n(count), grid{0.8, steps}, numbers(static_cast<unsigned>(10 * d + n)) {
    const Points source = numbers.landmarks(d, n);
    const Points displacement = 0.3 * numbers(d, n);
    for (int k = 0; k <= steps; ++k)
      nodes.push_back(source + (k * 1.0 / steps) * displacement + (k > 0 ? 0.01 : 0) * numbers(d, n));
    system.emplace(make_system(kernel, noise, source), 1.4);
    path = along(*system, grid, nodes);
  }

  // Changes of the nodes, the first of which stays.
  std::vector<Points> change() {
    std::vector<Points> all(nodes.size(), Points::Zero(d, n));
    for (std::size_t j = 1; j < all.size(); ++j) all[j] = numbers(d, n);
    return all;
  }

  std::vector<Points> moved(double factor, const std::vector<Points>& by) const {
    std::vector<Points> all = nodes;
    for (std::size_t j = 0; j < all.size(); ++j) all[j] += factor * by[j];
    return all;
  }

  int d, n;
  TimeGrid grid;
  Numbers numbers;
  std::vector<Points> nodes;
  std::optional<EffectiveHamiltonian> system;
  std::optional<DiscretePath> path;
};

std::shared_ptr<const LandmarkTerm> plain_data(PathExample& example) {
  return std::make_shared<LandmarkTerm>(LandmarkObservations{example.numbers(example.d, example.n), 0.3});
}

// Landmarks that were observed in part, with weights and covariances.
std::shared_ptr<const LandmarkTerm> partial_data(PathExample& example) {
  const int d = example.d, n = example.n;
  LandmarkObservations data{example.numbers(d, n), 0.3};
  data.target(0, 1) = kNaN;
  data.target.col(2).setConstant(kNaN);
  data.weights = VectorXd::LinSpaced(n, 0, 2);
  for (int a = 0; a < n; ++a) {
    const MatrixXd root = example.numbers(d, d);
    data.covariances.emplace_back(0.1 * MatrixXd::Identity(d, d) + 0.2 * root * root.transpose());
  }
  return std::make_shared<LandmarkTerm>(data);
}

std::shared_ptr<const CurveTerm> curve_data(PathExample& example) {
  const int n = example.n;
  std::vector<std::pair<int, int>> edges;
  for (int a = 0; a + 1 < n; ++a) edges.emplace_back(a, a + 1);
  const Curve target{example.numbers.landmarks(example.d, n), edges};
  return std::make_shared<CurveTerm>(edges, n, target, CurveTermOptions{CurveMeasure::kVarifold, 0.3, 0.8});
}

// f' at 0 by central differences of order 8.
template <class Function>
auto derivative(const Function& f, double h) {
  constexpr std::array<double, 4> kWeights{4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
  auto sum = ((f(h) - f(-h)) * (kWeights[0] / h)).eval();
  for (int i = 1; i < 4; ++i) sum += (f((i + 1) * h) - f(-(i + 1) * h)) * (kWeights[static_cast<std::size_t>(i)] / h);
  return sum;
}

VectorXd stacked(const std::vector<Points>& all) {
  VectorXd sum(static_cast<Index>(all.size()) * all.front().size());
  for (std::size_t j = 0; j < all.size(); ++j)
    sum.segment(static_cast<Index>(j) * all[j].size(), all[j].size()) = all[j].reshaped();
  return sum;
}

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
}  // namespace pulson
