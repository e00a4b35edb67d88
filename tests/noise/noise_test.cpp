// The contract of every noise model: each row of noise_table(), variants and sums of them, and the example of
// docs/adding_a_noise_model.md, in one, two and three dimensions.

#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "noise_definition.hpp"
#include "noise_examples.hpp"
#include "numbers.hpp"
#include "pulson/dynamics/stochastic_system.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson {

NoiseTable::Row linear();  // adding_a_noise_model.cpp

namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

struct NoiseCase {
  std::string spec;
  bool grouped = false;
};

std::ostream& operator<<(std::ostream& out, const NoiseCase& c) {
  return out << c.spec << (c.grouped ? " of groups" : "");
}

// Every row with numbers for what must be given, alone and with `on` and `common` where it knows them; then their sum.
std::vector<std::string> rows_and_their_sum() {
  std::vector<std::string> specs;
  std::string sum;
  for (const auto& row : noise_table().rows()) {
    std::string text;
    std::vector<std::string> choices{""};
    for (const ParameterInfo& parameter : row.parameters) {
      if (parameter.default_text.empty()) text += "," + parameter.name + (text.empty() ? "=0.7" : "=0.9");
      if (parameter.name != "on" && parameter.name != "common") continue;
      const std::string choice = parameter.name == "on" ? ",on=1/3/5" : ",common=1";
      for (std::size_t i = choices.size(); i-- > 0;) choices.push_back(choices[i] + choice);
    }
    for (const std::string& choice : choices) {
      std::string all = text + choice;
      if (!all.empty()) all.front() = ':';
      specs.push_back(row.name + all);
    }
    sum += (sum.empty() ? "" : "+") + specs.back();
  }
  specs.push_back(sum);
  return specs;
}

std::vector<NoiseCase> cases() {
  std::vector<NoiseCase> all;
  for (const std::string& spec : rows_and_their_sum()) all.push_back({spec});
  for (const std::string fields : {"grid,count=3", "grid,count=2,width=0.8", "bump,center=CENTRES",
                                   "bump,center=CENTRES,width=0.7", "cos", "cos,wavenumber=2.5"})
    all.push_back({"p-sd:beta=0.6,fields=" + fields});
  all.push_back({"ch-sd-screened:beta=0.7,gamma=0.9", true});
  all.push_back({"ch-sd-screened:beta=0.7,gamma=0.9,on=2/3+trouve-vialard:sigma=0.5", true});
  all.push_back({"ch-sd:beta=0.5,on=1+ch-sd:beta=0.8,on=2/3"});
  all.push_back({"langevin:sigma=0.4,friction=0.6+p-sd:beta=0.3,fields=cos+potential:beta=1,gamma=0.5"});
  all.push_back({"none+p-sd:beta=0.3,fields=grid,count=2+p-sd:beta=0.7"});
  all.push_back({"linear:beta=0.7"});
  return all;
}

// Two centres in place of CENTRES.
std::string in_dimension(std::string spec, int d) {
  const std::string name = "CENTRES";
  if (const std::size_t at = spec.find(name); at != std::string::npos)
    spec.replace(at, name.size(), std::array{"0.3/-0.4", "0.3/-0.4/0.1/0.5", "0.3/-0.4/0/0.1/0.5/-0.2"}[d - 1]);
  return spec;
}

std::shared_ptr<const NoiseModel> make(const std::string& spec, const Landmarks& shape) {
  if (!spec.starts_with("linear")) return make_noise(spec, shape);
  const NoiseTable table("noise", {linear()});
  const auto terms = table.parse(spec);
  return terms.front().first->make(terms.front().second, shape);
}

using Field = std::function<PhaseState(const PhaseState&)>;

// The derivative of `field` along `change` by central differences of order 8.
PhaseState differences(const Field& field, const PhaseState& at, const PhaseState& change) {
  constexpr double kStep = 5e-3;
  constexpr std::array<double, 4> kWeights{4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
  PhaseState sum = 0 * at;
  for (int i = 0; i < 4; ++i) {
    const PhaseState shift = (i + 1) * kStep * change;
    sum = sum + kWeights[i] / kStep * (field(at + shift) - field(at - shift));
  }
  return sum;
}

// |A − Aᵀ|/|A| of the matrix A with the columns of `column`.
double asymmetry(int d, const std::function<PhaseState(const PhaseState&)>& column) {
  Eigen::MatrixXd a(2 * d * kCount, 2 * d * kCount);
  for (Eigen::Index m = 0; m < a.cols(); ++m) {
    const PhaseState along = column(unit_state(d, m));
    a.col(m) << along.q.reshaped(), along.p.reshaped();
  }
  return a.norm() > 0 ? (a - a.transpose()).norm() / a.norm() : 0;
}

// How far the field X = (q̇, ṗ) is from Hamiltonian: the asymmetry of J·DX, where J(q̇, ṗ) = (ṗ, −q̇).
double hamiltonian_defect(const Field& field, const PhaseState& at) {
  return asymmetry(static_cast<int>(at.q.rows()), [&](const PhaseState& change) -> PhaseState {
    const PhaseState x = differences(field, at, change);
    return {x.p, -x.q};
  });
}

// A case in one dimension, with a state and what else its tests need.
struct Subject {
  Subject(const NoiseCase& c, int dimension)
      : d(dimension), spec(in_dimension(c.spec, d)), shape(make_shape(d, c.grouped)) {}

  PhaseState gradient(const PhaseState& at) const { return noise->gradient(at, w); }
  // X = J∇h_w
  PhaseState noise_field(const PhaseState& at) const {
    const PhaseState h = gradient(at);
    return {h.p, -1 * h.q};
  }

  int d;
  std::string spec;
  Landmarks shape;
  std::shared_ptr<const NoiseModel> noise = make(spec, shape);
  DefinedNoise definition{spec, shape};
  NoiseTraits traits = noise->traits();
  int channels = noise->channels(d, kCount);
  PhaseState state = random_state(d, 1);
  PhaseState change = random_state(d, 3);
  Eigen::VectorXd w = random_vector(channels, 5);
};

class NoiseContract : public testing::TestWithParam<NoiseCase> {
 protected:
  template <class Test>
  void in_each_dimension(const Test& test) const {
    for (int d = 1; d <= 3; ++d) {
      SCOPED_TRACE("in " + std::to_string(d) + "D");
      test(Subject(GetParam(), d));
    }
  }
};

INSTANTIATE_TEST_SUITE_P(Table, NoiseContract, testing::ValuesIn(cases()), [](const auto& instance) {
  const NoiseCase& c = instance.param;
  return test_name(c.spec + (c.grouped ? "_of_groups" : ""));
});

// ---- values and derivatives against the definition

TEST_P(NoiseContract, IsLinearInTheMomentaWhereItSaysSo) {
  in_each_dimension([](const Subject& s) {
    const Eigen::VectorXd at_rest = s.noise->potentials({s.state.q, Points::Zero(s.d, kCount)});
    EXPECT_EQ(s.traits.linear, at_rest.isZero(0));
  });
}

TEST_P(NoiseContract, HasThePotentialsOfItsDefinition) {
  in_each_dimension([](const Subject& s) {
    s.noise->check(s.d, kCount);
    const Eigen::VectorXd right = s.definition.potentials(s.state);
    const Eigen::VectorXd found = s.noise->potentials(s.state);
    ASSERT_EQ(right.size(), s.channels);
    ASSERT_EQ(found.size(), s.channels);
    EXPECT_LE((found - right).norm(), 1e-13 * right.norm());
    EXPECT_NEAR(s.noise->friction(), s.definition.friction(), 1e-15);
  });
}

TEST_P(NoiseContract, HasTheDerivativesOfItsDefinition) {
  in_each_dimension([](const Subject& s) {
    expect_close(s.gradient(s.state), s.definition.gradient(s.state, s.w));
    expect_close(s.noise->hessian(s.state, s.w, s.change), s.definition.hessian(s.state, s.w, s.change));
  });
}

TEST_P(NoiseContract, ContractIsTheTransposeOfTheGradient) {
  in_each_dimension([](const Subject& s) {
    const Eigen::VectorXd contracted = s.noise->contract(s.state, s.change);
    ASSERT_EQ(contracted.size(), s.channels);
    for (int i = 0; i < s.channels; ++i)
      EXPECT_NEAR(contracted[i], dot(s.noise->gradient(s.state, Eigen::VectorXd::Unit(s.channels, i)), s.change),
                  1e-13 * contracted.norm());
  });
}

TEST_P(NoiseContract, CompensatesByAQuarterOfTheProducts) {
  in_each_dimension([](const Subject& s) {
    expect_close(s.noise->compensation_gradient(s.state), s.definition.compensation_gradient(s.state));
    expect_close(s.noise->compensation_hessian(s.state, s.change),
                 s.definition.compensation_hessian(s.state, s.change));
  });
}

TEST_P(NoiseContract, HasTheDerivativesByParametersOfItsDefinition) {
  in_each_dimension([](const Subject& s) {
    const Eigen::VectorXd along = random_vector(s.noise->parameters().size(), 7);
    expect_close(s.noise->gradient_by_parameters(s.state, s.w, along),
                 s.definition.gradient_by_parameters(s.state, s.w, along));
    expect_close(s.noise->compensation_by_parameters(s.state, along),
                 s.definition.compensation_by_parameters(s.state, along));
    EXPECT_NEAR(s.noise->friction_by_parameters(along), s.definition.friction_by_parameters(along), 1e-15);
  });
}

TEST_P(NoiseContract, KnowsItsFieldsOverSpaceEverywhere) {
  in_each_dimension([](const Subject& s) {
    const PhaseState right = s.definition.gradient(s.state, s.w, true);
    const PhaseState right_compensation = s.definition.compensation_gradient(s.state, true);
    EXPECT_LE((s.noise->spatial_noise(s.state.q, s.w, kCount) - right.p).norm(), 1e-12 * right.p.norm());
    EXPECT_LE((s.noise->spatial_compensation(s.state.q) - right_compensation.p).norm(),
              1e-12 * right_compensation.p.norm());
    Points more(s.d, 2 * kCount);
    more << s.change.q, s.state.q;
    EXPECT_EQ(s.noise->spatial_noise(more, s.w, kCount).rightCols(kCount),
              s.noise->spatial_noise(s.state.q, s.w, kCount));
    EXPECT_EQ(s.noise->spatial_compensation(more).rightCols(kCount), s.noise->spatial_compensation(s.state.q));
  });
}

TEST_P(NoiseContract, KnowsTheChangesOfItsFieldsOverSpace) {
  in_each_dimension([](const Subject& s) {
    const Points places = random_points(s.d, 2 * kCount, 21);
    const Points change = random_points(s.d, 2 * kCount, 22);
    const auto difference = [&](const std::function<Points(const Points&)>& field) -> Points {
      const double h = 1e-3;
      const auto around = [&](double step) -> Points {
        return field(places + step * change) - field(places - step * change);
      };
      return (8 * around(h) - around(2 * h)) / (12 * h);
    };
    const Points noise = difference([&](const Points& x) { return s.noise->spatial_noise(x, s.w, kCount); });
    const Points compensation = difference([&](const Points& x) { return s.noise->spatial_compensation(x); });
    EXPECT_LE((s.noise->spatial_noise_change(places, s.w, kCount, change) - noise).norm(), 1e-8 * (1 + noise.norm()));
    EXPECT_LE((s.noise->spatial_compensation_change(places, change) - compensation).norm(),
              1e-8 * (1 + compensation.norm()));
  });
}

// ---- structure

TEST_P(NoiseContract, IsAffineInTheMomenta) {
  in_each_dimension([](const Subject& s) {
    const PhaseState step{Points::Zero(s.d, kCount), s.change.p};
    const Eigen::VectorXd h = s.noise->potentials(s.state);
    const Eigen::VectorXd around = s.noise->potentials(s.state + step) + s.noise->potentials(s.state - step);
    EXPECT_LE((around - 2 * h).norm(), 1e-14 * h.norm());
    const PhaseState g = s.noise->compensation_gradient(s.state);
    const PhaseState g_around =
        s.noise->compensation_gradient(s.state + step) + s.noise->compensation_gradient(s.state - step);
    EXPECT_LE(norm(g_around - 2 * g), 1e-14 * norm(g));
  });
}

TEST_P(NoiseContract, HessianIsTheDerivativeOfTheGradient) {
  in_each_dimension([](const Subject& s) {
    const Field gradient = [&](const PhaseState& x) { return s.gradient(x); };
    expect_close(s.noise->hessian(s.state, s.w, s.change), differences(gradient, s.state, s.change), 1e-10);
    const Field compensation = [&](const PhaseState& x) { return s.noise->compensation_gradient(x); };
    expect_close(s.noise->compensation_hessian(s.state, s.change), differences(compensation, s.state, s.change), 1e-10);
  });
}

TEST_P(NoiseContract, HessiansAreSymmetric) {
  in_each_dimension([](const Subject& s) {
    EXPECT_LE(asymmetry(s.d, [&](const PhaseState& e) { return s.noise->hessian(s.state, s.w, e); }), 1e-14);
    EXPECT_LE(asymmetry(s.d, [&](const PhaseState& e) { return s.noise->compensation_hessian(s.state, e); }), 1e-14);
  });
}

TEST_P(NoiseContract, FieldsAreHamiltonianWhereTheySaySo) {
  in_each_dimension([](const Subject& s) {
    EXPECT_LE(hamiltonian_defect([&](const PhaseState& x) { return s.noise_field(x); }, s.state), 1e-11);
    const KernelOperator kernel = make_kernel("gaussian:alpha=0.8", s.shape.points);
    const Field all = [&](const PhaseState& x) -> PhaseState {
      const Points velocity = hamiltonian_p(kernel, x.q, x.p);
      const Points force = -hamiltonian_q(kernel, x.q, x.p) - s.noise->friction() * velocity;
      return s.noise_field(x) + PhaseState{velocity, force};
    };
    EXPECT_EQ(hamiltonian_defect(all, s.state) <= 1e-11, s.traits.hamiltonian);
    EXPECT_EQ(s.noise->friction() == 0, s.traits.hamiltonian);
  });
}

// ---- what it says of itself

TEST_P(NoiseContract, TraitsAreTrueBothWays) {
  in_each_dimension([](const Subject& s) {
    const PhaseState h = s.gradient(s.state);
    EXPECT_EQ(h.p.norm() > 0, s.traits.moves_positions);
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
    EXPECT_EQ(apart == 0, s.traits.diffeomorphic);
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

// ---- the checks themselves

TEST(NoiseDefinition, RefusesARowThatItDoesNotKnow) {
  EXPECT_THROW(DefinedNoise("no-such:beta=1", make_shape(2)), std::logic_error);
}

// −(∇ξ)ᵀp without its cross terms, ∂_jξ_j p_j alone, is right on the line and wrong elsewhere.
TEST(HamiltonianDefect, SeesMissingCrossTerms) {
  for (int d = 1; d <= 3; ++d) {
    const std::shared_ptr<const NoiseModel> noise = make("p-sd:beta=1,fields=grid,count=2,width=0.8", make_shape(d));
    const Eigen::VectorXd w = random_vector(noise->channels(d, kCount), 5);
    const Field without_cross_terms = [&](const PhaseState& x) -> PhaseState {
      const Points velocity = noise->gradient(x, w).p;
      Points force(d, kCount);
      for (int m = 0; m < d * kCount; ++m) force(m) = -noise->hessian(x, w, unit_state(d, m)).p(m) * x.p(m);
      return {velocity, force};
    };
    const double defect = hamiltonian_defect(without_cross_terms, random_state(d, 1));
    if (d == 1)
      EXPECT_LE(defect, 1e-11);
    else
      EXPECT_GE(defect, 0.1);
  }
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
