// Each noise model on small numbers worked out by hand, and the errors for wrong specifications.

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kernel_definition.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::ThrowsMessage;

Points row(std::initializer_list<double> values) {
  return Eigen::Map<const Eigen::RowVectorXd>(values.begin(), static_cast<Eigen::Index>(values.size()));
}
Points columns(const std::vector<std::vector<double>>& points) {
  Points all(points.front().size(), points.size());
  for (std::size_t a = 0; a < points.size(); ++a)
    for (std::size_t axis = 0; axis < points[a].size(); ++axis) all(axis, a) = points[a][axis];
  return all;
}
Landmarks shape_of(const Points& points, const std::vector<std::string>& groups = {}) {
  Landmarks shape;
  shape.points = points;
  shape.groups = groups;
  return shape;
}
Eigen::VectorXd unit(Eigen::Index size, Eigen::Index i) { return Eigen::VectorXd::Unit(size, i); }

void expect_near(const Eigen::MatrixXd& found, const Eigen::MatrixXd& right) {
  ASSERT_EQ(found.rows(), right.rows());
  ASSERT_EQ(found.cols(), right.cols());
  EXPECT_LE((found - right).norm(), 1e-15 * right.norm()) << found << "\n\nand\n\n" << right;
}

// ---- none

TEST(NoNoise, DoesNothing) {
  const std::shared_ptr<const NoiseModel> none = make_noise("none");
  const PhaseState state{random_points(3, 4, 1), random_points(3, 4, 2)};
  EXPECT_EQ(none->channels(3, 4), 0);
  EXPECT_EQ(none->gradient(state, Eigen::VectorXd()).p, Points::Zero(3, 4));
  EXPECT_EQ(none->gradient(state, Eigen::VectorXd()).q, Points::Zero(3, 4));
  EXPECT_TRUE(none->traits().diffeomorphic);
}

// ---- ch-sd

TEST(ChSd, MovesEachChosenLandmarkByBetaTimesItsOwnIncrement) {
  const Points w = random_points(2, 3, 1);
  const PhaseState state{random_points(2, 8, 2), random_points(2, 8, 3)};
  Points expected = Points::Zero(2, 8);
  expected(Eigen::all, {1, 4, 7}) = 0.25 * w;
  const std::shared_ptr<const NoiseModel> noise = make_noise("ch-sd:beta=0.25,on=8/2/5");
  EXPECT_EQ(noise->gradient(state, w.reshaped()).p, expected);
  EXPECT_EQ(noise->gradient(state, w.reshaped()).q, Points::Zero(2, 8));
  EXPECT_EQ(noise->channels(2, 8), 6);
  EXPECT_EQ(noise->spec(), "ch-sd:beta=0.25,on=2/5/8");
  EXPECT_EQ(make_noise("ch-sd:beta=1")->channels(3, 8), 24);
}

TEST(ChSd, SpecKeepsEveryBitOfBeta) {
  const PhaseState state{Points::Zero(1, 1), Points::Zero(1, 1)};
  for (const std::string beta : {"0.1", "0.30000000000000004", "1e-200", "1e+20", "12345678.9", "0.3333333333333333"}) {
    const std::shared_ptr<const NoiseModel> noise = make_noise("ch-sd:beta=" + beta);
    EXPECT_EQ(noise->gradient(state, unit(1, 0)).p(0), std::stod(beta));
    EXPECT_EQ(make_noise(noise->spec())->gradient(state, unit(1, 0)).p(0), std::stod(beta));
  }
}

TEST(ChSd, RefusesALandmarkBeyondTheLast) {
  const std::shared_ptr<const NoiseModel> noise = make_noise("ch-sd:beta=1,on=1/9");
  EXPECT_NO_THROW(noise->check(2, 9));
  EXPECT_THAT([&] { noise->check(2, 8); },
              ThrowsMessage<InputError>("noise 'ch-sd:beta=1,on=1/9': on=9 names a landmark beyond the last; "
                                        "the shape has 8"));
}

// ---- ch-sd-screened

// h = β p₂ exp(−(q₁ − q₂)²/γ), Figure 4 of the paper.
TEST(ChSdScreened, OfTwoLandmarksIsThePapersPotential) {
  const double beta = 4;
  const double gamma = 5;
  const double q1 = 0.5;
  const double q2 = 2;
  const double p2 = -1.5;
  const double e = std::exp(-(q1 - q2) * (q1 - q2) / gamma);
  const double slope = -2 * (q2 - q1) / gamma * e;  // ∂e/∂q₂
  const PhaseState state{row({q1, q2}), row({3, p2})};
  const std::shared_ptr<const NoiseModel> noise = make_noise("ch-sd-screened:beta=4,gamma=5,on=2");
  ASSERT_EQ(noise->channels(1, 2), 1);
  EXPECT_DOUBLE_EQ(noise->potentials(state)[0], beta * p2 * e);
  const PhaseState gradient = noise->gradient(state, unit(1, 0));
  expect_near(gradient.p, row({0, beta * e}));
  expect_near(gradient.q, row({-beta * p2 * slope, beta * p2 * slope}));
  expect_near(noise->compensation_gradient(state).p, row({0, beta * beta * e * slope / 4}));
}

TEST(ChSdScreened, EachOtherLandmarkScreensWhereThereIsOneGroup) {
  const Points q = row({0, 1, 3});
  const std::vector<std::string> one{"a", "a", "a"};
  for (const auto& groups : {std::vector<std::string>(), one}) {
    const auto noise = make_noise("ch-sd-screened:beta=2,gamma=1", shape_of(q, groups));
    expect_near(
        noise->potentials({q, row({1, 1, 1})}),
        row({2 * (std::exp(-1) + std::exp(-9)), 2 * (std::exp(-1) + std::exp(-4)), 2 * (std::exp(-9) + std::exp(-4))})
            .transpose());
  }
}

TEST(ChSdScreened, OnlyOtherGroupsScreenWhereThereAreSeveral) {
  const Points q = row({0, 1, 3});
  const auto noise = make_noise("ch-sd-screened:beta=2,gamma=1", shape_of(q, {"a", "a", "b"}));
  expect_near(noise->potentials({q, row({1, 1, 1})}),
              row({2 * std::exp(-9), 2 * std::exp(-4), 2 * (std::exp(-9) + std::exp(-4))}).transpose());
}

TEST(ChSdScreened, RefusesAShapeThatItsGroupsAreNotOf) {
  const auto noise = make_noise("ch-sd-screened:beta=2,gamma=1", shape_of(row({0, 1, 3}), {"a", "a", "b"}));
  EXPECT_NO_THROW(noise->check(1, 3));
  EXPECT_THAT([&] { noise->check(1, 4); },
              ThrowsMessage<InputError>("noise 'ch-sd-screened:beta=2,gamma=1': it was made for 3 landmarks, the shape "
                                        "has 4"));
}

// ---- p-sd

TEST(PSd, ConstantFieldsMoveAllLandmarksAlike) {
  const PhaseState state{random_points(2, 3, 1), random_points(2, 3, 2)};
  const std::shared_ptr<const NoiseModel> noise = make_noise("p-sd:beta=0.5");
  ASSERT_EQ(noise->channels(2, 3), 2);
  expect_near(noise->potentials(state), 0.5 * state.p.rowwise().sum());
  const PhaseState gradient = noise->gradient(state, Eigen::Vector2d(2, -4));
  EXPECT_EQ(gradient.p, Eigen::Vector2d(1, -2).replicate(1, 3));
  EXPECT_EQ(gradient.q, Points::Zero(2, 3));
}

// β exp(−|x − c|²/width²) along each axis: the momentum feels both derivatives of the field along one axis.
TEST(PSd, BumpHasCrossTerms) {
  const auto noise = make_noise("p-sd:beta=3,fields=bump,center=1/2,width=0.5", shape_of(columns({{0, 0}, {1, 1}})));
  ASSERT_EQ(noise->channels(2, 1), 2);
  const PhaseState state{columns({{1.25, 1.5}}), columns({{5, 7}})};
  const double value = 3 * std::exp(-(0.0625 + 0.25) / 0.25);
  expect_near(noise->potentials(state), Eigen::Vector2d(5 * value, 7 * value));
  const PhaseState along_y = noise->gradient(state, Eigen::Vector2d(0, 1));
  expect_near(along_y.p, Eigen::Vector2d(0, value));
  expect_near(along_y.q, Eigen::Vector2d(7 * value * -2 * 0.25 / 0.25, 7 * value * -2 * -0.5 / 0.25));
}

TEST(PSd, TakesSeveralCentres) {
  const auto noise = make_noise("p-sd:beta=1,fields=bump,center=0/0/3/4,width=0.1", shape_of(Points::Zero(2, 1)));
  ASSERT_EQ(noise->channels(2, 1), 4);
  expect_near(noise->potentials({columns({{3, 4}}), columns({{1, 2}})}), Eigen::Vector4d(0, 0, 1, 2));
  EXPECT_EQ(noise->spec(), "p-sd:beta=1,fields=bump,center=0/0/3/4,width=0.1");
}

TEST(PSd, CosineOfEachCoordinateAlongEachAxis) {
  const auto noise = make_noise("p-sd:beta=2,fields=cos,wavenumber=3");
  expect_near(noise->potentials({row({0.4}), row({5})}), row({5 * 2 * std::cos(1.2)}));
  const double of_x = 2 * std::cos(3 * 0.4);
  const double of_y = 2 * std::cos(3 * -0.7);
  expect_near(noise->potentials({columns({{0.4, -0.7}}), columns({{5, 7}})}),
              Eigen::Vector4d(5 * of_x, 7 * of_x, 5 * of_y, 7 * of_y));
}

// The places where one of the narrow bumps is 1, in the order of the channels: noise shows them as x-velocities.
std::vector<Points> bumps_at(const Landmarks& shape, const std::string& count, const Points& places) {
  const auto noise = make_noise("p-sd:beta=1,fields=grid,width=1e-3,count=" + count, shape);
  const Eigen::Index channels = noise->channels(shape.dimension(), shape.count());
  std::vector<Points> found;
  for (Eigen::Index i = 0; i < channels; i += shape.dimension()) {
    const Points field = noise->spatial_noise(places, {shape.points, {}}, unit(channels, i));
    for (Eigen::Index a = 0; a < places.cols(); ++a)
      if (field(0, a) > 0.99) found.emplace_back(places.col(a));
  }
  EXPECT_EQ(std::ssize(found) * shape.dimension(), channels);
  return found;
}

TEST(PSd, GridReachesTheCornersOfTheBox) {
  const Landmarks shape = shape_of(columns({{0, 11}, {3, 10}, {1, 12}}));
  const Points places = columns({{0, 10}, {3, 10}, {0, 12}, {3, 12}, {1.5, 11}});
  EXPECT_THAT(bumps_at(shape, "2", places), ElementsAre(places.col(0), places.col(1), places.col(2), places.col(3)));
  EXPECT_EQ(make_noise("p-sd:beta=1,fields=grid", shape)->channels(2, 3), 2 * 4 * 4);
}

TEST(PSd, GridOfOneIsInTheMiddle) {
  const Points middle = columns({{1.5, 11}});
  EXPECT_THAT(bumps_at(shape_of(columns({{0, 10}, {3, 12}})), "1", middle), ElementsAre(middle));
}

TEST(PSd, GridHasOneRowAlongAFlatAxis) {
  const Points places = columns({{0, 5}, {1, 5}, {2, 5}});
  EXPECT_THAT(bumps_at(shape_of(columns({{0, 5}, {2, 5}})), "3", places),
              ElementsAre(places.col(0), places.col(1), places.col(2)));
}

TEST(PSd, AutomaticWidthIsTheSpacingOrAQuarterOfTheDiameter) {
  const Landmarks shape = shape_of(columns({{0, 0}, {3, 4}}));
  const auto width = [&](const std::string& fields) {
    return make_noise("p-sd:beta=1," + fields, shape)->parameters()[1];
  };
  EXPECT_DOUBLE_EQ(width("fields=grid,count=4"), 1);
  EXPECT_DOUBLE_EQ(width("fields=grid,count=1"), 5.0 / 4);
  EXPECT_DOUBLE_EQ(width("fields=bump,center=0/0/1/1"), 5.0 / 4);
  const Landmarks flat = shape_of(columns({{0, 5, 1}, {2, 5, 1}}));
  EXPECT_DOUBLE_EQ(make_noise("p-sd:beta=1,fields=grid,count=3", flat)->parameters()[1], 1);
}

TEST(PSd, RefusesAShapeOfAnotherDimension) {
  const auto noise = make_noise("p-sd:beta=1,fields=bump,center=0/0,width=1", shape_of(Points::Zero(2, 1)));
  EXPECT_THAT([&] { noise->check(3, 1); },
              ThrowsMessage<InputError>("noise 'p-sd:beta=1,fields=bump,center=0/0,width=1': its centres are points in "
                                        "2D, the shape is in 3D"));
}

// ---- noise in the momenta

TEST(TrouveVialard, PushesEachChosenLandmark) {
  const PhaseState state{columns({{1, 2}, {3, 4}, {5, 6}}), random_points(2, 3, 1)};
  const auto noise = make_noise("trouve-vialard:sigma=0.5,on=1/3");
  expect_near(noise->potentials(state), Eigen::Vector4d(0.5, 1, 2.5, 3));
  EXPECT_EQ(noise->gradient(state, Eigen::Vector4d(2, 4, 6, 8)).q, columns({{1, 2}, {0, 0}, {3, 4}}));
  EXPECT_EQ(noise->gradient(state, Eigen::Vector4d(2, 4, 6, 8)).p, Points::Zero(2, 3));
}

TEST(TrouveVialard, InCommonPushesAllAlike) {
  const PhaseState state{columns({{1, 2}, {3, 4}, {5, 6}}), random_points(2, 3, 1)};
  const auto all = make_noise("trouve-vialard:sigma=0.5,common=1");
  expect_near(all->potentials(state), Eigen::Vector2d(4.5, 6));
  EXPECT_EQ(all->gradient(state, Eigen::Vector2d(2, 4)).q, columns({{1, 2}, {1, 2}, {1, 2}}));
  const auto some = make_noise("trouve-vialard:sigma=0.5,common=1,on=1/3");
  EXPECT_EQ(some->gradient(state, Eigen::Vector2d(2, 4)).q, columns({{1, 2}, {0, 0}, {1, 2}}));
  EXPECT_EQ(some->spec(), "trouve-vialard:sigma=0.5,common=1,on=1/3");
}

// h = β exp(−(q₁ − q₂)²/γ), §5.4 of the paper.
TEST(Potential, PushesPairsApart) {
  const PhaseState state{row({0, 1, 3}), row({1, 1, 1})};
  const auto noise = make_noise("potential:beta=2,gamma=4");
  const double h12 = 2 * std::exp(-0.25);
  const double h13 = 2 * std::exp(-2.25);
  const double h23 = 2 * std::exp(-1);
  expect_near(noise->potentials(state), Eigen::Vector3d(h12, h13, h23));
  expect_near(noise->gradient(state, unit(3, 1)).q, row({h13 * 2 * 3 / 4, 0, -h13 * 2 * 3 / 4}));
  const auto common = make_noise("potential:beta=2,gamma=4,common=1");
  ASSERT_EQ(common->channels(1, 3), 1);
  EXPECT_DOUBLE_EQ(common->potentials(state)[0], h12 + h13 + h23);
}

// Landmarks 0 and 1 apart by 2, width 2: fields fall to 1/e. Without momenta they move alone.
TEST(Kunita, MovesLandmarksByFieldsAboutThem) {
  const PhaseState state{row({0, 2}), row({3, 5})};
  const auto noise = make_noise("kunita:beta=0.5,width=2");
  const double k = std::exp(-1);
  expect_near(noise->potentials(state), Eigen::Vector2d(0.5 * (3 + 5 * k), 0.5 * (5 + 3 * k)));
  const PhaseState gradient = noise->gradient(state, Eigen::Vector2d(10, 20));
  expect_near(gradient.p, row({0.5 * (10 + 20 * k), 0.5 * (20 + 10 * k)}));
  const double slope = 0.5 * k * (3 * 20 + 5 * 10);  // of h_w by q_0, as −2 (q_0 − q_1)/width² = 1
  expect_near(gradient.q, row({slope, -slope}));
  EXPECT_EQ(noise->gradient({state.q, Points::Zero(1, 2)}, Eigen::Vector2d(10, 20)).q, Points::Zero(1, 2));
  expect_near(noise->spatial_noise(row({4}), state, Eigen::Vector2d(10, 20)),
              row({0.5 * (10 * std::exp(-4) + 20 * k)}));
  EXPECT_EQ(make_noise("kunita:beta=0.5", shape_of(row({0, 8})))->spec(), "kunita:beta=0.5,width=2");
}

TEST(Langevin, HasNoiseAndFriction) {
  const PhaseState state{columns({{1, 2}, {3, 4}}), random_points(2, 2, 1)};
  const auto noise = make_noise("langevin:sigma=0.5,friction=0.25");
  EXPECT_EQ(noise->friction(), 0.25);
  EXPECT_EQ(noise->friction_by_parameters(Eigen::Vector2d(3, 7)), 7);
  EXPECT_EQ(noise->gradient(state, Eigen::Vector4d(2, 4, 6, 8)).q, columns({{1, 2}, {3, 4}}));
  EXPECT_EQ(make_noise("langevin:sigma=1")->friction(), 1);
  EXPECT_EQ(make_noise("langevin:sigma=1,friction=0")->friction(), 0);
}

// ---- wrong specifications

struct Wrong {
  std::string spec;
  std::string message;
};

void expect_refused(const std::vector<Wrong>& all, const Landmarks& shape) {
  for (const Wrong& wrong : all)
    EXPECT_THAT([&] { make_noise(wrong.spec, shape); }, ThrowsMessage<InputError>(wrong.message)) << wrong.spec;
}

TEST(WrongNoise, Numbers) {
  expect_refused({{"ch-sd",
                   "noise 'ch-sd' needs beta (amplitude, length per square root of time; 50%: of the diameter), as in "
                   "ch-sd:beta=100%"},
                  {"ch-sd:beta=0", "noise 'ch-sd': beta is 0; it must be greater than 0"},
                  {"ch-sd:beta=-1", "noise 'ch-sd': beta is -1; it must be greater than 0"},
                  {"ch-sd:beta=nan", "noise 'ch-sd': beta is 'nan'; it must be finite"},
                  {"ch-sd:beta=inf", "noise 'ch-sd': beta is 'inf'; it must be finite"},
                  {"ch-sd:beta=one", "noise 'ch-sd': beta is 'one'; a number is needed"},
                  {"ch-sd:beta=", "noise 'ch-sd': 'beta=' is not key=value"},
                  {"ch-sd:beta", "noise 'ch-sd': 'beta' is not key=value"},
                  {"ch-sd:beta=1,beta=2", "noise 'ch-sd': beta is given twice"},
                  {"ch-sd-screened:beta=1",
                   "noise 'ch-sd-screened' needs gamma (range: exp(-r^2/gamma), length squared), as in "
                   "ch-sd-screened:gamma=1"},
                  {"potential:beta=1,gamma=0", "noise 'potential': gamma is 0; it must be greater than 0"},
                  {"langevin:sigma=1,friction=-1", "noise 'langevin': friction is -1; it must not be negative"}},
                 {});
}

TEST(WrongNoise, LandmarksAndFlags) {
  for (const std::string on : {"0", "1.5", "-2"})
    expect_refused(
        {{"ch-sd:beta=1,on=" + on, "noise 'ch-sd': on is '" + on + "'; landmarks are counted from 1, as in 1/3/5"}},
        {});
  expect_refused({{"ch-sd:beta=1,on=1/1", "noise 'ch-sd': on is '1/1'; it names a landmark twice"},
                  {"ch-sd:beta=1,on=first", "noise 'ch-sd': on is 'first'; a number is needed"},
                  {"trouve-vialard:sigma=1,common=2", "noise 'trouve-vialard': common is '2'; it must be 0 or 1"},
                  {"potential:beta=1,gamma=1,common=yes", "noise 'potential': common is 'yes'; it must be 0 or 1"}},
                 {});
}

TEST(WrongNoise, Fields) {
  const std::string kinds = "; valid: bump, constant, cos, grid";
  const Landmarks shape = shape_of(random_points(2, 5, 1));
  expect_refused({{"p-sd:beta=1,fields=gird", "noise 'p-sd': fields is 'gird'; did you mean 'grid'" + kinds},
                  {"p-sd:beta=1,fields=something", "noise 'p-sd': fields is 'something'" + kinds},
                  {"p-sd:beta=1,width=0.3", "noise 'p-sd': fields=constant does not use width"},
                  {"p-sd:beta=1,fields=cos,count=3", "noise 'p-sd': fields=cos does not use count"},
                  {"p-sd:beta=1,fields=grid,center=0/0", "noise 'p-sd': fields=grid does not use center"},
                  {"p-sd:beta=1,fields=cos,wavenumber=0", "noise 'p-sd': wavenumber is 0; it must be greater than 0"},
                  {"p-sd:beta=1,fields=grid,width=0", "noise 'p-sd': width is 0; it must be greater than 0"},
                  {"p-sd:beta=1,fields=grid,width=-1", "noise 'p-sd': width is -1; it must be greater than 0"},
                  {"p-sd:beta=1,fields=grid,width=nan", "noise 'p-sd': width is 'nan'; it must be finite"}},
                 shape);
}

TEST(WrongNoise, Grids) {
  for (const std::string count : {"0", "-1", "1.5", "1000"})
    expect_refused({{"p-sd:beta=1,fields=grid,count=" + count,
                     "noise 'p-sd': count is " + count + "; it must be a whole number from 1 to 100"}},
                   shape_of(random_points(2, 5, 1)));
  expect_refused({{"p-sd:beta=1,fields=grid,count=100",
                   "noise 'p-sd': count=100 makes 1000000 bumps in 3D; at most 10000 can be used, which is count=21"}},
                 shape_of(random_points(3, 5, 1)));
  expect_refused({{"p-sd:beta=1,fields=grid", "noise 'p-sd': fields=grid needs a shape, whose box it covers"}}, {});
  expect_refused(
      {{"p-sd:beta=1,fields=grid", "noise 'p-sd': width=auto needs at least two distinct landmarks; give a number"}},
      shape_of(Points::Zero(2, 1)));
}

TEST(WrongNoise, Centres) {
  const std::string bump = "p-sd:beta=1,fields=bump,width=1";
  expect_refused(
      {{bump, "noise 'p-sd': fields=bump needs center, as in center=0/0"},
       {bump + ",center=0/0/1", "noise 'p-sd': center has 3 numbers; in 2D each centre takes 2, as in center=0/0"},
       {bump + ",center=0/x", "noise 'p-sd': center is 'x'; a number is needed"},
       {bump + ",center=0/nan", "noise 'p-sd': center is '0/nan'; it must be finite"}},
      shape_of(random_points(2, 5, 1)));
  expect_refused(
      {{bump + ",center=0/0", "noise 'p-sd': center has 2 numbers; in 3D each centre takes 3, as in center=0/0/0"}},
      shape_of(random_points(3, 5, 1)));
}

TEST(WrongNoise, KeysAndNames) {
  std::string names;
  for (const auto& row : noise_table().rows()) names += (names.empty() ? "" : ", ") + row.name;
  expect_refused({{"ch-sd:beta=1,gamma=2", "noise 'ch-sd' has no parameter 'gamma'; it has: beta, on"},
                  {"none:beta=1", "noise 'none' has no parameter 'beta'; it has: none"},
                  {"chsd:beta=1", "unknown noise 'chsd'; did you mean 'ch-sd'; valid: " + names},
                  {"ch-sd:beta=1+brownian:sigma=1", "unknown noise 'brownian'; valid: " + names}},
                 {});
}

TEST(WrongNoise, EmptyTerms) {
  expect_refused({{"", "the noise is empty; no noise is 'none'"}}, {});
  for (const std::string spec : {"ch-sd:beta=1+", "+ch-sd:beta=1", "ch-sd:beta=1++p-sd:beta=1", "+"})
    expect_refused({{spec, "noise '" + spec +
                               "': a term of the sum is empty; models are joined as in ch-sd:beta=1+p-sd:beta=0.2"}},
                   {});
}

TEST(WrongNoise, ParametersThatAreFitted) {
  EXPECT_THAT([] { make_noise("ch-sd:beta=1,on=2")->with_parameters(row({-1})); },
              ThrowsMessage<InputError>("noise 'ch-sd:beta=-1,on=2': beta must be a finite number greater than 0"));
  EXPECT_THAT([] { make_noise("langevin:sigma=1")->with_parameters(Eigen::Vector2d(1, -2)); },
              ThrowsMessage<InputError>(
                  "noise 'langevin:sigma=1,friction=-2': friction must be a finite number that is not negative"));
  EXPECT_THROW(make_noise("ch-sd:beta=1")->with_parameters(Eigen::Vector2d(1, 1)), std::logic_error);
}

}  // namespace
}  // namespace pulson
