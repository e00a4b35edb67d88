// MomentumBasis against dense matrices of the kernel's definition.

#include "matching/momentum_basis.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "combinations.hpp"
#include "numbers.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/matching/objective.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRegularisation = 0.7;

// d×N points along a ring of length about 6.
Points ring(int d, int count) {
  Points q(d, count);
  for (int a = 0; a < count; ++a) {
    const double angle = 2 * std::numbers::pi * a / count;
    q(0, a) = std::cos(angle) + 0.1 * std::sin(3 * angle);
    if (d > 1) q(1, a) = std::sin(angle);
    if (d > 2) q(2, a) = 0.2 * std::cos(2 * angle);
  }
  return q;
}

Points on_line(int count, double spacing) { return spacing * Eigen::RowVectorXd::LinSpaced(count, 0, count - 1); }

struct BasisCase {
  std::string name;
  std::string kernel;
  double alpha;
  Points q;
  double tolerance;
  Index least_rank, most_rank;
  double rounding;  // of an energy: about the condition of K at the pivots times that of a number

  // exp(−(r/α)²) or exp(−r/α)
  double value(Index a, Index b) const {
    const double x = (q.col(a) - q.col(b)).norm() / alpha;
    return std::exp(kernel == "gaussian" ? -x * x : -x);
  }
  MatrixXd gram() const {
    return MatrixXd::NullaryExpr(q.cols(), q.cols(), [this](Index a, Index b) { return value(a, b); });
  }
  MomentumBasis basis() const {
    return {make_kernel(kernel + ":alpha=" + std::to_string(alpha), q), q, kRegularisation, tolerance};
  }
};

std::ostream& operator<<(std::ostream& out, const BasisCase& c) { return out << c.name; }

std::vector<BasisCase> cases() {
  return {{"one_landmark", "gaussian", 1, ring(2, 1), 0, 1, 1, 1e-14},
          {"on_a_line", "gaussian", 0.5, on_line(9, 0.4), 0, 9, 9, 1e-11},
          {"in_the_plane", "peakon", 0.5, ring(2, 20), 0, 20, 20, 1e-11},
          {"in_space", "gaussian", 0.2, ring(3, 20), 0, 20, 20, 1e-11},
          {"wide_on_a_dense_outline", "gaussian", 1, ring(2, 300), 1e-5, 5, 40, 1e-8},
          {"wide_on_a_dense_line", "gaussian", 2, on_line(250, 0.01), 1e-3, 3, 15, 1e-8},
          {"narrow_on_a_dense_outline", "gaussian", 0.01, ring(2, 300), 1e-5, 300, 300, 1e-11},
          {"wide_with_many_landmarks", "gaussian", 1, ring(2, 700), 1e-4, 5, 40, 1e-8},
          {"all_of_many_landmarks", "peakon", 0.5, on_line(560, 0.05), 1e-3, 560, 560, 1e-11},
          {"too_many_for_eigenvectors", "gaussian", 0.04, on_line(1210, 0.05), 1e-3, 1210, 1210, 1e-11}};
}

class Basis : public testing::TestWithParam<BasisCase> {
 protected:
  const BasisCase& case_ = GetParam();
  const Index d_ = GetParam().q.rows();
  const MomentumBasis basis_ = GetParam().basis();
  Numbers numbers_{5};
};

INSTANTIATE_TEST_SUITE_P(All, Basis, testing::ValuesIn(cases()), [](const auto& row) { return row.param.name; });

TEST_P(Basis, TakesAsManyPivotsAsTheKernelNeeds) {
  EXPECT_GE(basis_.rank(), case_.least_rank);
  EXPECT_LE(basis_.rank(), case_.most_rank);
  EXPECT_EQ(basis_.unknowns(), d_ * basis_.rank());
  const std::vector<Index>& pivots = basis_.pivots();
  ASSERT_EQ(std::ssize(pivots), basis_.rank());
  EXPECT_EQ(std::set<Index>(pivots.begin(), pivots.end()).size(), pivots.size());
  EXPECT_GE(*std::min_element(pivots.begin(), pivots.end()), 0);
  EXPECT_LT(*std::max_element(pivots.begin(), pivots.end()), case_.q.cols());
}

TEST_P(Basis, LeavesOverTheTraceOfTheSchurComplement) {
  const MatrixXd gram = case_.gram();
  const std::vector<Index>& pivots = basis_.pivots();
  const MatrixXd cross = gram(Eigen::all, pivots);
  const MatrixXd of_pivots = gram(pivots, pivots);
  const double trace = gram.trace() - cross.cwiseProduct(of_pivots.ldlt().solve(cross.transpose()).transpose()).sum();
  EXPECT_NEAR(basis_.left_over(), trace, 1e-3 * case_.tolerance + 1e-11 * gram.trace());
  EXPECT_LE(basis_.left_over(), case_.tolerance);
}

// The fewest that would do are no more than the pivots that were taken: without the last there is too much left.
TEST_P(Basis, StopsAsSoonAsItMay) {
  if (basis_.rank() == case_.q.cols()) return;
  const MatrixXd gram = case_.gram();
  std::vector<Index> fewer = basis_.pivots();
  fewer.pop_back();
  const MatrixXd cross = gram(Eigen::all, fewer);
  const MatrixXd of_fewer = gram(fewer, fewer);
  EXPECT_GT(gram.trace() - cross.cwiseProduct(of_fewer.ldlt().solve(cross.transpose()).transpose()).sum(),
            case_.tolerance);
}

TEST_P(Basis, EnergyIsHalfTheSquareOfTheUnknowns) {
  const VectorXd z = numbers_(basis_.unknowns(), 1);
  const Points p = basis_.momenta(z);
  const double energy = 0.5 * kRegularisation * (p * case_.gram()).cwiseProduct(p).sum();
  EXPECT_NEAR(energy, 0.5 * z.squaredNorm(), case_.rounding * z.squaredNorm());
}

TEST_P(Basis, LandmarksThatAreNoPivotsHaveNoMomentum) {
  const Points p = basis_.momenta(numbers_(basis_.unknowns(), 1));
  ASSERT_EQ(p.rows(), d_);
  ASSERT_EQ(p.cols(), case_.q.cols());
  const std::vector<Index>& pivots = basis_.pivots();
  for (Index a = 0; a < p.cols(); ++a)
    EXPECT_EQ(p.col(a).norm() > 0, std::find(pivots.begin(), pivots.end(), a) != pivots.end()) << "landmark " << a;
}

TEST_P(Basis, WhiteUndoesMomenta) {
  const VectorXd z = numbers_(basis_.unknowns(), 1);
  EXPECT_LE((basis_.white(basis_.momenta(z)) - z).norm(), 10 * case_.rounding * z.norm());
}

// What is left of a field is orthogonal to all fields of the basis: (p − p₀)ᵀK momenta(z) = 0 for all z.
TEST_P(Basis, WhiteProjectsOnTheNearestField) {
  const Points p = numbers_(d_, case_.q.cols());
  const VectorXd z = numbers_(basis_.unknowns(), 1);
  const MatrixXd gram = case_.gram();
  const Points rest = p - basis_.momenta(basis_.white(p));
  const Points field = basis_.momenta(z);
  const double sizes = std::sqrt((p * gram).cwiseProduct(p).sum() * (field * gram).cwiseProduct(field).sum());
  EXPECT_LE(std::abs((rest * gram).cwiseProduct(field).sum()), 10 * case_.rounding * sizes);
}

TEST_P(Basis, PullBackIsTheTransposeOfMomenta) {
  const VectorXd z = numbers_(basis_.unknowns(), 1);
  const Points bar = numbers_(d_, case_.q.cols());
  const Points p = basis_.momenta(z);
  EXPECT_NEAR(dot(bar, p), basis_.pull_back(bar).dot(z), 1e-13 * bar.norm() * p.norm());
}

TEST_P(Basis, ChangesAreTheColumnsOfMomenta) {
  const MatrixXd changes = basis_.changes();
  ASSERT_EQ(changes.rows(), case_.q.size());
  ASSERT_EQ(changes.cols(), basis_.unknowns());
  const VectorXd z = numbers_(basis_.unknowns(), 1);
  const Points p = basis_.momenta(z);
  EXPECT_LE((changes * z - p.reshaped()).norm(), 1e-12 * changes.norm() * z.norm());
}

TEST_P(Basis, EigenvaluesAreThoseOfTheKernelAtThePivots) {
  const VectorXd eigenvalues = basis_.eigenvalues();
  const VectorXd frequency = basis_.frequency();
  ASSERT_EQ(eigenvalues.size(), basis_.unknowns());
  ASSERT_EQ(frequency.size(), basis_.unknowns());
  if (basis_.rank() > 1200) {
    EXPECT_TRUE((eigenvalues.array() == kInfinity).all());
    EXPECT_TRUE((frequency.array() == 1).all());
    return;
  }
  const MatrixXd gram = kRegularisation * case_.gram()(basis_.pivots(), basis_.pivots());
  for (const Index i : {Index(0), basis_.unknowns() / 2, basis_.unknowns() - 1}) {
    const Points direction = basis_.momenta(VectorXd::Unit(basis_.unknowns(), i))(Eigen::all, basis_.pivots());
    const double quotient = (direction * gram).cwiseProduct(direction).sum() / direction.squaredNorm();
    EXPECT_NEAR(eigenvalues[i], quotient, 1e-13 * gram.trace() + 1e-9 * quotient);
    EXPECT_LE((direction * gram - eigenvalues[i] * direction).norm(), 1e-12 * gram.norm() * direction.norm());
    EXPECT_NEAR(frequency[i], eigenvalues.maxCoeff() / eigenvalues[i], 1e-12 * frequency[i]);
  }
}

// K of landmarks this near to one another is singular to rounding.
TEST(MomentumBasis, StopsWhereTheKernelIsNumericallySingular) {
  const Points q = on_line(40, 1e-3);
  const MomentumBasis basis(make_kernel("gaussian:alpha=1", q), q, kRegularisation, 0);
  EXPECT_LT(basis.rank(), 15);
  EXPECT_LT(basis.left_over(), 40 * 1e-13);
  EXPECT_TRUE(basis.momenta(VectorXd::Ones(basis.unknowns())).allFinite());
}

// Directions of eigenvalues about that at which they are half faded.
TEST(MomentumBasis, DirectionsFadeWithTheirEigenvalues) {
  const Points q = on_line(9, 0.4);
  const KernelOperator kernel = make_kernel("gaussian:alpha=1.2", q);
  const MomentumBasis all(kernel, q, kRegularisation, 0);
  const double faint = std::sqrt(all.eigenvalues()[0] * all.eigenvalues()[8]);
  const MomentumBasis faded(kernel, q, kRegularisation, 0, faint);
  const Index left = all.unknowns() - faded.unknowns();
  ASSERT_GT(left, 0);
  for (Index i = 0; i < faded.unknowns(); ++i) {
    const double decades = std::log10(faded.eigenvalues()[i] / faint);
    const Points whole = all.momenta(VectorXd::Unit(9, left + i));
    const Points part = faded.momenta(VectorXd::Unit(faded.unknowns(), i));
    const double strength = part.cwiseProduct(whole).sum() / whole.squaredNorm();
    EXPECT_NEAR((part - strength * whole).norm(), 0, 1e-12 * whole.norm());
    EXPECT_EQ(strength > 1 - 1e-12, decades >= 1);
    EXPECT_EQ(strength > 0.5, decades > 0);
    if (strength > 0.1) {
      EXPECT_NEAR((faded.white(part) - VectorXd::Unit(faded.unknowns(), i)).norm(), 0, 1e-9);
    }
  }
  EXPECT_LE(all.eigenvalues()[left - 1], faint / 10);
  const VectorXd normals = VectorXd::LinSpaced(9, -1, 2);
  EXPECT_NEAR((faded.in_directions(normals) - all.in_directions(normals).tail(faded.unknowns())).norm(), 0, 1e-12);
}

TEST(MomentumBasis, KeepsTheSmoothestDirectionWhereAllAreFaded) {
  const Points q = ring(2, 5);
  const MomentumBasis basis(make_kernel("gaussian:alpha=1", q), q, kRegularisation, 0, 1e6);
  EXPECT_EQ(basis.unknowns(), 2);
  EXPECT_EQ(basis.momenta(VectorXd::Ones(2)).norm(), 0);
  EXPECT_EQ(basis.white(Points::Ones(2, 5)).norm(), 0);
}

// Data of every other landmark, at twice the weight, with the weights and covariances that these had.
TEST(Thinned, StandsForAllLandmarks) {
  const std::vector<Index> few = {1, 3, 5, 7};
  LandmarkObservations observed{ring(2, 8), 0.1, VectorXd::LinSpaced(8, 1, 2)};
  observed.target(0, 3) = kNaN;
  for (int a = 0; a < 8; ++a) observed.covariances.emplace_back((1 + a) * MatrixXd::Identity(2, 2));
  const MatchingProblem problem{{make_kernel("gaussian:alpha=0.5", ring(2, 8)), make_noise("none")},
                                make_integrator("variational"),
                                {1, 5},
                                ring(2, 8),
                                std::make_shared<LandmarkTerm>(observed),
                                0.1};
  const MatchingProblem part = subsampled(problem, few);
  EXPECT_EQ(part.source, problem.source(Eigen::all, few));
  EXPECT_DOUBLE_EQ(part.sigma, 0.1 / std::sqrt(2));
  const LandmarkTerm& all_data = *problem.data->landmarks();
  const LandmarkTerm& data = *part.data->landmarks();
  EXPECT_EQ(data.target(), all_data.target()(Eigen::all, few));
  for (Index i = 0; i < 4; ++i)
    EXPECT_TRUE(data.precision(i).isApprox(2 * all_data.precision(few[static_cast<std::size_t>(i)]), 1e-14));
}

}  // namespace
}  // namespace pulson::matching
