// Analysis of variance of shapes by randomised residuals.

#include "pulson/cohort/linear_model.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/QR>
#include <fmt/format.h>

#include "matching/maximum.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kBatch = 64;            // permutations per task, of one matrix product
constexpr double kEqual = 1 - 1e-12;  // statistics of equal permutations differ by rounding
constexpr int kErrorBlocks = 10;      // of permutations, by which the error of an effect size is estimated
constexpr Index kLeastBlock = 50;
constexpr double kMostPower = 2;  // of Box and Cox, as in RRPP

// Orthonormal columns that span those of the design, less their means, in order.
MatrixXd orthonormal(const MatrixXd& columns) {
  MatrixXd basis(columns.rows(), columns.cols());
  for (Index c = 0; c < columns.cols(); ++c) {
    VectorXd rest = columns.col(c).normalized();
    for (int twice = 0; twice < 2; ++twice) {
      rest.array() -= rest.mean();
      rest -= basis.leftCols(c) * (basis.leftCols(c).transpose() * rest);
      rest.normalize();
    }
    basis.col(c) = rest;
  }
  return basis;
}

// What the permutations of one term are applied to.
struct Randomised {
  MatrixXd residuals;  // n×r, of the model without the term
  double squares = 0;
  MatrixXd left;         // n×(k + g): the basis of the full model, then the weights of the groups
  MatrixXd group_means;  // g×r, of the fit without the term
  MatrixXd statistics;   // F, and the distance of each pair, of the residuals as they are and of each permutation

  Index pairs() const { return group_means.rows() * (group_means.rows() - 1) / 2; }
};

double log_likelihood(const VectorXd& logs, double power) {
  const auto transformed = power == 0 ? logs.eval() : ((power * logs).array().exp() / power).matrix().eval();
  const double variance = (transformed.array() - transformed.mean()).square().mean();
  return -0.5 * std::log(variance) + (power - 1) * logs.mean();
}

// The most likely power.
double box_cox_power(const VectorXd& logs) {
  const auto at = [&](const VectorXd& power) { return log_likelihood(logs, power[0]); };
  const matching::Box box{VectorXd{{-kMostPower}}, VectorXd{{kMostPower}}};
  const double power = maximise(at, box, VectorXd::Zero(1)).x[0];
  constexpr double kLogarithm = 1e-3;  // of RRPP: powers so small are the logarithm
  return std::abs(power) < kLogarithm ? 0 : power;
}

// Of the effect size by the statistics, of which the first is the one observed.
double effect_size_error(const VectorXd& values) {
  const Index block = (values.size() - 1) / kErrorBlocks;
  if (block < kLeastBlock) return std::nan("");
  VectorXd sizes(kErrorBlocks);
  for (Index b = 0; b < kErrorBlocks; ++b) {
    VectorXd some(block + 1);
    some << values[0], values.segment(1 + b * block, block);
    sizes[b] = effect_size(some);
  }
  return std::sqrt((sizes.array() - sizes.mean()).square().sum() / (kErrorBlocks * (kErrorBlocks - 1)));
}

double part_as_large(const VectorXd& values) {
  return static_cast<double>((values.array() >= kEqual * values[0]).count()) / static_cast<double>(values.size());
}

class ModelTester {
 public:
  ModelTester(const ModelDesign& design, const MatrixXd& all_rows, const PermutationOptions& options)
      : design_(design), options_(options), rows_(all_rows(design.specimens, Eigen::all)) {
    rows_.rowwise() -= rows_.colwise().mean().eval();
    basis_ = orthonormal(design.columns);
  }

  ModelTest test() {
    ModelTest found;
    found.permutations = options_.count;
    found.total_ss = rows_.squaredNorm();
    found.residual_ss = (rows_ - basis_ * (basis_.transpose() * rows_)).squaredNorm();
    if (!(found.total_ss > 0)) throw InputError("the shapes are all the same: there is no variation to be explained");
    for (const ModelDesign::Term& term : design_.terms) {
      Randomised& held = held_.emplace_back(randomised(term));
      held.statistics.resize(1 + held.pairs(), options_.count + 1);
      store(term, held.left.transpose() * held.residuals, 0, held);
    }
    parallel_for((options_.count + kBatch - 1) / kBatch, [&](int batch) { permute(batch); });
    for (std::size_t t = 0; t < held_.size(); ++t) add_term(static_cast<int>(t), found);
    return found;
  }

 private:
  Randomised randomised(const ModelDesign::Term& term) const {
    Randomised held;
    const auto before = basis_.leftCols(term.first);
    const MatrixXd fit = before * (before.transpose() * rows_);
    held.residuals = rows_ - fit;
    held.squares = held.residuals.squaredNorm();
    const bool has_pairs = !term.groups.empty() && std::ssize(term.groups) <= kMostPairGroups;
    const Index groups = has_pairs ? std::ssize(term.groups) : 0;
    held.left.resize(rows_.rows(), basis_.cols() + groups);
    held.left.leftCols(basis_.cols()) = basis_;
    if (!has_pairs) return held;
    held.left.rightCols(groups) = term.group_weights.transpose();
    held.group_means = term.group_weights * fit;
    return held;
  }

  // F and the distances of pairs. @param products (k + g)×r, of permuted residuals @param at column of the statistics
  void store(const ModelDesign::Term& term, const MatrixXd& products, Index at, Randomised& held) const {
    const double of_term = products.middleRows(term.first, term.df).squaredNorm();
    const double residual = std::max(held.squares - products.topRows(basis_.cols()).squaredNorm(), 0.0);
    held.statistics(0, at) = of_term / term.df / (residual / design_.residual_df());
    if (held.group_means.size() == 0) return;
    const MatrixXd means = held.group_means + products.bottomRows(held.group_means.rows());
    Index row = 1;
    for (Index second = 1; second < means.rows(); ++second)
      for (Index first = 0; first < second; ++first)
        held.statistics(row++, at) = (means.row(second) - means.row(first)).norm();
  }

  // The same permutations for all terms. Qᵀ·(permuted residuals) is (permuted Q)ᵀ·residuals, one product for a batch.
  void permute(int batch) {
    const int first = batch * kBatch, count = std::min(kBatch, options_.count - first);
    const auto n = static_cast<int>(rows_.rows());
    std::vector<std::vector<int>> orders;
    for (int k = 0; k < count; ++k)
      orders.push_back(random_permutation(options_.seed, static_cast<std::uint64_t>(first + k), n));
    for (std::size_t t = 0; t < held_.size(); ++t) {
      Randomised& held = held_[t];
      const Index width = held.left.cols();
      MatrixXd left(n, count * width);
      for (int k = 0; k < count; ++k)
        for (int i = 0; i < n; ++i)
          left.row(orders[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)]).segment(k * width, width) =
              held.left.row(i);
      const MatrixXd products = left.transpose() * held.residuals;
      for (int k = 0; k < count; ++k)
        store(design_.terms[t], products.middleRows(k * width, width), first + k + 1, held);
    }
  }

  void add_term(int t, ModelTest& found) const {
    const ModelDesign::Term& term = design_.terms[static_cast<std::size_t>(t)];
    const Randomised& held = held_[static_cast<std::size_t>(t)];
    const VectorXd f = held.statistics.row(0);
    const double ss = (basis_.middleCols(term.first, term.df).transpose() * rows_).squaredNorm();
    found.terms.push_back({ss, ss / found.total_ss, f[0], effect_size(f), effect_size_error(f), part_as_large(f)});
    Index row = 1;
    for (int second = 1; second < held.group_means.rows(); ++second)
      for (int first = 0; first < second; ++first, ++row) {
        const VectorXd distances = held.statistics.row(row);
        found.pairs.push_back({t, first, second, distances[0], effect_size(distances), part_as_large(distances)});
      }
  }

  const ModelDesign& design_;
  const PermutationOptions& options_;
  MatrixXd rows_;                 // centred
  MatrixXd basis_;                // n×k
  std::vector<Randomised> held_;  // of each term
};

}  // namespace

double effect_size(const VectorXd& values) {
  if (values.size() < 3 || !(values.minCoeff() > 0) || !values.allFinite()) return std::nan("");
  VectorXd logs = values.array().log();
  logs.array() -= logs.tail(logs.size() - 1).mean();
  const VectorXd random = logs.tail(logs.size() - 1);
  if (random.maxCoeff() - random.minCoeff() < 1e-9) return std::nan("");
  const double power = box_cox_power(random);
  const VectorXd transformed = power == 0 ? logs : VectorXd((power * logs).array().exp() / power);
  const double mean = transformed.mean();
  return (transformed[0] - mean) / std::sqrt((transformed.array() - mean).square().mean());
}

ModelTest test_model(const ModelDesign& design, const MatrixXd& rows, const PermutationOptions& options) {
  const SerialBlas serial;
  if (options.count < 1) throw InputError(fmt::format("permutations is {}; it must be at least 1", options.count));
  return ModelTester(design, rows, options).test();
}

}  // namespace pulson::cohort
