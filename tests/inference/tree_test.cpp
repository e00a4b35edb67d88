// The posterior of a tree of paths.

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "inference/parameters.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/inference/posterior.hpp"
#include "random/normals.hpp"

namespace pulson::inference {

using posterior::Specimen;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::ThrowsMessage;

Landmarks called(const std::string& name, const Points& points) {
  Landmarks landmarks;
  landmarks.name = landmarks.source = name;
  landmarks.points = points;
  return landmarks;
}

// ((a:1,b:1)x:1,c:2)
const std::vector<TreeNode> kTree = {{"", -1, 0}, {"x", 0, 1}, {"a", 1, 1}, {"b", 1, 1}, {"c", 0, 2}};

matching::RegistrationOptions along_tree(const std::string& noise, double sigma) {
  matching::RegistrationOptions options;
  options.noise = noise;
  options.sigma = sigma;
  options.grid = {2, 8};
  return options;
}

SamplerOptions long_chains() {
  SamplerOptions options;
  options.warmup = 300;
  options.draws = 1500;
  return options;
}

// Position noise alone is Brownian motion along the tree: coordinates are independent and Gaussian, those of two leaves
// have the covariance β² times the time that they share (J. Felsenstein 1985).
class BrownianTree : public testing::Test {
 protected:
  static constexpr double kBeta = 0.5, kSigma = 0.3;
  Points root{{0.0, 4.0}, {0.0, 1.0}};
  Eigen::Matrix<double, 3, 4> leaves{{0.9, 4.1, -0.4, 1.2}, {0.3, 4.6, 0.2, 0.4}, {-0.8, 3.3, 0.5, 1.9}};  // xx, yy

  std::vector<Landmarks> shapes() const {
    std::vector<Landmarks> all;
    for (int i = 0; i < 3; ++i)
      all.push_back(called(std::string(1, static_cast<char>('a' + i)),
                           Points{{leaves(i, 0), leaves(i, 1)}, {leaves(i, 2), leaves(i, 3)}}));
    return all;
  }
  // Of the leaves; x shares one unit of time with a and b.
  static Eigen::Matrix3d covariance(double beta) {
    const Eigen::Matrix3d shared{{2, 1, 0}, {1, 2, 0}, {0, 0, 2}};
    return beta * beta * shared + kSigma * kSigma * Eigen::Matrix3d::Identity();
  }
  Eigen::Matrix<double, 3, 4> off() const {
    return leaves.rowwise() - Eigen::RowVector4d(root(0, 0), root(0, 1), root(1, 0), root(1, 1));
  }
  double log_density(double beta) const {
    const Eigen::LLT<Eigen::Matrix3d> factors(covariance(beta));
    const Eigen::Matrix3d lower = factors.matrixL();
    const Eigen::Matrix<double, 3, 4> white = factors.matrixL().solve(off());
    return -0.5 * white.squaredNorm() - 4 * lower.diagonal().array().log().sum() - 6 * std::log(2 * std::numbers::pi);
  }
  PosteriorProblem problem(const std::vector<std::string>& parameters) const {
    return make_tree_problem(called("root", root), kTree, shapes(), along_tree("ch-sd:beta=0.5", kSigma), parameters);
  }
};

TEST_F(BrownianTree, HasTheClosedForm) {
  const PosteriorDraws draws = sample_posterior(problem({}), long_chains());
  ASSERT_EQ(draws.ends.size(), 4U);
  const Eigen::Vector3d with_x(kBeta * kBeta, kBeta * kBeta, 0);
  const Eigen::Vector3d gain = covariance(kBeta).llt().solve(with_x);
  const double variance = kBeta * kBeta - gain.dot(with_x);
  for (int i = 0; i < 4; ++i) {
    const int landmark = i % 2, axis = i / 2;
    const MatrixXd x = draws.by_chain(draws.ends[0].row(2 * landmark + axis));
    const DrawSummary summary = summarise(x);
    const double mean = root(axis, landmark) + gain.dot(off().col(i));
    EXPECT_NEAR(summary.mean, mean, 4 * summary.mcse);
    const DrawSummary squares = summarise((x.array() - mean).square());
    EXPECT_NEAR(squares.mean, variance, 4 * squares.mcse);
    EXPECT_LT(summary.rhat, 1.01);
  }
  EXPECT_NEAR(draws.log_evidence.value, log_density(kBeta), 4 * draws.log_evidence.standard_error + 1e-4);
  EXPECT_NEAR(draws.laplace_log_evidence, log_density(kBeta), 1e-6);
  EXPECT_TRUE(draws.momenta.empty());
}

TEST_F(BrownianTree, HasTheAmplitudeOfQuadrature) {
  const PosteriorDraws draws = sample_posterior(problem({"beta"}), long_chains());
  double sum = 0, mean = 0;
  for (double phi = -6; phi <= 6; phi += 0.01) {  // log β ~ N(log ½, ½²)
    const double beta = kBeta * std::exp(0.5 * phi);
    const double density = std::exp(log_density(beta) - 0.5 * phi * phi);
    sum += density;
    mean += density * std::log(beta);
  }
  const DrawSummary of_log = summarise(draws.by_chain(draws.parameters.row(0).array().log().matrix()));
  EXPECT_NEAR(of_log.mean, mean / sum, 4 * of_log.mcse);
  EXPECT_LT(of_log.rhat, 1.01);
  EXPECT_NEAR(draws.log_evidence.value, std::log(sum * 0.01 / std::sqrt(2 * std::numbers::pi)),
              4 * draws.log_evidence.standard_error + 1e-3);
}

// Fields that move with the landmarks bend the paths: gradient and slopes against central differences.
TEST(TreeSpecimen, HasExactDerivatives) {
  const Points root{{0.0, 1.0, 0.2}, {0.0, 0.3, 1.0}};
  std::vector<Landmarks> shapes;
  for (const char* name : {"a", "b", "c"}) shapes.push_back(called(name, root.array() + 0.2));
  shapes.back().points(1, 2) = std::nan("");  // not observed
  for (const std::string noise : {"kunita:beta=0.6,width=0.9", "trouve-vialard:sigma=0.8"}) {
    SCOPED_TRACE(noise);
    const PosteriorProblem problem = make_tree_problem(called("root", root), kTree, shapes, along_tree(noise, 0.1), {});
    const Specimen specimen(problem.specimens.front(), problem.tree);
    ASSERT_EQ(specimen.data(), 17);
    const Specimen::Model model = specimen.model(ParameterSpace(problem).at(VectorXd()));
    const auto count = static_cast<int>(specimen.unknowns());
    const VectorXd z = standard_normals(1, 1, count, 1), way = standard_normals(1, 2, count, 1);
    const double h = 1e-5;
    const auto here = specimen.shoot(model, z), above = specimen.shoot(model, z + h * way),
               below = specimen.shoot(model, z - h * way);
    ASSERT_TRUE(here && above && below);
    const VectorXd change = (above->residual - below->residual) / (2 * h);
    EXPECT_NEAR(specimen.transposed(model, *here, here->residual).dot(way), change.dot(here->residual),
                1e-6 * change.norm() * here->residual.norm());
    const Specimen::Slopes slopes = specimen.slopes(model, *here);
    VectorXd by_slopes = VectorXd::Zero(specimen.data());
    for (std::size_t b = 0; b < slopes.branches.size(); ++b) {
      const Specimen::Place& place = specimen.places()[b];
      by_slopes.segment(place.first_datum, place.data) +=
          slopes.branches[b].by_end * (slopes.branches[b].end * way.segment(place.first_unknown, place.unknowns));
    }
    EXPECT_LT((by_slopes - change).norm(), 1e-6 * change.norm());
  }
}

TEST(TreeProblem, SaysWhatIsWrong) {
  const Points root{{0.0, 1.0}};
  const Landmarks source = called("root", root), a = called("a", root), b = called("b", root), c = called("c", root),
                  d = called("d", root);
  const auto make = [&](const std::vector<Landmarks>& shapes, const std::string& noise = "ch-sd:beta=1",
                        const std::vector<std::string>& parameters = {}, std::vector<TreeNode> tree = kTree) {
    return [=] { make_tree_problem(source, tree, shapes, along_tree(noise, 0.1), parameters); };
  };
  EXPECT_NO_THROW(make({a, b, c})());
  EXPECT_THAT(make({a, b}), ThrowsMessage<InputError>("no shape is given for the leaf 'c'"));
  EXPECT_THAT(make({a, b, c, d}), ThrowsMessage<InputError>(testing::StartsWith("the tree has no node 'd'")));
  EXPECT_THAT(make({a, b, c, c}), ThrowsMessage<InputError>(testing::HasSubstr("the names 'c', 'c' are alike")));
  EXPECT_THAT(make({a, b, c}, "none"),
              ThrowsMessage<InputError>("a tree needs noise: nothing else moves the shapes along it"));
  EXPECT_THAT(make({a, b, c}, "ch-sd:beta=1", {"lambda=0.2"}),
              ThrowsMessage<InputError>("'lambda' has no effect on a tree, whose root has no momenta"));
  std::vector<TreeNode> tree = kTree;
  tree[3].length = 0;
  EXPECT_THAT(make({a, b, c}, "ch-sd:beta=1", {}, tree),
              ThrowsMessage<InputError>("the branch to 'b' has the length 0; it must be greater than 0"));
  const PosteriorProblem all = make_tree_problem(source, kTree, {a, b, c}, along_tree("ch-sd:beta=1", 0.1), {"all"});
  ASSERT_EQ(all.parameters.size(), 2U);  // no lambda, no alpha
  EXPECT_EQ(all.tree[0].grid.steps, 4);
  EXPECT_EQ(all.tree[3].grid.time, 2);
}

TEST(TreeProblem, SaysThatPlacesOfShapesCountAsEvolution) {
  const Points root{{0.0, 1, 1, 0}, {0, 0, 2, 2}};
  const auto notes = [&](const Points& shape, std::optional<AlignmentKind> alignment) {
    const std::vector<Landmarks> shapes = {called("a", shape), called("b", shape), called("c", shape)};
    matching::RegistrationOptions options = along_tree("ch-sd:beta=1", 0.1);
    options.align = alignment;
    return make_tree_problem(called("root", root), kTree, shapes, options, {}).notes;
  };
  Points bent = root;
  bent(0, 0) += 0.5;
  const Points moved = (2 * bent).array() + 3;
  EXPECT_THAT(notes(bent, {}), testing::Not(testing::Contains(testing::HasSubstr("evolution"))));
  EXPECT_THAT(notes(moved, {}), testing::Contains(testing::HasSubstr("count as evolution; `align = similarity`")));
  EXPECT_THAT(notes(moved, AlignmentKind::kNone), testing::Not(testing::Contains(testing::HasSubstr("evolution"))));
}

// Where a path divides, the likelihood of what is behind is that of one value: the mean of those at the ends by
// 1/length, with the length 1/Σ 1/length (J. Felsenstein, Am. J. Hum. Genet. 25, 1973).
std::pair<double, double> pruned(const std::vector<TreeNode>& tree, const std::vector<double>& values,
                                 std::size_t node) {
  double precision = 0, sum = 0;
  if (std::isfinite(values[node])) return {values[node], 0};
  for (std::size_t child = node + 1; child < tree.size(); ++child) {
    if (tree[child].parent != static_cast<int>(node)) continue;
    const auto [value, length] = pruned(tree, values, child);
    if (std::isnan(value)) continue;
    precision += 1 / (tree[child].length + length);
    sum += value / (tree[child].length + length);
  }
  return {sum / precision, 1 / precision};
}

TEST(BrownianRoot, IsThatOfPruning) {
  // ((a:1,b:1)x:1,c:2,(d:0.5,e:1.5):0.7)
  const std::vector<TreeNode> tree = {{"", -1, 0}, {"x", 0, 1},  {"a", 1, 1},   {"b", 1, 1},
                                      {"c", 0, 2}, {"", 0, 0.7}, {"d", 5, 0.5}, {"e", 5, 1.5}};
  const double none = std::numeric_limits<double>::quiet_NaN();
  std::vector<Landmarks> shapes;
  const std::vector<std::vector<double>> rows = {{1, 0.3}, {2.5, none}, {-1, 4}, {3, 1}, {0.2, -2}};
  for (std::size_t i = 0; i < rows.size(); ++i)
    shapes.push_back(called(std::string(1, static_cast<char>('a' + i)), Points{{rows[i][0]}, {rows[i][1]}}));
  const Landmarks root = brownian_root(tree, shapes);
  EXPECT_NEAR(root.points(0, 0), 1.338262, 5e-7);  // fastAnc of phytools 1.5
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    std::vector<double> values(tree.size(), none);
    for (const Landmarks& shape : shapes)
      for (std::size_t i = 0; i < tree.size(); ++i)
        if (tree[i].name == shape.name) values[i] = shape.points(axis, 0);
    EXPECT_NEAR(root.points(axis, 0), pruned(tree, values, 0).first, 1e-12);
  }
  // A known ancestor hides what is behind it.
  shapes.push_back(called("x", Points{{0.5}, {0.5}}));
  const Landmarks known = brownian_root(tree, shapes);
  shapes[0].points.setConstant(9);
  EXPECT_NEAR(brownian_root(tree, shapes).points(0, 0), known.points(0, 0), 1e-12);
  for (Landmarks& shape : shapes) shape.points(1, 0) = none;
  EXPECT_THAT([&] { static_cast<void>(brownian_root(tree, shapes)); },
              ThrowsMessage<InputError>(testing::HasSubstr("missing in all shapes")));
}

}  // namespace
}  // namespace pulson::inference
