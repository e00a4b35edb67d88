#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "combinations.hpp"
#include "error_of.hpp"
#include "pulson/matching/data_term.hpp"
#include "shape.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::AllOf;
using testing::HasSubstr;

constexpr double kWidth = 0.7;
constexpr double kSigma = 0.05;

// An outline around the origin with bumps, out of the plane in space; of a full turn only the part `turn`.
Points bumpy_outline(int d, int n, double bumps, double turn = 1) {
  Points points(d, n);
  for (int a = 0; a < n; ++a) {
    const double angle = 2 * std::numbers::pi * turn * a / n;
    const double radius = 1 + bumps * std::cos(3 * angle + 0.4);
    points(0, a) = radius * std::cos(angle);
    points(1, a) = 0.8 * radius * std::sin(angle);
    if (d == 3) points(2, a) = 0.5 * std::sin(2 * angle + bumps);
  }
  return points;
}

Points circle(int n, double first_angle) {
  Points points(2, n);
  for (int a = 0; a < n; ++a) {
    const double angle = first_angle + 2 * std::numbers::pi * a / n;
    points.col(a) << std::cos(angle), std::sin(angle);
  }
  return points;
}

// <μ,ν> by the definition.
double product(CurveMeasure measure, double width, const Curve& mu, const Curve& nu) {
  double sum = 0;
  for (const auto& [a, b] : mu.edges) {
    for (const auto& [i, j] : nu.edges) {
      const VectorXd s = mu.points.col(b) - mu.points.col(a);
      const VectorXd t = nu.points.col(j) - nu.points.col(i);
      const VectorXd gap = (mu.points.col(a) + mu.points.col(b) - nu.points.col(i) - nu.points.col(j)) / 2;
      if (s.norm() == 0 || t.norm() == 0) continue;
      const double k = std::exp(-gap.squaredNorm() / (width * width));
      sum += k * (measure == CurveMeasure::kCurrent ? s.dot(t) : std::pow(s.dot(t), 2) / (s.norm() * t.norm()));
    }
  }
  return sum;
}

double square_distance(CurveMeasure measure, double width, const Curve& mu, const Curve& nu) {
  return product(measure, width, mu, mu) - 2 * product(measure, width, mu, nu) + product(measure, width, nu, nu);
}

// ∂²<μ_q, μ_q'>/∂q∂q' at q' = q along `left` and `right`, by differences.
double mixed_difference(CurveMeasure measure, double width, const Curve& curve, const Points& left,
                        const Points& right) {
  const double h = 1e-4;
  double sum = 0;
  for (const double x : {-h, h})
    for (const double y : {-h, h})
      sum += (x * y > 0 ? 1 : -1) *
             product(measure, width, {curve.points + x * left, curve.edges}, {curve.points + y * right, curve.edges});
  return sum / (4 * h * h);
}

// s of the class comment, by differences.
double reference_scale(CurveMeasure measure, double width, const Curve& target, int source_vertices) {
  const Index d = target.points.rows();
  double sum = 0;
  for (Index axis = 0; axis < d; ++axis) {
    Points shift = Points::Zero(d, target.points.cols());
    shift.row(axis).setOnes();
    sum += mixed_difference(measure, width, target, shift, shift);
  }
  return source_vertices * static_cast<double>(d - 1) / sum;
}

Points unit(const Points& like, Index i) {
  Points result = Points::Zero(like.rows(), like.cols());
  result.reshaped()[i] = 1;
  return result;
}

struct CurveCase {
  int d;
  CurveMeasure measure;
  CurveEnds ends;
};

std::string case_name(const testing::TestParamInfo<CurveCase>& info) {
  return (info.param.measure == CurveMeasure::kCurrent ? "current" : "varifold") + std::to_string(info.param.d) + "d_" +
         curve_ends_name(info.param.ends);
}

std::vector<CurveCase> all_cases() {
  std::vector<CurveCase> cases;
  for (const int d : {2, 3})
    for (const CurveMeasure measure : {CurveMeasure::kCurrent, CurveMeasure::kVarifold})
      for (const CurveEnds ends : {CurveEnds::kClosed, CurveEnds::kOpen}) cases.push_back({d, measure, ends});
  return cases;
}

// A term between two outlines with different numbers of vertices, and a point away from both.
class CurveTerms : public testing::TestWithParam<CurveCase> {
 protected:
  CurveTerms()
      : source_(make_curve(shape(bumpy_outline(GetParam().d, 14, 0.1)), GetParam().ends)),
        target_(make_curve(shape(bumpy_outline(GetParam().d, 19, 0.25)), GetParam().ends)),
        term_(source_.edges, 14, target_, {GetParam().measure, kSigma, kWidth}) {
    source_.points += 0.03 * Numbers(4)(GetParam().d, 14);
  }

  const Points& q() const { return source_.points; }
  MatrixXd factor() const { return term_.linearise(q(), MatrixXd::Identity(q().size(), q().size())).changes; }

  Curve source_;
  Curve target_;
  CurveTerm term_;
};

INSTANTIATE_TEST_SUITE_P(All, CurveTerms, testing::ValuesIn(all_cases()), case_name);

TEST_P(CurveTerms, ValueIsTheFormula) {
  const double scale = reference_scale(GetParam().measure, kWidth, target_, 14);
  const double per_square = term_.value(q()) / square_distance(GetParam().measure, kWidth, source_, target_);
  EXPECT_NEAR(per_square, scale / (2 * kSigma * kSigma), 1e-6 * per_square);  // differences: h²/w² and round-off
  const Points other = q() + 0.1 * Numbers(5)(q().rows(), q().cols());
  const double expected = per_square * square_distance(GetParam().measure, kWidth, {other, source_.edges}, target_);
  EXPECT_NEAR(term_.value(other), expected, 1e-12 * expected);
}

TEST_P(CurveTerms, GradientIsThatOfTheValue) {
  const Points gradient = term_.gradient(q());
  const double h = 1e-5;
  for (Index i = 0; i < q().size(); ++i) {
    const Points step = h * unit(q(), i);
    const double slope = (term_.value(q() + step) - term_.value(q() - step)) / (2 * h);
    EXPECT_NEAR(gradient.reshaped()[i], slope, 1e-7 * gradient.norm()) << i;
  }
}

TEST_P(CurveTerms, LinearisationHasTheGradient) {
  const auto [residual, changes] = term_.linearise(q(), MatrixXd::Identity(q().size(), q().size()));
  const Points gradient = term_.gradient(q());
  EXPECT_LE((changes.transpose() * residual - gradient.reshaped()).norm(), 1e-12 * gradient.norm());
  // The gradient lies in the range of G, and r is μ_q − μ_y's part there: no longer than the whole.
  EXPECT_LE(0.5 * residual.squaredNorm(), term_.value(q()));
  EXPECT_GE(0.5 * residual.squaredNorm(), 0.1 * term_.value(q()));
}

TEST_P(CurveTerms, LinearisationHasTheMetric) {
  const MatrixXd f = factor();
  const MatrixXd square = f.transpose() * f;
  const double weight = reference_scale(GetParam().measure, kWidth, target_, 14) / (kSigma * kSigma);
  const double tolerance = 1e-6 * square.cwiseAbs().maxCoeff();
  for (Index i = 0; i < q().size(); ++i)
    for (Index j = 0; j <= i; ++j)
      EXPECT_NEAR(square(i, j),
                  weight * mixed_difference(GetParam().measure, kWidth, source_, unit(q(), i), unit(q(), j)), tolerance)
          << i << ", " << j;
}

TEST_P(CurveTerms, LinearisationIsAppliedToEachChange) {
  const MatrixXd changes = Numbers(6)(q().size(), 3);
  const DataTerm::Linearisation some = term_.linearise(q(), changes);
  EXPECT_LE((some.changes - factor() * changes).norm(), 1e-13 * some.changes.norm());
  EXPECT_FALSE(term_.is_least_squares());
  EXPECT_THROW(term_.residual(q()), std::logic_error);
}

// Gauss–Newton's steps, without any damping but the ridge and a little weight, bring the source onto the target.
TEST_P(CurveTerms, NormalEquationsLeadToTheTarget) {
  Points x = bumpy_outline(GetParam().d, 14, 0.25);
  const CurveTerm term(source_.edges, 14, make_curve(shape(x), GetParam().ends), {GetParam().measure, kSigma, kWidth});
  x += 0.05 * Numbers(7)(x.rows(), x.cols());
  const double before = term.value(x);
  for (int step = 0; step < 10; ++step) {
    const MatrixXd identity = MatrixXd::Identity(x.size(), x.size());
    const auto [r, f] = term.linearise(x, identity);
    const MatrixXd normal = f.transpose() * f + 1e-3 / (kSigma * kSigma) * identity;
    x.reshaped() -= normal.llt().solve(f.transpose() * r);
  }
  EXPECT_LE(term.value(x), 1e-3 * before);
}

TEST_P(CurveTerms, NothingRemainsAtTheTarget) {
  const CurveTerm term(target_.edges, 19, target_, {GetParam().measure, kSigma, kWidth});
  EXPECT_EQ(term.value(target_.points), 0);
  EXPECT_EQ(term.gradient(target_.points).norm(), 0);
  EXPECT_EQ(term.linearise(target_.points, MatrixXd(target_.points.size(), 0)).residual.norm(), 0);
  EXPECT_GT(term.value(1.01 * target_.points), 0);
}

// N(d−1)/d |δ|²/(2σ²) on the average over the axes; the vertices that no edge meets count as well.
TEST_P(CurveTerms, TranslationCostsWhatLandmarksCost) {
  const Index d = GetParam().d;
  const int count = 24;
  const CurveTerm term(target_.edges, count, target_, {GetParam().measure, kSigma, kWidth});
  Points y = Points::Zero(d, count);
  y.leftCols(19) = target_.points;
  const double delta = 1e-4 * kWidth;  // errors: (δ/w)² of the next order, and round-off, 1e-16 over (δ/w)²
  double mean = 0;
  for (Index axis = 0; axis < d; ++axis) {
    Points moved = y;
    moved.row(axis).array() += delta;
    mean += term.value(moved) / static_cast<double>(d);
  }
  const double expected =
      count * (static_cast<double>(d) - 1) / static_cast<double>(d) * std::pow(delta / kSigma, 2) / 2;
  EXPECT_NEAR(mean, expected, 1e-6 * expected);
}

TEST_P(CurveTerms, OrderMattersToCurrentsAlone) {
  const Curve reversed = make_curve(shape(target_.points.rowwise().reverse()), GetParam().ends);
  const CurveTerm back(source_.edges, 14, reversed, {GetParam().measure, kSigma, kWidth});
  const Points gradient = term_.gradient(q());
  if (GetParam().measure == CurveMeasure::kVarifold) {
    EXPECT_NEAR(back.value(q()), term_.value(q()), 1e-12 * term_.value(q()));
    EXPECT_LE((back.gradient(q()) - gradient).norm(), 1e-12 * gradient.norm());
  } else {
    EXPECT_GT(back.value(q()), 2 * term_.value(q()));
    const CurveTerm own(reversed.edges, 19, target_, {GetParam().measure, kSigma, kWidth});
    const double scale = reference_scale(GetParam().measure, kWidth, target_, 19);
    const double four = 2 * scale / (kSigma * kSigma) * product(GetParam().measure, kWidth, target_, target_);
    EXPECT_NEAR(own.value(reversed.points), four, 1e-6 * four);
  }
}

TEST_P(CurveTerms, UnitsOfLengthChangeNothing) {
  const double s = 1024;
  const CurveTerm large(source_.edges, 14, {s * target_.points, target_.edges},
                        {GetParam().measure, s * kSigma, s * kWidth});
  EXPECT_EQ(large.value(s * q()), term_.value(q()));
  EXPECT_EQ(s * large.gradient(s * q()), term_.gradient(q()));
}

// An edge between two vertices at one place: a varifold's derivatives are those without it.
TEST_P(CurveTerms, DegenerateEdgesAreFinite) {
  Points x = q();
  x.col(5) = x.col(4);
  Curve target = target_;
  target.points.col(8) = target.points.col(9);
  const CurveTerm term(source_.edges, 14, target, {GetParam().measure, kSigma, kWidth});
  const MatrixXd identity = MatrixXd::Identity(x.size(), x.size());
  const auto [residual, changes] = term.linearise(x, identity);
  EXPECT_TRUE(std::isfinite(term.value(x)));
  EXPECT_TRUE(residual.allFinite());
  EXPECT_TRUE(changes.allFinite());
  const Points gradient = term.gradient(x);
  EXPECT_LE((changes.transpose() * residual - gradient.reshaped()).norm(), 1e-12 * gradient.norm());
  if (GetParam().measure == CurveMeasure::kVarifold) {
    std::vector<std::pair<int, int>> others = source_.edges;
    others.erase(others.begin() + 4);
    const CurveTerm without(others, 14, target, {GetParam().measure, kSigma, kWidth});
    EXPECT_EQ(term.value(x), without.value(x));
    EXPECT_EQ(gradient, without.gradient(x));
  }
  const Points one_place = Points::Ones(x.rows(), 14);
  EXPECT_TRUE(term.gradient(one_place).allFinite());
  EXPECT_TRUE(term.linearise(one_place, identity).residual.allFinite());
  EXPECT_TRUE(term.linearise(one_place, identity).changes.allFinite());
}

// Sampled differently a circle is the same curve, and shifted by σ it is not.
TEST(CurveTerm, SamplingIsNotSeen) {
  for (const CurveMeasure measure : {CurveMeasure::kCurrent, CurveMeasure::kVarifold}) {
    const Curve source = make_curve(shape(circle(40, 0)), CurveEnds::kAuto);
    const Curve target = make_curve(shape(circle(63, 0.05)), CurveEnds::kAuto);
    const CurveTerm term(source.edges, 40, target, {measure, kSigma, automatic_data_width(target)});
    Points shifted = source.points;
    shifted.row(0).array() += kSigma;
    EXPECT_NEAR(term.value(shifted), 10, 1);  // N/2 · 1/2
    EXPECT_LE(term.value(source.points), 0.01 * term.value(shifted));
  }
}

TEST(CurveTerm, RangesOfNumbersAreWide) {
  for (const double s : {1e-100, 1e100}) {
    const Curve curve = make_curve(shape(s * circle(12, 0)), CurveEnds::kClosed);
    const CurveTerm term(curve.edges, 12, curve, {CurveMeasure::kVarifold, 0.1 * s, s});
    const CurveTerm one(curve.edges, 12, {circle(12, 0), curve.edges}, {CurveMeasure::kVarifold, 0.1, 1});
    EXPECT_NEAR(term.value(1.1 * curve.points), one.value(1.1 * circle(12, 0)), 1e-10 * one.value(1.1 * circle(12, 0)));
  }
}

using Joined = std::vector<std::pair<int, int>>;

Points points_at(std::vector<double> xy) { return Points::Map(xy.data(), 2, static_cast<Index>(xy.size() / 2)); }

TEST(Curve, ConsecutiveLandmarksAreJoined) {
  const Landmarks square = shape(points_at({0, 0, 1, 0, 1, 1, 0, 1}));
  const Joined open = {{0, 1}, {1, 2}, {2, 3}};
  const Joined closed = {{0, 1}, {1, 2}, {2, 3}, {3, 0}};
  EXPECT_EQ(make_curve(square, CurveEnds::kOpen).edges, open);
  EXPECT_EQ(make_curve(square, CurveEnds::kClosed).edges, closed);
  EXPECT_EQ(make_curve(square, CurveEnds::kAuto).edges, closed);
  EXPECT_EQ(make_curve(square, CurveEnds::kAuto).points, square.points);
}

TEST(Curve, AutomaticEndsCloseAGapOfTwiceTheMedian) {
  const Landmarks just = shape(points_at({0, 0, 0, 1, 1, 1, 2, 1, 2, 0}));
  const Landmarks wider = shape(points_at({0, 0, 0, 1, 1, 1, 2, 1, 2.01, 0}));
  EXPECT_EQ(make_curve(just, CurveEnds::kAuto).edges.size(), 5);
  EXPECT_EQ(make_curve(wider, CurveEnds::kAuto).edges.size(), 4);
  EXPECT_EQ(make_curve(shape(bumpy_outline(2, 30, 0, 0.5)), CurveEnds::kAuto).edges.size(), 29);
}

TEST(Curve, GroupsAreOutlinesOfTheirOwn) {
  const Landmarks two = shape(points_at({0, 0, 9, 0, 1, 0, 9, 1, 1, 1}), {"a", "b", "a", "b", "a"});
  const Joined automatic = {{0, 2}, {2, 4}, {4, 0}, {1, 3}};
  const Joined open = {{0, 2}, {2, 4}, {1, 3}};
  EXPECT_EQ(make_curve(two, CurveEnds::kAuto).edges, automatic);
  EXPECT_EQ(make_curve(two, CurveEnds::kClosed).edges, automatic) << "two points are never closed";
  EXPECT_EQ(make_curve(two, CurveEnds::kOpen).edges, open);
}

TEST(Curve, AutomaticWidth) {
  const Curve fine = make_curve(shape(circle(100, 0)), CurveEnds::kClosed);
  const Curve coarse = make_curve(shape(circle(10, 0)), CurveEnds::kClosed);
  EXPECT_NEAR(automatic_data_width(fine), 0.2, 1e-14);
  EXPECT_NEAR(automatic_data_width(coarse), 4 * std::sin(std::numbers::pi / 10), 1e-14);
}

TEST(CurveErrors, OfShapes) {
  const auto error = [](const Landmarks& landmarks) {
    return error_of([&] { make_curve(landmarks, CurveEnds::kAuto); });
  };
  EXPECT_EQ(error(shape(Points::Ones(1, 5))), "a.csv: curves need the plane or space; the shape is 1D");
  EXPECT_EQ(error(shape(Points(2, 0))), "a.csv: the shape has no landmarks");
  EXPECT_EQ(error(shape(circle(1, 0))), "a.csv: landmark 1 is alone in its outline; a curve needs at least 2");
  EXPECT_EQ(error(shape(circle(3, 0), {"a", "b", "a"})),
            "a.csv: landmark 2 is alone in its outline; a curve needs at least 2");
  EXPECT_EQ(error_of([] { parse_curve_ends("shut"); }), "unknown ends 'shut'; valid: auto, closed, open");
  for (const CurveEnds ends : {CurveEnds::kAuto, CurveEnds::kClosed, CurveEnds::kOpen})
    EXPECT_EQ(parse_curve_ends(curve_ends_name(ends)), ends);
}

TEST(CurveErrors, OfTerms) {
  const Curve good = make_curve(shape(circle(6, 0)), CurveEnds::kClosed);
  const auto error = [&](const Joined& edges, int count, const Curve& target, double sigma = 1, double width = 1,
                         CurveMeasure measure = CurveMeasure::kCurrent) {
    return error_of([&] { CurveTerm(edges, count, target, {measure, sigma, width}); });
  };
  EXPECT_EQ(error(good.edges, 6, good), "no error");
  for (const double value : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(error(good.edges, 6, good, value), AllOf(HasSubstr("sigma is"), HasSubstr("greater than 0")));
    EXPECT_THAT(error(good.edges, 6, good, 1, value), AllOf(HasSubstr("data width is"), HasSubstr("greater than 0")));
  }
  EXPECT_EQ(error(good.edges, 5, good), "an edge of the source joins vertices 5 and 6; it must join two of 5");
  EXPECT_EQ(error({{0, -1}}, 6, good), "an edge of the source joins vertices 1 and 0; it must join two of 6");
  EXPECT_EQ(error({{2, 2}}, 6, good), "an edge of the source joins vertices 3 and 3; it must join two of 6");
  EXPECT_EQ(error(good.edges, 6, {circle(5, 0), good.edges}),
            "an edge of the target joins vertices 5 and 6; it must join two of 5");
  EXPECT_EQ(error(good.edges, 6, {Points::Ones(1, 6), good.edges}), "curves need the plane or space; the target is 1D");
  Curve bad = good;
  bad.points(1, 2) = std::nan("");
  EXPECT_EQ(error(good.edges, 6, bad), "a coordinate of the target is not a finite number");
  EXPECT_EQ(error(good.edges, 6, {Points::Ones(2, 6), good.edges}),
            "the target is not a curve: its edges have no length");
  EXPECT_EQ(error(good.edges, 6, {circle(6, 0), {}}), "the target is not a curve: its edges have no length");
  const Curve to_and_fro{circle(2, 0), {{0, 1}, {1, 0}}};
  EXPECT_THAT(error(good.edges, 6, to_and_fro), HasSubstr("the target's edges cancel"));
  EXPECT_EQ(error(good.edges, 6, to_and_fro, 1, 1, CurveMeasure::kVarifold), "no error");
}

TEST(CurveErrors, OfVertices) {
  const Curve good = make_curve(shape(circle(6, 0)), CurveEnds::kClosed);
  const CurveTerm term(good.edges, 6, good, {CurveMeasure::kCurrent, 1, 1});
  const std::string expected = "5 vertices in 2D do not fit a curve term of 6 in 2D";
  EXPECT_EQ(error_of([&] { term.value(circle(5, 0)); }), expected);
  EXPECT_EQ(error_of([&] { term.gradient(circle(5, 0)); }), expected);
  EXPECT_EQ(error_of([&] { term.linearise(circle(5, 0), MatrixXd::Zero(10, 1)); }), expected);
}

}  // namespace
}  // namespace pulson::matching
