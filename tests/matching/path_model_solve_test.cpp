// The Gauss–Newton model of the cost of a path against dense matrices.

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "path_examples.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The fields of a path with other momenta in their steps, dN·K numbers added, that stay where they are.
StepFields with_momenta(const PathExample& example, const VectorXd& added) {
  StepFields fields = fields_of(*example.system, *example.path);
  const Index size = example.path->end().size();
  for (std::size_t k = 0; k < fields.momenta.size(); ++k) {
    const Points p = added.segment(static_cast<Index>(k) * size, size).reshaped(example.d, example.n);
    fields.momenta[k] += p;
    fields.controls[k] += example.system->controls({example.path->middles[k].q, p});
    fields.own[k] += own_velocities(*example.system, {example.path->middles[k].q, p});
  }
  return fields;
}

// The model by its definition: ½Σ Δt δp·A δp + ½w|F δq_K|² with δq = L δp, L by differences of carried landmarks.
struct DenseModel {
  DenseModel(const PathExample& example, const DataTerm& data) {
    const Index size = example.path->end().size(), unknowns = size * example.grid.steps;
    nodes.resize(size + unknowns, unknowns);
    matrix = MatrixXd::Zero(unknowns, unknowns);
    const MatrixXd identity = MatrixXd::Identity(unknowns, unknowns);
    for (Index i = 0; i < unknowns; ++i) {
      const auto moved = [&](double s) {
        return stacked(carried(example.system->system(), example.grid, example.nodes.front(),
                               with_momenta(example, s * identity.col(i)), example.nodes)
                           .value());
      };
      nodes.col(i) = derivative(moved, 1e-2);
      const Points p = identity.col(i % size).head(size).reshaped(example.d, example.n);
      const Points v = example.path->cometrics[static_cast<std::size_t>(i / size)].apply(p);
      matrix.col(i).segment(i / size * size, size) = example.grid.dt() * v.reshaped();
    }
    const MatrixXd f = data.linearise(example.path->end(), MatrixXd::Identity(size, size)).changes;
    precision = kWeight * f.transpose() * f;
    matrix += nodes.bottomRows(size).transpose() * precision * nodes.bottomRows(size);
  }

  MatrixXd nodes;      ///< L, (K + 1)dN × KdN
  MatrixXd matrix;     ///< of the model, in δp
  MatrixXd precision;  ///< wFᵀF
};

void expect_close(const VectorXd& found, const VectorXd& right) {
  EXPECT_LE((found - right).norm(), 1e-8 * right.norm());
}

// Where landmarks end that are `change` off at node k and stay in the fields of the path.
Points end_from(const PathExample& example, std::size_t k, const Points& change) {
  const StepFields fields = fields_of(*example.system, *example.path);
  Points q = example.nodes[k] + change;
  for (std::size_t j = k; j < fields.momenta.size(); ++j)
    q = carried_by_step(example.system->system(), example.grid, fields, j, q, example.nodes[j + 1] - example.nodes[j])
            .value();
  return q;
}

// The least of the model in the momenta from step k on, where landmarks are off at node k.
void expect_dense_feedback(PathExample& example, const PathModel& model, const DenseModel& dense, std::size_t k) {
  const Points deviation = example.change().back();
  const Index size = deviation.size();
  const Index first = static_cast<Index>(k) * size, rest = dense.matrix.rows() - first;
  const VectorXd excess =
      derivative([&](double s) { return VectorXd(end_from(example, k, s * deviation).reshaped()); }, 1e-3);
  EXPECT_NEAR(model.misfit(k, deviation), 0.5 * excess.dot(dense.precision * excess), 1e-8 * excess.squaredNorm());
  const MatrixXd end = dense.nodes.bottomRightCorner(size, rest);
  const Eigen::LDLT<MatrixXd> factors(dense.matrix.bottomRightCorner(rest, rest));
  const VectorXd momenta = -factors.solve(end.transpose() * (dense.precision * excess));
  const PathDirection feedback = model.feedback(k, deviation, 1e-10);
  EXPECT_EQ(stacked(feedback.momenta).head(first).norm(), 0);
  expect_close(stacked(feedback.momenta).tail(rest), momenta);
  EXPECT_EQ(feedback.nodes[k], deviation);
  EXPECT_LE((feedback.nodes.back().reshaped() - excess - end * momenta).norm(), 1e-8 * excess.norm());
  // What that of the search leaves to gain of what there is.
  const VectorXd missed = stacked(model.feedback(k, deviation).momenta).tail(rest) - momenta;
  const auto& m = dense.matrix.bottomRightCorner(rest, rest);
  EXPECT_LE(missed.dot(m * missed), 1e-2 * momenta.dot(m * momenta));
}

void expect_dense(PathExample& example, const DataTerm& data) {
  ASSERT_TRUE(example.path);
  const PathModel model(*example.system, data, *example.path, kWeight);
  const DenseModel dense(example, data);
  const Eigen::LDLT<MatrixXd> factors(dense.matrix);
  ASSERT_TRUE(factors.isPositive());
  const std::vector<Points> covector = example.change();
  const PathDirection solved = model.solve(covector);
  expect_close(stacked(solved.momenta), factors.solve(dense.nodes.transpose() * stacked(covector)));
  expect_close(stacked(solved.nodes), dense.nodes * stacked(solved.momenta));

  for (std::size_t k = 0; k < solved.momenta.size(); ++k) expect_dense_feedback(example, model, dense, k);
}

TEST(PathModelSolve, IsTheInverseOfTheGaussNewtonMatrix) {
  for (const std::string& noise : linear_noise_specs())
    for (const int d : {1, 2, 3}) {
      SCOPED_TRACE(noise + " in " + std::to_string(d) + "D");
      PathExample example("gaussian:alpha=0.9", noise, d, 3, 3);
      expect_dense(example, *plain_data(example));
    }
}

TEST(PathModelSolve, TakesEachKernel) {
  for (const std::string& kernel : kernel_specs()) {
    if (kernel.find("peakon") != std::string::npos) continue;  // which has no slope where its fields begin
    SCOPED_TRACE(kernel);
    PathExample example(kernel, "ch-sd:beta=0.3", 2, 3, 3);
    expect_dense(example, *plain_data(example));
  }
}

TEST(PathModelSolve, TakesPartialDataAndCurves) {
  for (const int d : {1, 2, 3}) {
    SCOPED_TRACE(d);
    PathExample example("gaussian:alpha=0.9", "p-sd:beta=0.3,fields=cos", d, 4, 3);
    expect_dense(example, *partial_data(example));
    if (d > 1) expect_dense(example, *curve_data(example));
  }
}

// Data that are alike along each axis, and tie landmarks to each other.
class TiedTerm final : public DataTerm {
 public:
  explicit TiedTerm(const MatrixXd& root) : root_(root), form_{root, (root.transpose() * root).inverse()} {}
  double value(const Points& q) const override { return 0.5 * (root_ * q.transpose()).squaredNorm(); }
  Points gradient(const Points& q) const override { return q * root_.transpose() * root_; }
  Linearisation linearise(const Points& q, const MatrixXd& changes) const override {
    const Index d = q.rows(), n = q.cols();
    MatrixXd rows(d * n, d * n);
    for (Index row = 0; row < n; ++row)
      for (Index a = 0; a < n; ++a) rows.block(row * d, a * d, d, d) = root_(row, a) * MatrixXd::Identity(d, d);
    return {rows * q.reshaped(), rows * changes};
  }
  const QuadraticForm* form_of_each_axis() const override { return &form_; }

 private:
  MatrixXd root_;
  QuadraticForm form_;
};

TEST(PathModelSolve, TakesDataWithOneFormForEachAxis) {
  for (const int d : {1, 2, 3}) {
    SCOPED_TRACE(d);
    PathExample example("gaussian:alpha=0.9", "none", d, 4, 3);
    MatrixXd root = MatrixXd::Zero(4, 4);
    root.triangularView<Eigen::Upper>() = 20 * Numbers(5)(4, 4);
    expect_dense(example, TiedTerm(root));
  }
}

TEST(PathModelSolve, IsSymmetricAndPositive) {
  for (const std::string& noise : linear_noise_specs()) {
    SCOPED_TRACE(noise);
    PathExample example("gaussian:alpha=0.9", noise, 2, 4, 4);
    const auto data = partial_data(example);
    const PathModel model(*example.system, *data, example.path.value(), kWeight);
    const std::vector<Points> a = example.change(), b = example.change();
    const double aa = pairing(a, model.solve(a)), ab = pairing(a, model.solve(b)), bb = pairing(b, model.solve(b));
    EXPECT_NEAR(ab, pairing(b, model.solve(a)), 1e-13 * std::sqrt(aa * bb));
    EXPECT_GT(aa, 0);
    EXPECT_GT(aa * bb, ab * ab);
  }
}

}  // namespace
}  // namespace pulson::matching
