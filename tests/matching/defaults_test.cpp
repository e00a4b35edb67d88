// A first registration: nothing but two shapes, in any unit.

#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "combinations.hpp"
#include "error_of.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::matching {
namespace {

using testing::HasSubstr;

Landmarks shape_of(const Points& points) {
  Landmarks shape;
  shape.points = points;
  return shape;
}

struct Shapes {
  Points source, target;
};

// A ring of points and a smooth deformation of it, turned, moved and half as large again.
Shapes deformed_ring(Eigen::Index d, Eigen::Index n) {
  Shapes shapes{Points(d, n), Points(d, n)};
  for (Eigen::Index a = 0; a < n; ++a) {
    const double t = 2 * std::acos(-1.0) * static_cast<double>(a) / static_cast<double>(n);
    const double x = 1.5 * std::cos(t), y = std::sin(t);
    shapes.source.col(a).head(2) << x, y;
    shapes.target.col(a).head(2) << 10 - 1.5 * (y + 0.2 * x * x), 4 + 1.5 * (x + 0.1 * std::sin(3 * t));
    if (d == 3) shapes.source(2, a) = 0.3 * std::cos(2 * t), shapes.target(2, a) = 0.6 * std::cos(2 * t);
  }
  return shapes;
}

TEST(Defaults, GiveTheSameMatchInAnyUnit) {
  for (const Eigen::Index d : {2, 3}) {
    const Shapes shapes = deformed_ring(d, 16);
    for (const std::string noise : {"none", "ch-sd:beta=5%", "p-sd:beta=5%,fields=grid,count=3"}) {
      if (d == 3 && noise != "none") continue;
      RegistrationOptions options;
      options.noise = noise;
      const Registration one = register_shapes(shape_of(shapes.source), shape_of(shapes.target), options);
      EXPECT_TRUE(one.converged && one.matched()) << noise << one.stop_reason;
      EXPECT_EQ(one.alignment.kind, AlignmentKind::kSimilarity);
      for (const double unit : {1e-3, 1e3}) {
        const Registration other =
            register_shapes(shape_of(unit * shapes.source), shape_of(unit * shapes.target), options);
        EXPECT_NEAR(other.cost.total(), one.cost.total(), 1e-6 * one.cost.total()) << noise;
        EXPECT_LE((other.result / unit - one.result).norm(), 1e-6 * one.result.norm()) << noise;
        EXPECT_LE((other.momenta / unit - one.momenta).norm(), 1e-6 * one.momenta.norm()) << noise;
        EXPECT_EQ(other.iterations, one.iterations) << noise;
      }
    }
  }
}

TEST(Defaults, MatchASwapOnALineByNoiseAlone) {
  RegistrationOptions options;
  options.noise = "ch-sd:beta=100%";
  for (const double unit : {1e-3, 1.0, 1e3}) {
    const Registration swap =
        register_shapes(shape_of(unit * Points{{0.0, 1.0}}), shape_of(unit * Points{{1.0, 0.0}}), options);
    EXPECT_TRUE(swap.converged && swap.matched());
    EXPECT_EQ(swap.alignment.kind, AlignmentKind::kNone);
    EXPECT_EQ(order_inversions(swap.source.points, swap.result), 1);
    EXPECT_DOUBLE_EQ(swap.sigma, 0.005 * unit);
    EXPECT_DOUBLE_EQ(swap.lambda * unit * unit, 1);
  }
}

TEST(Defaults, KeepWhatIsGiven) {
  const Shapes shapes = deformed_ring(2, 16);
  RegistrationOptions options;
  options.lambda = 3;
  options.sigma = Length::percent(2);
  options.align = AlignmentKind::kRigid;
  const Registration given = register_shapes(shape_of(shapes.source), shape_of(shapes.target), options);
  EXPECT_EQ(given.lambda, 3);
  EXPECT_NEAR(given.sigma, 0.02 * diameter(given.source.points), 1e-12);
  EXPECT_EQ(given.alignment.kind, AlignmentKind::kRigid);
  EXPECT_TRUE(given.fitted_kernel);
  options.kernel = "gaussian:alpha=30%";
  options.lambda.reset();
  const Registration gaussian = register_shapes(shape_of(shapes.source), shape_of(shapes.target), options);
  const double size = diameter(gaussian.source.points);
  EXPECT_NEAR(make_kernel(gaussian.kernel).terms().front().alpha, 0.3 * size, 1e-12);
  EXPECT_NEAR(gaussian.lambda, 1 / (size * size), 1e-12);
  EXPECT_FALSE(gaussian.fitted_kernel);
}

TEST(Defaults, NeedASize) {
  EXPECT_THAT(error_of([] { register_shapes(shape_of(Points{{1.0}}), shape_of(Points{{2.0}})); }),
              HasSubstr("no two distinct landmarks"));
  RegistrationOptions numbers;
  numbers.kernel = "gaussian:alpha=1";
  numbers.lambda = 1;
  numbers.sigma = 0.01;
  EXPECT_TRUE(register_shapes(shape_of(Points{{1.0}}), shape_of(Points{{2.0}}), numbers).matched());
}

TEST(Lengths, AreNumbersOrPerCent) {
  EXPECT_EQ(Length::parse("0.3", "--sigma").in(7), 0.3);
  EXPECT_EQ(Length::parse("50%", "--sigma").in(7), 3.5);
  EXPECT_EQ(Length::parse("0.5%", "--sigma").text(), "0.5%");
  EXPECT_EQ(Length(2).text(), "2");
  for (const std::string text : {"%", "", "1 %", "5%%", "a%"})
    EXPECT_THAT(error_of([&] { Length::parse(text, "--sigma"); }), HasSubstr("--sigma is")) << text;
}

TEST(Lengths, OfSpecificationsAreOfTheShape) {
  const Landmarks shape = shape_of(Points{{0.0, 3.0}, {0.0, 4.0}});
  EXPECT_EQ(make_noise("ch-sd:beta=10%", shape)->spec(), "ch-sd:beta=0.5");
  EXPECT_EQ(make_kernel("peakon:alpha=20%", shape.points).spec(), "peakon:alpha=1");
  EXPECT_THAT(error_of([&] { make_noise("ch-sd:beta=10%"); }),
              HasSubstr("beta is '10%', a percentage of the diameter"));
  EXPECT_THAT(error_of([&] { make_noise("ch-sd-screened:beta=1,gamma=10%", shape); }),
              HasSubstr("gamma is '10%'; it is not a length"));
  EXPECT_THAT(error_of([&] { make_noise("ch-sd:beta=x%", shape); }), HasSubstr("beta is 'x'; a number is needed"));
}

}  // namespace
}  // namespace pulson::matching
