// Your own noise models and kernels, as objects in the options: what they are for the library's own names.

#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "plain_options.hpp"
#include "pulson/compare/comparison.hpp"
#include "pulson/inference/fit_parameters.hpp"
#include "pulson/records/records.hpp"
#include "temporary_folder.hpp"

namespace pulson {

NoiseTable::Row linear();  // adding_a_noise_model.cpp

}  // namespace pulson

namespace pulson::records {
namespace {

Landmarks ring(double stretch) {
  Landmarks shape;
  shape.points = Points(2, 6);
  for (int a = 0; a < 6; ++a) shape.points.col(a) << stretch * std::cos(a), std::sin(a) / stretch;
  return shape;
}

class OwnModels : public InTemporaryFolder {
 protected:
  matching::Registration registered(const NoiseChoice& noise, const KernelChoice& kernel = "gaussian:alpha=1") const {
    matching::RegistrationOptions options = plain_options();
    options.kernel = kernel;
    options.noise = noise;
    return register_shapes(source_, target_, options);
  }

  const Landmarks source_ = ring(1), target_ = ring(1.2);
  const std::shared_ptr<const NoiseTable> table_ = std::make_shared<const NoiseTable>(noise_table().with(linear()));
  const NoiseChoice by_name_{"linear:beta=0.5", table_};
  const NoiseChoice as_model_{by_name_.make(source_)};
};

TEST_F(OwnModels, RegisterAndReplayLikeThoseOfTheLibrary) {
  const matching::Registration named = registered(by_name_);
  ASSERT_TRUE(named.converged);
  EXPECT_EQ(named.noise, "linear:beta=0.5");
  EXPECT_GT(named.cost.action, 0);
  EXPECT_EQ(replay(named).final().q, named.result);
  const matching::Registration model = registered(as_model_);
  EXPECT_EQ(model.result, named.result);
  EXPECT_EQ(replay(model).final().q, model.result);
  EXPECT_THROW(registered("linear:beta=0.5"), InputError);
}

TEST_F(OwnModels, OfTheLibraryAreTheSameByNameAndAsObjects) {
  const KernelOperator kernel = make_kernel("gaussian:alpha=0.7+matern32:alpha=0.3,weight=0.5");
  const matching::Registration named = registered("ch-sd:beta=0.3", kernel.spec());
  const matching::Registration objects = registered(make_noise("ch-sd:beta=0.3"), kernel);
  EXPECT_EQ(objects.momenta, named.momenta);
  EXPECT_EQ(objects.kernel, named.kernel);
  EXPECT_EQ(objects.noise, named.noise);
}

TEST_F(OwnModels, AreReadFromRecordsByTheTableThatHasThem) {
  const matching::Registration registration = registered(by_name_);
  write("own.json", registration_json(registration, {}));
  EXPECT_THROW(read_registration("own.json"), InputError);
  EXPECT_EQ(replay(read_registration("own.json", table_.get())).final().q, registration.result);
}

TEST_F(OwnModels, HaveNumbersThatAreFitted) {
  matching::RegistrationOptions options = plain_options();
  options.kernel = "gaussian:alpha=1";
  options.mode = matching::MatchingMode::kMap;
  for (const NoiseChoice& noise : {by_name_, as_model_}) {
    options.noise = noise;
    const inference::FittedParameters fitted =
        inference::fit_parameters(source_, {target_}, options, {.names = {"beta"}, .max_evaluations = 8});
    EXPECT_GT(fitted.values[0], 0);
    EXPECT_TRUE(fitted.noise.starts_with("linear:beta=")) << fitted.noise;
  }
}

TEST_F(OwnModels, AreCompared) {
  compare::CompareOptions options;
  options.settings.kernel = make_kernel("gaussian:alpha=1");
  options.settings.grid = {1, 5};
  options.settings.importance_samples = 0;
  options.forward_samples = 20;
  options.folds = 0;
  const compare::CohortShapes shapes{source_, {target_, ring(1.1), ring(0.9)}};
  const compare::Comparison comparison =
      compare_models(shapes, {"none", NoiseChoice("linear", table_), as_model_}, options);
  EXPECT_EQ(comparison.models[0].fit.own_noise, nullptr);
  ASSERT_NE(comparison.models[1].fit.own_noise, nullptr);
  EXPECT_EQ(comparison.models[1].fit.own_noise->spec(), comparison.models[1].fit.noise);
  EXPECT_EQ(comparison.models[2].noise, "linear:beta=0.5");
  EXPECT_EQ(comparison.models[2].fit.noise, "linear:beta=0.5");
  for (const compare::FittedNumber& number : comparison.models[2].fit.fitted) EXPECT_EQ(number.name, "lambda");

  compare::RecoveryOptions study{.settings = options.settings, .cohorts = 1, .shapes = 3};
  const auto rows = study_recovery(source_, {{as_model_, 50}}, {"none", as_model_}, study);
  EXPECT_EQ(rows.front().chosen[0] + rows.front().chosen[1] + rows.front().unfit, 1);
}

// The same shapes in another unit: nothing in the defaults may tell.
TEST_F(OwnModels, AreComparedWithDefaultsThatHaveNoUnit) {
  const auto compared = [](double unit) {
    Landmarks source = ring(1), target = ring(1.2);
    source.points *= unit;
    target.points *= unit;
    compare::CompareOptions options;
    options.settings.importance_samples = 0;
    options.forward_samples = 20;
    return compare_models({source, {target}}, {"none"}, options);
  };
  const compare::Comparison one = compared(1), other = compared(1024);
  EXPECT_DOUBLE_EQ(one.settings.sigma.in(0), 0.01 * diameter(ring(1).points));
  EXPECT_NEAR(other.models[0].rms.value / 1024, one.models[0].rms.value, 1e-6);
  EXPECT_NEAR(other.models[0].fit.lambda * 1024 * 1024, one.models[0].fit.lambda, 1e-4 * one.models[0].fit.lambda);
}

}  // namespace
}  // namespace pulson::records
