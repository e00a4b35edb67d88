// Sums of noise models: channels and parameters of the terms one after the other.

#include <array>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "noise_examples.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

class SumOfThree : public testing::Test {
 protected:
  static constexpr int kDimension = 2;
  const Landmarks shape_ = make_shape(kDimension);
  const std::vector<std::string> specs_{"ch-sd:beta=0.5,on=2", "p-sd:beta=0.4,fields=cos,wavenumber=2",
                                        "langevin:sigma=0.3,friction=0.6"};
  const std::shared_ptr<const NoiseModel> sum_ = make_noise(specs_[0] + "+" + specs_[1] + "+" + specs_[2], shape_);
  std::vector<std::shared_ptr<const NoiseModel>> terms_;
  const PhaseState state_ = random_state(kDimension, 1);
  const PhaseState change_ = random_state(kDimension, 3);

  void SetUp() override {
    for (const std::string& spec : specs_) terms_.push_back(make_noise(spec, shape_));
  }
};

TEST_F(SumOfThree, HasTheChannelsOfItsTermsOneAfterTheOther) {
  ASSERT_EQ(sum_->channels(kDimension, kCount), 2 + 4 + 10);
  Eigen::VectorXd potentials(16);
  potentials << terms_[0]->potentials(state_), terms_[1]->potentials(state_), terms_[2]->potentials(state_);
  EXPECT_EQ(sum_->potentials(state_), potentials);
  Eigen::VectorXd contracted(16);
  contracted << terms_[0]->contract(state_, change_), terms_[1]->contract(state_, change_),
      terms_[2]->contract(state_, change_);
  EXPECT_EQ(sum_->contract(state_, change_), contracted);
}

TEST_F(SumOfThree, AddsWhatItsTermsDo) {
  const Eigen::VectorXd w = random_vector(16, 5);
  const std::array<Eigen::VectorXd, 3> parts{w.head(2), w.segment(2, 4), w.tail(10)};
  PhaseState gradient = 0 * state_;
  PhaseState hessian = 0 * state_;
  for (int i = 0; i < 3; ++i) {
    gradient = gradient + terms_[i]->gradient(state_, parts[i]);
    hessian = hessian + terms_[i]->hessian(state_, parts[i], change_);
  }
  expect_close(sum_->gradient(state_, w), gradient, 1e-15);
  expect_close(sum_->hessian(state_, w, change_), hessian, 1e-15);
  expect_close(sum_->compensation_gradient(state_), terms_[1]->compensation_gradient(state_), 1e-15);
  EXPECT_EQ(sum_->spatial_noise(change_.q, state_, w), terms_[1]->spatial_noise(change_.q, state_, parts[1]));
  EXPECT_EQ(sum_->friction(), 0.6);
}

TEST_F(SumOfThree, HasTheParametersOfItsTermsOneAfterTheOther) {
  EXPECT_THAT(sum_->parameters(), ElementsAre(0.5, 0.4, 2, 0.3, 0.6));
  EXPECT_THAT(sum_->parameter_names(),
              ElementsAre("ch-sd.beta", "p-sd.beta", "p-sd.wavenumber", "langevin.sigma", "langevin.friction"));
  EXPECT_EQ(sum_->spec(), specs_[0] + "+" + specs_[1] + "+" + specs_[2]);
}

TEST_F(SumOfThree, SaysWhichTermCannotActOnAShape) {
  EXPECT_THAT([this] { sum_->check(kDimension, 1); }, ThrowsMessage<InputError>(HasSubstr("'ch-sd:beta=0.5,on=2'")));
}

TEST(Sum, NumbersTermsOfOneName) {
  EXPECT_THAT(make_noise("ch-sd:beta=1,on=1+none+ch-sd:beta=2,on=2")->parameter_names(),
              ElementsAre("ch-sd.beta", "ch-sd#2.beta"));
}

}  // namespace
}  // namespace pulson
