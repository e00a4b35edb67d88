#include <cmath>
#include <limits>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "error_of.hpp"
#include "plain_options.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/random/brownian.hpp"

namespace pulson::matching {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

Landmarks square(const std::string& source) {
  Landmarks shape;
  shape.points = (Points(2, 4) << 0, 1, 1, 0, 0, 0, 1, 1).finished();
  shape.source = source;
  return shape;
}

std::string registration_error(const Landmarks& source, const Landmarks& target,
                               const RegistrationOptions& options = plain_options()) {
  return error_of([&] { register_shapes(source, target, options); });
}
// The error where `change` alters the default options.
template <class Change>
std::string error_with(const Change& change) {
  RegistrationOptions options = plain_options();
  change(options);
  return registration_error(square("a.csv"), square("b.csv"), options);
}

TEST(RegistrationErrors, NameShapesThatDoNotFit) {
  const Landmarks good = square("a.csv");
  Landmarks bad = square("b.csv");
  bad.points = Points::Random(2, 3);
  EXPECT_EQ(registration_error(good, bad),
            "the shapes have different numbers of landmarks: a.csv has 4, b.csv has 3; nothing says which of them "
            "correspond: both need the same landmarks, or labels or numbers that say so (outlines without "
            "correspondence: `data.kind = varifold`)");
  bad.points = Points::Random(3, 4);
  EXPECT_EQ(registration_error(good, bad), "the shapes have different dimensions: a.csv is 2D, b.csv is 3D");
  bad.points.resize(2, 0);
  EXPECT_EQ(registration_error(bad, bad), "b.csv: the shape has no landmarks");
  bad.points = Points::Random(4, 4);
  EXPECT_EQ(registration_error(bad, bad), "b.csv: landmarks in 4 dimensions; 1, 2 or 3 are supported");
  bad = square("b.csv");
  bad.points(1, 2) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(registration_error(good, bad), "b.csv: landmark 3 has a coordinate that is not a finite number");
  bad.labels = {"nose", "chin", "left eye", "right eye"};
  EXPECT_EQ(registration_error(bad, good), "b.csv: landmark 'left eye' has a coordinate that is not a finite number");
  bad.points.row(1).setConstant(std::nan(""));
  EXPECT_EQ(registration_error(good, bad), "b.csv: no landmark has all its coordinates");
}

// A target that is not observed counts for nothing, a source that is not known is left out with its target.
TEST(Registrations, DoWithoutWhatIsMissing) {
  Landmarks source = square("a.csv");
  Landmarks target = square("b.csv");
  target.points = 1.1 * source.points;
  RegistrationOptions options = plain_options();
  options.kernel = "gaussian:alpha=1";
  Landmarks gaps = target;
  gaps.points(1, 2) = std::nan("");
  gaps.points.col(3).setConstant(std::nan(""));
  const Registration part = register_shapes(source, gaps, options);
  EXPECT_TRUE(part.converged);
  EXPECT_EQ(part.result.cols(), 4);
  EXPECT_TRUE(part.result.allFinite());
  EXPECT_TRUE(std::isnan(part.distances()[3]));
  EXPECT_LE(part.rms(), 1e-3);
  EXPECT_EQ(part.notes.size(), 1U);
  EXPECT_LT(part.cost.total(), register_shapes(source, target, options).cost.total());

  source.points(0, 1) = std::nan("");
  const Registration fewer = register_shapes(source, target, options);
  EXPECT_EQ(fewer.source.count(), 3);
  EXPECT_EQ(fewer.target.points.col(1), target.points.col(2));
  EXPECT_EQ(fewer.notes,
            (std::vector<std::string>{"a.csv: 1 of 4 landmarks have a missing coordinate and are left out: 2"}));
}

// What a specimen does not have is as if no file had it, its weight included.
TEST(Registrations, LeaveOutWhatIsAbsent) {
  Landmarks source, target;
  source.points = Points{{0, 1, 2, 3, 1, 2}, {0, 0.2, 0, 0.3, 1, 1.2}};
  source.source = "a.csv";
  target.points = source.points + Points{{0, 0.1, 0, 0.2, 0, 0.3}, {0.1, 0, 0.3, 0, 0.2, 0}};
  target.source = "b.csv";
  RegistrationOptions options = plain_options();
  options.kernel = "gaussian:alpha=1";
  options.data.weights = Eigen::VectorXd::LinSpaced(6, 1, 2);
  const std::vector<int> kept = {0, 2, 3, 5};
  RegistrationOptions of_kept = options;
  of_kept.data.weights = Eigen::VectorXd(options.data.weights(kept));
  Landmarks first = source, second = target;
  first.points = source.points(Eigen::all, kept);
  second.points = target.points(Eigen::all, kept);
  const Registration expected = register_shapes(first, second, of_kept);
  source.points.col(1).setConstant(std::nan(""));
  source.absent = {1};
  target.points.col(4).setConstant(std::nan(""));
  target.absent = {4};
  const Registration found = register_shapes(source, target, options);
  EXPECT_EQ(found.result, expected.result);
  EXPECT_EQ(found.cost.total(), expected.cost.total());
  EXPECT_EQ(found.source.numbers, (std::vector<int>{1, 3, 4, 6}));
  EXPECT_EQ(found.notes,
            (std::vector<std::string>{"a.csv does not have 1 landmark, which is left out of both shapes: 2",
                                      "b.csv does not have 1 landmark, which is left out of both shapes: 5"}));
  target.absent = {0, 2, 3, 4, 5};
  target.points(Eigen::all, target.absent).setConstant(std::nan(""));
  EXPECT_EQ(registration_error(source, target), "a.csv and b.csv: no landmark is left that both specimens have");
}

TEST(Registrations, FollowWeights) {
  const Landmarks source = square("a.csv");
  Landmarks target = source;
  target.points.col(0).array() += 0.3;
  RegistrationOptions options = plain_options();
  options.kernel = "gaussian:alpha=2";
  options.sigma = 0.1;
  const double plain = register_shapes(source, target, options).distances()[0];
  options.data.weights = Eigen::Vector4d(100, 1, 1, 1);
  EXPECT_LT(register_shapes(source, target, options).distances()[0], 0.2 * plain);
  options.data.weights = {};
  options.data.covariances.assign(4, 0.01 * Eigen::MatrixXd::Identity(2, 2));
  EXPECT_NEAR(register_shapes(source, target, options).distances()[0], plain, 1e-12);
  options.data.weights = Eigen::Vector3d::Ones();
  EXPECT_EQ(error_of([&] { register_shapes(source, target, options); }), "there are 3 weights for 4 landmarks");
}

// With one frozen realisation, and with the mean over several, the increments are those of the seed.
TEST(Registrations, MatchFrozenNoise) {
  const Landmarks source = square("a.csv");
  Landmarks target = source;
  target.points.row(0) *= 1.3;
  RegistrationOptions options = plain_options();
  options.kernel = "gaussian:alpha=1";
  options.noise = "ch-sd:beta=0.1";
  options.mode = MatchingMode::kPathwise;
  options.seed = 7;
  const Registration pathwise = register_shapes(source, target, options);
  EXPECT_TRUE(pathwise.converged);
  EXPECT_TRUE(pathwise.matched());
  EXPECT_EQ(pathwise.cost.action, 0);
  EXPECT_EQ(pathwise.increments, coarsened(brownian_increments(7, 0, 8, {1, 1280}), 64));
  EXPECT_EQ(replay(pathwise).final().q, pathwise.result);

  options.mode = MatchingMode::kExpected;
  options.samples = 5;
  const Registration expected = register_shapes(source, target, options);
  EXPECT_TRUE(expected.converged);
  EXPECT_EQ(expected.samples, 5);
  EXPECT_EQ(expected.spread.cols(), 4);
  EXPECT_LE((replay(expected).final().q - expected.result).norm(), 1e-13);
  // D is the mean over the realisations: with equal deviations it is rms² N/(2σ²).
  EXPECT_NEAR(expected.cost.data, 0.5 * 4 * std::pow(expected.rms() / 0.01, 2), 1e-9 * expected.cost.data);
}

// A circle of 20 points onto an ellipse of 33, and back in order.
TEST(Registrations, MatchOutlinesWithoutCorrespondence) {
  const auto outline = [](int count, double width, double height, const std::string& name) {
    Landmarks shape{.points = Points(2, count), .labels = {}, .groups = {}, .name = {}, .source = name};
    for (int a = 0; a < count; ++a) {
      const double angle = 6.283185307179586 * a / count;
      shape.points.col(a) << width * std::cos(angle), height * std::sin(angle);
    }
    return shape;
  };
  RegistrationOptions options = plain_options();
  options.kernel = "gaussian:alpha=0.8";
  options.sigma = 0.02;
  options.data.kind = DataKind::kVarifold;
  const Registration fit = register_shapes(outline(20, 1, 1, "a.csv"), outline(33, 1.4, 0.8, "b.csv"), options);
  EXPECT_TRUE(fit.converged);
  EXPECT_GT(fit.initial_rms(), 0.15);
  EXPECT_LT(fit.rms(), 0.03);
  options.align = AlignmentKind::kAffine;
  EXPECT_THAT(error_of([&] { register_shapes(outline(20, 1, 1, "a.csv"), outline(33, 1.4, 0.8, "b.csv"), options); }),
              HasSubstr("alignment affine needs corresponding landmarks"));
}

TEST(RegistrationErrors, NameLandmarksAtOnePlace) {
  Landmarks twice = square("a.csv");
  twice.points.col(2) = twice.points.col(1);
  EXPECT_THAT(registration_error(twice, square("b.csv")),
              AllOf(HasSubstr("a.csv: landmarks 2 and 3 are at the same position, but apart in b.csv"),
                    HasSubstr("`merge_coincident`")));
  twice.labels = {"nose", "chin", "left eye", "right eye"};
  EXPECT_THAT(registration_error(twice, square("b.csv")),
              HasSubstr("landmarks 'chin' and 'left eye' are at the same position"));
  EXPECT_EQ(registration_error(square("b.csv"), twice), "no error") << "a target may have coinciding landmarks";
}

// Under noise that moves each of them by itself: two points come apart, and the end points replay.
TEST(Registrations, PartLandmarksAtOnePlaceByNoise) {
  Landmarks twice = square("a.csv");
  twice.points.col(2) = twice.points.col(1);
  RegistrationOptions options;
  options.noise = "ch-sd:beta=100%";
  const Registration parted = register_shapes(twice, square("b.csv"), options);
  EXPECT_TRUE(parted.converged && parted.matched());
  EXPECT_EQ(parted.source.count(), 4);
  EXPECT_EQ(replay(parted).final().q, parted.result);
  for (const char* noise : {"none", "p-sd:beta=100%", "ch-sd:beta=100%,on=1", "trouve-vialard:sigma=100%"}) {
    options.noise = noise;
    EXPECT_THAT(error_of([&] { register_shapes(twice, square("b.csv"), options); }), HasSubstr("at the same position"))
        << noise;
  }
  options.noise = "ch-sd:beta=100%";
  options.mode = MatchingMode::kMap;
  EXPECT_THAT(error_of([&] { register_shapes(twice, square("b.csv"), options); }), HasSubstr("at the same position"));
}

Landmarks ring(int count, double width, const std::string& source, bool repeats_first) {
  Landmarks shape;
  shape.points.resize(2, count + (repeats_first ? 1 : 0));
  for (int a = 0; a < shape.count(); ++a) {
    const double angle = 2 * std::acos(-1.0) * (a % count) / count;
    shape.points.col(a) << width * std::cos(angle), std::sin(angle);
  }
  shape.source = source;
  return shape;
}

TEST(Registrations, TakeARepeatedFirstPointForTheEndOfAnOutline) {
  const Registration closed = register_shapes(ring(12, 1, "a.csv", true), ring(12, 1.3, "b.csv", true));
  const Registration open = register_shapes(ring(12, 1, "a.csv", false), ring(12, 1.3, "b.csv", false));
  EXPECT_EQ(closed.source.count(), 12);
  EXPECT_EQ(closed.momenta, open.momenta);
  EXPECT_THAT(closed.notes,
              Contains("a.csv: landmarks 1 and 13 are at the same position in both shapes and are merged: a closed "
                       "outline"));
  RegistrationOptions curves;
  curves.data.kind = DataKind::kVarifold;
  const Registration varifold = register_shapes(ring(12, 1, "a.csv", true), ring(15, 1.3, "b.csv", true), curves);
  EXPECT_TRUE(varifold.converged && varifold.matched());
  EXPECT_EQ(varifold.source.count(), 12);
}

// Two lines that meet: the point where they do is one, and both stay whole.
TEST(Registrations, JoinCurvesWhereTheyMeet) {
  const auto crossing = [](double height, const std::string& source) {
    Landmarks shape;
    shape.points.resize(2, 14);
    for (int a = 0; a < 7; ++a) {
      shape.points.col(a) << a - 3, height * (a - 3) * (a - 3) / 9;
      shape.points.col(7 + a) << 0, 3 - a;
    }
    shape.groups.assign(7, "across");
    shape.groups.resize(14, "down");
    shape.source = source;
    return shape;
  };
  RegistrationOptions options;
  options.data.kind = DataKind::kVarifold;
  const Registration joined = register_shapes(crossing(0, "a.csv"), crossing(0.5, "b.csv"), options);
  EXPECT_EQ(joined.source.count(), 13);
  EXPECT_TRUE(joined.converged && joined.matched());
  EXPECT_THAT(joined.notes, Contains("a.csv: landmarks 4 and 11 are at the same position and are merged"));
}

TEST(Registrations, MergeLandmarksAtOnePlaceWhereAsked) {
  Landmarks twice = square("a.csv");
  twice.points.conservativeResize(2, 5);
  twice.points.col(4) = twice.points.col(1);
  Landmarks target = square("b.csv");
  target.points.conservativeResize(2, 5);
  target.points.col(4) << 1.3, 0.1;
  RegistrationOptions options = plain_options();
  options.data.merge_coincident = true;
  options.data.weights = (Eigen::VectorXd(5) << 1, 2, 1, 1, 1).finished();
  const Registration merged = register_shapes(twice, target, options);
  ASSERT_EQ(merged.source.count(), 4);
  EXPECT_NEAR(merged.target.points(0, 1), (2 * 1 + 1.3) / 3, 1e-15);
  EXPECT_NEAR(merged.data.weights[1], 3, 0);
  EXPECT_EQ(merged.source.number(3), 4);
}

TEST(Registrations, PairByNumbersAndConvertAxes) {
  Landmarks source = ring(12, 1, "a.csv", false), target = ring(12, 1.2, "b.csv", false);
  for (int a = 0; a < 12; ++a) {
    source.numbers.push_back(a + 1);
    target.numbers.push_back(a + 1);
  }
  source.points.conservativeResize(2, 11);
  source.numbers.resize(11);
  const Registration paired = register_shapes(source, target);
  EXPECT_EQ(paired.target.count(), 11);
  EXPECT_THAT(paired.notes, Contains("b.csv: 1 of 12 landmarks is not in a.csv and is left out: 12"));
  Landmarks turned = square("a.csv");
  turned.points.topRows(2) *= -1;
  turned.axes = "RAS";
  Landmarks upright = square("b.csv");
  upright.axes = "LPS";
  const Registration converted = register_shapes(turned, upright, plain_options());
  EXPECT_EQ(converted.original.points, upright.points);
  EXPECT_LT(converted.rms(), 1e-12);
}

TEST(RegistrationErrors, NameNumbersOutOfRange) {
  for (const double value : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(error_with([&](auto& options) { options.sigma = value; }),
                AllOf(HasSubstr("sigma is"), HasSubstr("greater than 0")));
    EXPECT_THAT(error_with([&](auto& options) { options.lambda = value; }),
                AllOf(HasSubstr("lambda is"), HasSubstr("greater than 0")));
    EXPECT_THAT(error_with([&](auto& options) { options.grid.time = value; }),
                AllOf(HasSubstr("time is"), HasSubstr("greater than 0")));
  }
  EXPECT_EQ(error_with([](auto& options) { options.grid.steps = 0; }), "steps is 0; at least 1 is needed");
  EXPECT_EQ(error_with([](auto& options) { options.grid.steps = -3; }), "steps is -3; at least 1 is needed");
  Landmarks one = square("a.csv");
  one.points.conservativeResize(2, 1);
  RegistrationOptions options = plain_options();
  options.kernel = "gaussian:alpha=1";
  options.lambda.reset();
  EXPECT_EQ(registration_error(one, one, options),
            "the source has no two distinct landmarks, and so no size: kernel, lambda and sigma must be numbers");
  EXPECT_THAT(registration_error(one, one), HasSubstr("alpha=auto needs at least two distinct landmarks"));
}

TEST(RegistrationErrors, NameWhatIsUnknown) {
  EXPECT_EQ(error_of([] { parse_mode("mapp"); }),
            "unknown mode 'mapp'; did you mean 'map'; valid: deterministic, metamorphosis, map, pathwise, expected");
  EXPECT_EQ(error_of([] { parse_alignment("projective"); }),
            "unknown alignment 'projective'; valid: none, translation, rigid, similarity, affine");
  EXPECT_EQ(error_of([] { parse_solver("adam"); }),
            "unknown solver 'adam'; valid: auto, paths, shooting, gauss-newton, lbfgs");
  EXPECT_THAT(error_with([](auto& options) { options.kernel = "gausian"; }),
              AllOf(HasSubstr("unknown kernel 'gausian'"), HasSubstr("'gaussian'")));
  EXPECT_THAT(error_with([](auto& options) { options.noise = "chsd:beta=1"; }),
              AllOf(HasSubstr("unknown noise 'chsd'"), HasSubstr("valid: none")));
  EXPECT_THAT(error_with([](auto& options) { options.integrator = "euler"; }),
              HasSubstr("unknown integrator 'euler'; valid: variational"));
  EXPECT_EQ(error_with([](auto& options) { options.noise = "ch-sd:beta=1,on=5"; }),
            "noise 'ch-sd:beta=1,on=5': on=5 names a landmark beyond the last; the shape has 4");
  EXPECT_EQ(error_with([](auto& options) { options.mode = MatchingMode::kMap; }),
            "mode map fits the noise, and there is none; give one, as in `noise = ch-sd:beta=1`");
}

TEST(RegistrationErrors, ObjectiveRefusesWhatDoesNotFit) {
  const Points q = square("").points;
  Points twice = q;
  twice.col(2) = twice.col(1);
  const auto error = [](const Points& source, const Points& target) {
    return error_of([&] {
      MatchingObjective({{make_kernel("gaussian:alpha=1", source), make_noise("none")},
                         make_integrator("variational"),
                         {},
                         source,
                         std::make_shared<LandmarkTerm>(LandmarkObservations{target, 0.01}),
                         0.01,
                         1});
    });
  };
  EXPECT_EQ(error(q, q), "no error");
  EXPECT_NE(error(twice, q), "no error");
  EXPECT_NE(error(q, q.leftCols(3)), "no error");
}

// With no more coordinates than parameters the alignment alone matches whatever was observed.
TEST(RegistrationErrors, NameAnUndeterminedAlignment) {
  const Landmarks source = square("a.csv");
  Landmarks target = square("b.csv");
  target.points = target.points.array().square() + 0.3;
  RegistrationOptions options = plain_options();
  options.align.reset();
  target.points.rightCols(2).setConstant(std::nan(""));
  EXPECT_THAT(registration_error(source, target, options),
              AllOf(HasSubstr("b.csv: the match is undetermined: alignment similarity has 4 parameters in 2D"),
                    HasSubstr("use `align = translation`")));
  target.points.col(1).setConstant(std::nan(""));
  EXPECT_THAT(registration_error(source, target, options), HasSubstr("use `align = none`"));
  options.align = AlignmentKind::kNone;
  EXPECT_TRUE(register_shapes(source, target, options).converged);  // momenta have a prior
  target.points.setConstant(std::nan(""));
  target.points.col(0) << 0, std::nan("");
  EXPECT_THAT(registration_error(source, target, options), HasSubstr("no landmark has all its coordinates"));
}

// The data of landmarks that a sigma blurs by far cost nothing; they are not equal for that.
TEST(Registrations, AreOfEqualShapesWhereTheyAreEqual) {
  const Landmarks source = square("a.csv");
  Landmarks target = square("b.csv");
  RegistrationOptions options = plain_options();
  for (const char* integrator : {"midpoint", "variational-2"}) {
    options.integrator = integrator;
    options.sigma = 0.01;
    target.points = source.points;
    EXPECT_EQ(register_shapes(source, target, options).stop_reason, "the shapes are equal") << integrator;
    options.sigma = 1e9;
    target.points(0, 0) += 1;
    EXPECT_EQ(register_shapes(source, target, options).stop_reason, "the shapes do not differ beyond sigma")
        << integrator;
  }
}

// Numbers beyond all measure are refused by their names, or nothing is claimed of what they lead to.
TEST(Registrations, NeverClaimNumbersThatAreNotFinite) {
  Landmarks source = square("a.csv"), target = square("b.csv");
  target.points = 1.2 * source.points.array().square() + 0.3;
  int refused = 0;
  for (const double extreme : {1e-300, 1e-200, 1e-150, 1e-100, 1e-50, 1e50, 1e100, 1e150, 1e200, 1e300})
    for (const int which : {0, 1, 2, 3, 4})
      for (const char* noise : {"none", "ch-sd:beta=0.3"}) {
        RegistrationOptions options = plain_options();
        options.minimise.max_iterations = 20;
        options.noise = noise;
        if (which == 0) options.grid.time = extreme;
        if (which == 1) options.sigma = extreme;
        if (which == 2) options.lambda = extreme;
        std::ostringstream text;
        text << extreme;
        SCOPED_TRACE(text.str() + ' ' + std::to_string(which) + ' ' + noise);
        try {
          if (which == 3) options.kernel = "gaussian:alpha=" + text.str();
          if (which == 4) options.noise = "ch-sd:beta=" + text.str();
          const Registration found = register_shapes(source, target, options);
          EXPECT_TRUE(std::isfinite(found.cost.total()));
          EXPECT_TRUE(found.momenta.allFinite() && found.result.allFinite() && found.increments.allFinite());
          if (found.stop_reason == "the gradient vanishes") {
            EXPECT_LE(found.relative_gradient, options.minimise.gradient_tolerance);
          }
        } catch (const Error&) {
          ++refused;
        }
      }
  EXPECT_GT(refused, 10);
}

}  // namespace
}  // namespace pulson::matching
