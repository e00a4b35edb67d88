// What noise models say of themselves, and models of your own.

#include <cmath>
#include <fstream>
#include <iterator>
#include <memory>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "noise_contract.hpp"
#include "numbers.hpp"

namespace pulson {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// ---- what it says of itself

// A model that does not declare its displacement does not compile.
static_assert(!std::is_default_constructible_v<Displacement>);
static_assert(!std::is_default_constructible_v<NoiseTraits>);

TEST_P(NoiseContract, TraitsAreTrueBothWays) {
  in_each_dimension([](const Subject& s) {
    const PhaseState h = s.gradient(s.state);
    EXPECT_EQ(h.p.norm() > 0, s.traits.moves_positions());
    EXPECT_EQ(h.q.norm() > 0, s.traits.moves_momenta);
    EXPECT_EQ(norm(s.gradient(s.change) - h) == 0, s.traits.additive);

    double largest = 0;
    for (int i = 0; i < s.channels; ++i) {
      const PhaseState of_i = s.noise->gradient(s.state, Eigen::VectorXd::Unit(s.channels, i));
      largest = std::max(largest, std::abs(of_i.q.cwiseProduct(of_i.p).sum()));
    }
    EXPECT_EQ(largest > 0, s.traits.compensated);
    EXPECT_EQ(norm(s.noise->compensation_gradient(s.state)) > 0, s.traits.compensated);

    const Points shift = random_points(s.d, 1, 9).replicate(1, kCount);
    const Eigen::VectorXd there = s.noise->potentials({s.state.q + shift, s.state.p});
    EXPECT_EQ((there - s.noise->potentials(s.state)).norm() <= 1e-13 * there.norm(), s.traits.translation_invariant);
  });
}

// Which channels are scaled by c^power as θ_j is multiplied by c, from the potentials alone: `power` is that of the
// ratio at one c, and must be that at another.
std::vector<int> channels_scaled(const Subject& s, Eigen::Index j, double power) {
  const auto multiplied = [&](double c) {
    Eigen::VectorXd theta = s.noise->parameters();
    theta[j] *= c;
    return s.noise->with_parameters(theta)->potentials(s.state);
  };
  const Eigen::VectorXd h = s.noise->potentials(s.state), twice = multiplied(2), third = multiplied(1.0 / 3);
  std::vector<int> scaled;
  for (int i = 0; i < s.channels; ++i) {
    const bool is_scaled = std::abs(twice[i] - std::pow(2, power) * h[i]) <= 1e-13 * std::abs(twice[i]) &&
                           std::abs(third[i] - std::pow(3, -power) * h[i]) <= 1e-13 * std::abs(third[i]);
    if (is_scaled && twice[i] != h[i]) scaled.push_back(i);
  }
  return scaled;
}

TEST_P(NoiseContract, ListsWhichChannelsEachNumberScales) {
  in_each_dimension([](const Subject& s) {
    std::vector<std::vector<int>> declared(s.noise->parameters().size());
    std::vector<double> powers(declared.size(), 1);
    std::vector<int> all;
    for (const NoiseAmplitude& amplitude : s.noise->amplitudes(s.d, kCount)) {
      declared.at(amplitude.parameter) = amplitude.channels;
      powers.at(amplitude.parameter) = amplitude.power;
      all.insert(all.end(), amplitude.channels.begin(), amplitude.channels.end());
    }
    EXPECT_EQ(std::set(all.begin(), all.end()).size(), all.size());
    for (std::size_t j = 0; j < declared.size(); ++j) {
      EXPECT_EQ(channels_scaled(s, static_cast<Eigen::Index>(j), powers[j]), declared[j]);
      if (declared[j].empty()) continue;
      Eigen::VectorXd theta = s.noise->parameters();
      theta[static_cast<Eigen::Index>(j)] *= 2;
      Eigen::VectorXd unchanged = s.noise->with_parameters(theta)->potentials(s.state) - s.noise->potentials(s.state);
      for (const int i : declared[j]) unchanged[i] = 0;
      EXPECT_TRUE(unchanged.isZero(0));
    }
  });
}

TEST_P(NoiseContract, LandmarksSeeEachOtherWhereItIsNotLocal) {
  in_each_dimension([](const Subject& s) {
    PhaseState of_first = 0 * s.change;
    of_first.q.col(0) = s.change.q.col(0);
    of_first.p.col(0) = s.change.p.col(0);
    const auto elsewhere = [](const PhaseState& x) {
      return x.q.rightCols(kCount - 1).norm() + x.p.rightCols(kCount - 1).norm();
    };
    EXPECT_EQ(elsewhere(s.noise->hessian(s.state, s.w, of_first)) == 0, s.traits.local);
    EXPECT_TRUE(!s.traits.local || elsewhere(s.noise->compensation_hessian(s.state, of_first)) == 0);
  });
}

// Landmarks can pass each other where noise gives them different velocities in one place.
TEST_P(NoiseContract, KeepsLandmarksTogetherWhereItIsDiffeomorphic) {
  in_each_dimension([](const Subject& s) {
    double apart = 0;
    for (int a = 0; a < kCount; ++a) {
      PhaseState state = s.state;
      state.q.col(a) = state.q.col((a + 1) % kCount);
      const Points velocity = s.gradient(state).p;
      apart = std::max(apart, (velocity.col(a) - velocity.col((a + 1) % kCount)).norm());
    }
    EXPECT_EQ(apart < 1e-14, s.traits.diffeomorphic);
  });
}

TEST_P(NoiseContract, SpecMakesTheSameModelToTheLastBit) {
  in_each_dimension([](const Subject& s) {
    const Eigen::VectorXd thirds = s.noise->parameters() / 3;
    for (const auto& noise : {s.noise, s.noise->with_parameters(thirds)}) {
      const std::shared_ptr<const NoiseModel> again = make(noise->spec(), s.shape);
      EXPECT_EQ(again->spec(), noise->spec());
      EXPECT_EQ(again->parameters(), noise->parameters());
      ASSERT_EQ(again->channels(s.d, kCount), s.channels);
      EXPECT_EQ(again->potentials(s.state), noise->potentials(s.state));
      EXPECT_EQ(again->gradient(s.state, s.w).q, noise->gradient(s.state, s.w).q);
      EXPECT_EQ(again->gradient(s.state, s.w).p, noise->gradient(s.state, s.w).p);
      EXPECT_EQ(again->compensation_gradient(s.state).q, noise->compensation_gradient(s.state).q);
      EXPECT_EQ(again->friction(), noise->friction());
    }
  });
}

TEST_P(NoiseContract, TakesOtherParameters) {
  in_each_dimension([](const Subject& s) {
    const Eigen::VectorXd theta = s.noise->parameters();
    const std::vector<std::string> names = s.noise->parameter_names();
    EXPECT_THAT(s.definition.theta(), testing::Pointwise(testing::DoubleNear(1e-15), theta));
    EXPECT_EQ(std::ssize(names), theta.size());
    EXPECT_EQ(std::set(names.begin(), names.end()).size(), names.size());
    for (Eigen::Index i = 0; i < theta.size(); ++i) EXPECT_THAT(names[i], testing::EndsWith(s.definition.names()[i]));

    const Eigen::VectorXd other = theta.cwiseProduct(Eigen::VectorXd::LinSpaced(theta.size(), 1.1, 1.9));
    const std::shared_ptr<const NoiseModel> changed = s.noise->with_parameters(other);
    EXPECT_EQ(changed->parameters(), other);
    const DefinedNoise right(changed->spec(), s.shape);
    expect_close(changed->gradient(s.state, s.w), right.gradient(s.state, s.w));
    EXPECT_NEAR(changed->friction(), right.friction(), 1e-15);
  });
}

TEST_P(NoiseContract, RefusesParametersOutOfRange) {
  in_each_dimension([](const Subject& s) {
    const std::vector<std::string> names = s.definition.names();
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto set = [&](double value) {
        Eigen::VectorXd theta = s.noise->parameters();
        theta[i] = value;
        return [&s, theta] { s.noise->with_parameters(theta); };
      };
      for (const double bad : {-1.0, kNaN, kInfinity})
        EXPECT_THAT(set(bad), ThrowsMessage<InputError>(HasSubstr(names[i] + " must be a finite number")));
      if (names[i] == "friction")
        EXPECT_NO_THROW(set(0)());
      else
        EXPECT_THAT(set(0), ThrowsMessage<InputError>(HasSubstr(names[i] + " must be a finite number greater than 0")));
    }
  });
}

// ---- your own models

TEST(OwnNoise, IsKnownByTheTableThatHasIt) {
  const auto own = std::make_shared<const NoiseTable>(noise_table().with(linear()));
  const std::string spec = "linear:beta=0.25+ch-sd:beta=2";
  EXPECT_EQ(make_noise(spec, {}, *own)->spec(), spec);
  EXPECT_EQ(NoiseChoice(spec, own).make({})->spec(), spec);
  EXPECT_THROW(make_noise(spec), InputError);
  EXPECT_THAT([&] { own->with(linear()); }, ThrowsMessage<InputError>("there is a noise 'linear' already"));
}

TEST(OwnNoise, MayBeChosenAsAModel) {
  const std::shared_ptr<const NoiseModel> model = make("linear:beta=0.25", {});
  const NoiseChoice choice(model);
  EXPECT_EQ(choice.make({}), model);
  EXPECT_EQ(choice.spec(), "linear:beta=0.25");
  EXPECT_TRUE(choice.is_own());
  EXPECT_FALSE(NoiseChoice("ch-sd:beta=2").is_own());
  EXPECT_THROW(NoiseChoice(std::shared_ptr<const NoiseModel>()), InputError);
}

// ---- the documentation

std::string contents(const std::string& file) {
  std::ifstream stream(PULSON_SOURCE_DIR "/" + file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(AddingANoiseModel, ShowsTheExampleThatIsTestedHere) {
  const std::string example = contents("tests/noise/adding_a_noise_model.cpp");
  ASSERT_FALSE(example.empty());
  EXPECT_THAT(contents("docs/adding_a_noise_model.md"), HasSubstr("```cpp\n" + example + "```\n"));
}

}  // namespace
}  // namespace pulson
