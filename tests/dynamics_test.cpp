// The Hamiltonian's gradients against automatic differentiation, and the contract of every noise model.

#include <algorithm>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include <Eigen/Core>
#include <ceres/jet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kernel_definition.hpp"
#include "pulson/dynamics/hamiltonian.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

// ---- the Hamiltonian

class HamiltonianContract : public testing::TestWithParam<std::tuple<DefinedKernel, int>> {
 protected:
  const DefinedKernel definition_ = std::get<0>(GetParam());
  const int d_ = std::get<1>(GetParam());
  const KernelOperator kernel_ = definition_.make();
};

INSTANTIATE_TEST_SUITE_P(Table, HamiltonianContract,
                         testing::Combine(testing::ValuesIn(every_kernel()), testing::Values(1, 2, 3)),
                         [](const auto& instance) {
                           return test_name(std::get<0>(instance.param).spec() + "_in_" +
                                            std::to_string(std::get<1>(instance.param)) + "d");
                         });

TEST_P(HamiltonianContract, HasTheGradientsOfItsDefinition) {
  constexpr int kCount = 5;
  using Jet = ceres::Jet<double, 2 * 3 * kCount>;
  const PhaseState state{random_points(d_, kCount, 1), random_points(d_, kCount, 2)};
  const int size = static_cast<int>(state.q.size());
  PointsOf<Jet> q(d_, kCount);
  PointsOf<Jet> p(d_, kCount);
  for (int i = 0; i < size; ++i) {
    q(i) = Jet(state.q(i), i);
    p(i) = Jet(state.p(i), size + i);
  }
  const Jet h = energy<Jet>(definition_, q, p);
  const Points h_q = hamiltonian_q(kernel_, state.q, state.p);
  const Points h_p = hamiltonian_p(kernel_, state.q, state.p);
  EXPECT_NEAR(hamiltonian(kernel_, state), h.a, 1e-14 * state.p.squaredNorm() * kernel_.at_zero());
  for (int i = 0; i < size; ++i) {
    EXPECT_NEAR(h_q(i), h.v[i], 1e-13 * h_q.norm());
    EXPECT_NEAR(h_p(i), h.v[size + i], 1e-13 * h_p.norm());
  }
}

TEST_P(HamiltonianContract, ContractionBoundOfTwoLandmarksIsTheirMomentumDifference) {
  const Points p = random_points(d_, 2, 1);
  const double expected = 0.05 * (p.col(0) - p.col(1)).norm() * kernel_.lipschitz();
  EXPECT_NEAR(contraction_bound(kernel_, p, 0.05), expected, 1e-15 * expected);
  EXPECT_EQ(contraction_bound(kernel_, p.leftCols(1), 0.05), 0);
}

// The largest change of a gap of dt K(q)p, over the largest change of a gap of q.
TEST_P(HamiltonianContract, ContractionBoundBoundsTheChangeOfGaps) {
  const double dt = 0.05;
  for (const int count : {2, 3, 8}) {
    const auto largest_gap = [count](const Points& x) {
      double largest = 0;
      for (Eigen::Index a = 0; a < count; ++a)
        largest = std::max(largest, (x.colwise() - x.col(a)).colwise().norm().maxCoeff());
      return largest;
    };
    for (unsigned seed = 0; seed < 50; ++seed) {
      const Points p = random_points(d_, count, 3 * seed);
      const Points q = random_points(d_, count, 3 * seed + 1);
      const Points r = q + (seed % 2 == 0 ? 1 : 1e-3) * random_points(d_, count, 3 * seed + 2);
      const Points change = dt * (hamiltonian_p(kernel_, r, p) - hamiltonian_p(kernel_, q, p));
      EXPECT_LE(largest_gap(change), contraction_bound(kernel_, p, dt) * largest_gap(r - q)) << count << ", " << seed;
    }
  }
}

// ---- noise models

constexpr int kLandmarks = 8;

// Every row of the table, with ½ for what must be given, and once more on a subset where the row knows `on=`.
std::vector<std::string> every_noise() {
  std::vector<std::string> specs;
  for (const auto& row : noise_table().rows()) {
    std::string spec = row.name;
    bool on = false;
    for (const ParameterInfo& parameter : row.parameters) {
      on = on || parameter.name == "on";
      if (parameter.default_text.empty()) spec += (spec == row.name ? ":" : ",") + parameter.name + "=0.5";
    }
    specs.push_back(spec);
    if (on) specs.push_back(spec + (spec == row.name ? ":" : ",") + "on=2/5/8");
  }
  return specs;
}

class NoiseContract : public testing::TestWithParam<std::tuple<std::string, int>> {
 protected:
  const int d_ = std::get<1>(GetParam());
  const std::shared_ptr<const NoiseModel> noise_ = make_noise(std::get<0>(GetParam()));
  const int channels_ = noise_->channels(d_, kLandmarks);
  const PhaseState state_{random_points(d_, kLandmarks, 1), random_points(d_, kLandmarks, 2)};

  Eigen::VectorXd random_increments(unsigned seed) const { return random_points(channels_, 1, seed).reshaped(); }
};

INSTANTIATE_TEST_SUITE_P(Table, NoiseContract,
                         testing::Combine(testing::ValuesIn(every_noise()), testing::Values(1, 2, 3)),
                         [](const auto& instance) {
                           return test_name(std::get<0>(instance.param) + "_in_" +
                                            std::to_string(std::get<1>(instance.param)) + "d");
                         });

TEST_P(NoiseContract, PositionNoiseIsLinear) {
  noise_->check(d_, kLandmarks);
  const Eigen::VectorXd v = random_increments(3);
  const Eigen::VectorXd w = random_increments(4);
  const Points of_v = noise_->position_noise(state_, v);
  const Points of_w = noise_->position_noise(state_, w);
  ASSERT_EQ(of_v.rows(), d_);
  ASSERT_EQ(of_v.cols(), kLandmarks);
  EXPECT_LE((noise_->position_noise(state_, 2 * v - 0.3 * w) - (2 * of_v - 0.3 * of_w)).norm(), 1e-14 * of_v.norm());
  EXPECT_EQ(noise_->position_noise(state_, 0 * v), Points::Zero(d_, kLandmarks));
}

TEST_P(NoiseContract, TransposeIsTheTranspose) {
  const Eigen::VectorXd w = random_increments(3);
  const Points q_bar = random_points(d_, kLandmarks, 4);
  const Eigen::VectorXd w_bar = noise_->position_noise_transposed(state_, q_bar);
  ASSERT_EQ(w_bar.size(), channels_);
  EXPECT_NEAR(noise_->position_noise(state_, w).cwiseProduct(q_bar).sum(), w_bar.dot(w), 1e-13);
}

TEST_P(NoiseContract, SpecMakesTheSameModel) {
  const std::shared_ptr<const NoiseModel> again = make_noise(noise_->spec());
  EXPECT_EQ(again->spec(), noise_->spec());
  ASSERT_EQ(again->channels(d_, kLandmarks), channels_);
  const Eigen::VectorXd w = random_increments(3);
  EXPECT_EQ(again->position_noise(state_, w), noise_->position_noise(state_, w));
  EXPECT_EQ(again->diffeomorphic(), noise_->diffeomorphic());
}

TEST(NoNoise, HasNoChannels) {
  const std::shared_ptr<const NoiseModel> none = make_noise("none");
  EXPECT_EQ(none->channels(3, kLandmarks), 0);
  EXPECT_TRUE(none->diffeomorphic());
}

TEST(ChSd, MovesEachChosenLandmarkByBetaTimesItsOwnIncrement) {
  const Points w = random_points(2, 3, 1);
  const PhaseState state{random_points(2, kLandmarks, 2), random_points(2, kLandmarks, 3)};
  Points expected = Points::Zero(2, kLandmarks);
  expected(Eigen::all, {1, 4, 7}) = 0.25 * w;
  const std::shared_ptr<const NoiseModel> noise = make_noise("ch-sd:beta=0.25,on=8/2/5");
  EXPECT_EQ(noise->position_noise(state, w.reshaped()), expected);
  EXPECT_EQ(noise->channels(2, kLandmarks), 6);
  EXPECT_EQ(noise->spec(), "ch-sd:beta=0.25,on=2/5/8");
  EXPECT_FALSE(noise->diffeomorphic());
  EXPECT_EQ(make_noise("ch-sd:beta=1")->channels(3, kLandmarks), 24);
}

TEST(ChSd, SpecKeepsEveryBitOfBeta) {
  const PhaseState state{Points::Zero(1, 1), Points::Zero(1, 1)};
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(1);
  for (const std::string beta : {"0.1", "0.30000000000000004", "1e-300", "12345678.9", "0.3333333333333333"}) {
    const std::shared_ptr<const NoiseModel> noise = make_noise("ch-sd:beta=" + beta);
    EXPECT_EQ(noise->position_noise(state, one)(0), std::stod(beta));
    EXPECT_EQ(make_noise(noise->spec())->position_noise(state, one)(0), std::stod(beta));
  }
}

TEST(ChSd, RefusesALandmarkBeyondTheLast) {
  const std::shared_ptr<const NoiseModel> noise = make_noise("ch-sd:beta=1,on=1/9");
  EXPECT_NO_THROW(noise->check(2, 9));
  EXPECT_THAT([&] { noise->check(2, 8); },
              ThrowsMessage<InputError>("noise 'ch-sd:beta=1,on=1/9': on=9 names a landmark beyond the last; "
                                        "the shape has 8"));
}

TEST(MakeNoise, SaysWhatIsWrong) {
  const auto make = [](const std::string& spec) { return [spec] { make_noise(spec); }; };
  const auto says = [](const std::string& text) { return ThrowsMessage<InputError>(HasSubstr(text)); };
  EXPECT_THAT(make("ch-sd"), says("noise 'ch-sd' needs beta (amplitude, length per square root of time), "
                                  "as in ch-sd:beta=1"));
  for (const std::string beta : {"0", "-1"})
    EXPECT_THAT(make("ch-sd:beta=" + beta), says("noise 'ch-sd': beta is " + beta + "; it must be greater than 0"));
  EXPECT_THAT(make("ch-sd:beta=nan"), says("noise 'ch-sd': beta is 'nan'"));
  for (const std::string on : {"0", "1.5", "-2"})
    EXPECT_THAT(make("ch-sd:beta=1,on=" + on),
                says("noise 'ch-sd': on is '" + on + "'; landmarks are counted from 1, as in 1/3/5"));
  EXPECT_THAT(make("ch-sd:beta=1,on=1/1"), says("noise 'ch-sd': on is '1/1'; it names a landmark twice"));
  EXPECT_THAT(make("ch-sd:beta=1,gamma=2"), says("noise 'ch-sd' has no parameter 'gamma'; it has: beta, on"));
  EXPECT_THAT(make("none:beta=1"), says("noise 'none' has no parameter 'beta'; it has: none"));
  EXPECT_THAT(make("none+ch-sd:beta=1"),
              says("noise 'none+ch-sd:beta=1': sums of noise models are not supported; give one model"));
  for (const auto& row : noise_table().rows())
    EXPECT_THAT(make("no-such"),
                ThrowsMessage<InputError>(AllOf(HasSubstr("unknown noise 'no-such'"), HasSubstr(row.name))));
}

}  // namespace
}  // namespace pulson
