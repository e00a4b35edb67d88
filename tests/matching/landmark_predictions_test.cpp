// Landmarks judged by prediction, and what a match is.

#include <cmath>
#include <numbers>
#include <numeric>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gmock/gmock.h>

#include "combinations.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/matching/landmark_verdicts.hpp"
#include "shape.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::ElementsAre;
using testing::IsEmpty;

// Simpson's rule.
template <class Function>
double integral(double end, const Function& f) {
  constexpr int kIntervals = 4000;
  const double h = end / kIntervals;
  double sum = f(0) + f(end);
  for (int i = 1; i < kIntervals; ++i) sum += (i % 2 == 1 ? 4 : 2) * f(i * h);
  return sum * h / 3;
}

TEST(LargestOfMany, IsTheQuantileOfTheDensities) {
  for (const int d : {1, 2, 3})
    for (const int count : {1, 20, 600}) {
      SCOPED_TRACE(d);
      const double scale = std::pow(2, 1 - d / 2.0) / std::tgamma(d / 2.0);
      const double chi = largest_of_chi(d, count);
      const double below =
          integral(chi, [&](double x) { return scale * (d == 1 ? 1 : std::pow(x, d - 1)) * std::exp(-x * x / 2); });
      EXPECT_NEAR(std::pow(below, count), 0.999, 1e-8);
      for (const double m : {5.0, 12.0, 75.0}) {
        const double student = largest_of_student(d, count, m);
        const double factor =
            2 * std::exp(std::lgamma((m + d) / 2) - std::lgamma(m / 2) - std::lgamma(d / 2.0)) * std::pow(m, -d / 2.0);
        const double part = integral(student, [&](double x) {
          return factor * (d == 1 ? 1 : std::pow(x, d - 1)) * std::pow(1 + x * x / m, -(m + d) / 2);
        });
        EXPECT_NEAR(std::pow(part, count), 0.999, 2e-6);
        EXPECT_GT(student, chi);
      }
      EXPECT_NEAR(largest_of_student(d, count, 1e7), chi, 1e-4);
    }
  EXPECT_NEAR(largest_of_chi(1, 1), std::sqrt(10.827566), 1e-6);  // tables of χ²
  EXPECT_NEAR(largest_of_chi(3, 1), std::sqrt(16.266236), 1e-6);
  EXPECT_NEAR(largest_of_chi(2, 50), std::sqrt(-2 * std::log(1 - std::pow(0.999, 0.02))), 1e-8);
  EXPECT_THROW(largest_of_chi(4, 1), InputError);
  EXPECT_THROW(largest_of_chi(2, 0), InputError);
}

std::vector<Index> whole(Index count) {
  std::vector<Index> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), 0);
  return all;
}

MatrixXd dense_covariance(const Points& q, const KernelOperator& kernel, double nugget) {
  const MatrixXd gram = kernel.gram(q, q);
  MatrixXd v = nugget * MatrixXd::Identity(q.size(), q.size());
  for (Index a = 0; a < q.cols(); ++a)
    for (Index b = 0; b < q.cols(); ++b)
      v.block(a * q.rows(), b * q.rows(), q.rows(), q.rows()).diagonal().array() += gram(a, b);
  return v;
}

// The prior of the motions is wide, where it is flat in the model: 1e5 times the variance.
TEST(LandmarkPredictions, AreThoseOfTheConditionalNormalDistribution) {
  Numbers numbers(3);
  for (const auto& [d, with_covariances] : {std::pair(2, false), {3, false}, {2, true}, {3, true}}) {
    const Points q = numbers(d, 12), r = 0.1 * numbers(d, 12);
    std::vector<MatrixXd> covariances;
    for (int a = 0; with_covariances && a < 12; ++a) {
      const MatrixXd root = 0.03 * numbers(d, d);
      covariances.emplace_back(root * root.transpose() + 1e-3 * MatrixXd::Identity(d, d));
    }
    const VectorXd weights = numbers(12, 1).array().abs() + 0.1;
    const DisplacementNoise noise(1e-3, covariances, weights);
    const MatrixXd z = motion_directions(q, AlignmentKind::kSimilarity, whole(q.size()));
    const std::vector<Index> known = {0, 1, 2, 4, 5, 7, 8, 10, 11};
    const KernelOperator kernel({{KernelProfile::kMatern32, 0.7, 0.02}});
    const LandmarkPredictions found = predict_displacements({q, r, z, known, noise}, kernel);
    MatrixXd v = dense_covariance(q, kernel, 0) + 2e3 * z * z.transpose();
    for (Index a = 0; a < 12; ++a)
      v.block(a * d, a * d, d, d) += with_covariances ? MatrixXd(covariances[static_cast<std::size_t>(a)] / weights[a])
                                                      : MatrixXd(1e-3 / weights[a] * MatrixXd::Identity(d, d));
    for (Index out = 0; out < 12; ++out) {
      std::vector<Index> in, left;
      for (Index i = 0; i < d; ++i) left.push_back(out * d + i);
      for (const Index a : known)
        for (Index i = 0; i < d; ++i)
          if (a != out) in.push_back(a * d + i);
      const MatrixXd inverse = MatrixXd(v(in, in)).inverse();
      const VectorXd predicted = v(left, in) * (inverse * r.reshaped()(in));
      const MatrixXd covariance = v(left, left) - v(left, in) * inverse * v(in, left);
      EXPECT_LT((found.residuals.col(out) - r.col(out) + predicted).norm(), 2e-5);
      EXPECT_LT((found.covariances[static_cast<std::size_t>(out)] - covariance).norm(), 2e-4 * covariance.norm());
    }
  }
}

// A shape and one whose displacement from it is drawn from the model, as a match that ends at the target.
Registration drawn_match(Numbers& numbers, Index d, Index n) {
  Registration match;
  match.source = shape(numbers(d, n));
  match.sigma = 0.005 * diameter(match.source.points);
  const double size = diameter(match.source.points);
  const MatrixXd v = dense_covariance(
      match.source.points, KernelOperator({{KernelProfile::kMatern32, 0.3 * size, std::pow(0.04 * size, 2)}}),
      match.sigma * match.sigma);
  const MatrixXd root = v.llt().matrixL();
  // Sums of four uniform numbers of variance 1/3 are nearly normal.
  const VectorXd normal = std::sqrt(0.75) * numbers(d * n, 4).rowwise().sum();
  match.target = shape(match.source.points + (root * normal).reshaped(d, n));
  match.result = match.target.points;
  match.alignment.kind = AlignmentKind::kSimilarity;
  return match;
}

TEST(PredictionOfMatch, DoubtsTheLandmarksThatWereMoved) {
  Numbers numbers(11);
  int untouched = 0;
  for (int trial = 0; trial < 20; ++trial) {
    Registration match = drawn_match(numbers, 2 + trial % 2, 20);
    const auto clean = predict_match(match);
    ASSERT_TRUE(clean);
    untouched += clean->doubted.empty() ? 1 : 0;
    const Points true_target = match.target.points;
    match.target.points.col(7).array() += 0.3 * diameter(match.source.points);
    EXPECT_THAT(predict_match(match)->doubted, ElementsAre(7));
    match.target.points = true_target;
    match.target.points.col(4).setConstant(std::nan(""));
    EXPECT_TRUE(std::isnan(predict_match(match)->predictions.over_sigma()[4]));
  }
  EXPECT_EQ(untouched, 20) << "one of a thousand shapes is doubted";
}

// A landmark of weight 0 predicts no other, and is judged as any other.
TEST(PredictionOfMatch, IsByTheWeights) {
  Numbers numbers(12);
  Registration match = drawn_match(numbers, 2, 20), without = match;
  match.target.points.col(7).array() += 0.3 * diameter(match.source.points);
  match.data.weights = VectorXd::Ones(20);
  match.data.weights[7] = 0;
  without.target.points.col(7).setConstant(std::nan(""));
  const auto weighted = predict_match(match), missing = predict_match(without);
  EXPECT_THAT(weighted->doubted, ElementsAre(7));
  for (Index a = 0; a < 20; ++a)
    if (a != 7) {
      EXPECT_LT((weighted->predictions.residuals.col(a) - missing->predictions.residuals.col(a)).norm(), 1e-12);
    }
  // A loss that has all but left it out does not excuse it, as a weight that was given does.
  match.data.weights[7] = 1e-6;
  EXPECT_THAT(predict_match(match)->doubted, IsEmpty());
  match.robust = RobustWeights{"tukey", match.data.weights};
  EXPECT_THAT(predict_match(match)->doubted, ElementsAre(7));
}

TEST(PredictionOfMatch, IsUndeterminedBelowEightLandmarksAndForCurves) {
  Numbers numbers(5);
  Registration match = drawn_match(numbers, 2, 8);
  EXPECT_TRUE(predict_match(match));
  match.data.kind = DataKind::kVarifold;
  EXPECT_FALSE(predict_match(match));
  match.data.kind = DataKind::kLandmarks;
  match.target.points(0, 3) = std::nan("");
  EXPECT_FALSE(predict_match(match));
  EXPECT_EQ(judge_landmarks(match, {}).word, PredictionWord::kUndetermined);
}

TEST(LandmarkVerdicts, TellDisplacementsWithoutACommonPart) {
  Numbers numbers(8);
  Registration match = drawn_match(numbers, 2, 40);
  EXPECT_EQ(judge_landmarks(match, {}).word, PredictionWord::kPredicted);
  std::vector<Index> mixed;
  for (Index a = 0; a < 40; ++a) mixed.push_back(a * 17 % 40);
  match.target.points = Points(match.target.points(Eigen::all, mixed));
  const LandmarkVerdicts verdicts = judge_landmarks(match, {});
  EXPECT_EQ(verdicts.word, PredictionWord::kNoCommonPart);
  EXPECT_TRUE(verdicts.may_be_unordered);
}

// Of 600 landmarks 2 may be 20σ away with an rms of 1.2σ.
TEST(Matched, NeedsEveryLandmark) {
  Registration match;
  match.source = shape(Points::Random(2, 600));
  match.result = match.source.points;
  match.target = match.source;
  match.sigma = 0.01;
  match.target.points.row(0).array() += 0.02;
  EXPECT_TRUE(match.matched());
  match.target.points(0, 17) += 0.2;
  match.target.points(1, 400) -= 0.2;
  EXPECT_LT(match.rms(), 3 * match.sigma);
  EXPECT_THAT(match.unmatched_landmarks(), ElementsAre(17, 400));
  EXPECT_FALSE(match.matched());
  match.data.weights = VectorXd::Ones(600);
  match.data.weights[17] = match.data.weights[400] = 0.01;
  EXPECT_TRUE(match.matched()) << "their deviations are 10σ";
  match.data = {};
  match.data.covariances.assign(600, 0.01 * MatrixXd::Identity(2, 2));
  EXPECT_NEAR(match.residuals_over_sigma()[400], std::hypot(0.02, 0.2) / 0.1, 1e-9);
}

// A finer σ than the shapes can keep: a twentieth of the distance before is a match.
TEST(Matched, TakesATwentiethOfTheDistanceForAMatch) {
  Registration match;
  match.source = shape(Points::Random(2, 50));
  match.target = match.source;
  match.target.points.row(0).array() += 1;
  match.result = match.target.points;
  match.result.row(1).array() += 0.04;
  match.sigma = 1e-6;
  EXPECT_TRUE(match.matched());
  match.result(1, 3) += 0.1;
  EXPECT_THAT(match.unmatched_landmarks(), ElementsAre(3));
}

// The markers of a chromosome of which a run is in reverse order in another build: of 7, 15 and 31 markers.
TEST(OrderOfTheTarget, IsExchangedPairByPair) {
  for (const auto& [run, pairs] : {std::pair(7, 21), {15, 105}, {31, 465}}) {
    const Points source = Eigen::RowVectorXd::LinSpaced(60, 0, 59);
    Points target = source, half = source;
    target.middleCols(10, run) = source.middleCols(10, run).rowwise().reverse();
    EXPECT_EQ(order_inversions(source, target), pairs);
    EXPECT_EQ(exchanged_as_asked(source, target, target), pairs);
    EXPECT_EQ(exchanged_as_asked(source, target, source), 0);
    std::swap(half(0, 10), half(0, 11));
    std::swap(half(0, 50), half(0, 51));  // which the target does not ask for
    EXPECT_EQ(exchanged_as_asked(source, target, half), 1);
  }
}

TEST(LandmarkVerdicts, NameTheFewLandmarksThatHaveTheAction) {
  Numbers numbers(2);
  const Registration match = drawn_match(numbers, 2, 12);
  LandmarkShares shares;
  shares.noise = match.target.points - match.source.points;
  shares.action = VectorXd::Constant(12, 0.01);
  shares.action(std::vector<int>{2, 5, 9}) << 3, 1, 2;
  const LandmarkVerdicts verdicts = judge_landmarks(match, shares);
  EXPECT_THAT(verdicts.concentrated, ElementsAre(2, 5, 9));
  EXPECT_NEAR(verdicts.concentrated_share(), 6 / 6.09, 1e-12);
  shares.noise *= 1e-3;  // within σ
  EXPECT_THAT(judge_landmarks(match, shares).concentrated, IsEmpty());
  shares.noise *= 1e3;
  shares.action.setOnes();
  EXPECT_THAT(judge_landmarks(match, shares).concentrated, IsEmpty());
}

}  // namespace
}  // namespace pulson::matching
