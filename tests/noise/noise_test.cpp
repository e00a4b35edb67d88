// The contract of every noise model: potentials and derivatives, and their structure.

#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "noise_contract.hpp"

namespace pulson {
namespace {

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

TEST_P(NoiseContract, MovesPositionsAtRestAsItsDerivativesSay) {
  in_each_dimension([](const Subject& s) {
    if (!s.traits.linear) return;
    const PhaseState rest{s.state.q, Points::Zero(s.d, kCount)};
    RestFields fields;
    s.noise->rest_fields(rest.q, s.w, fields);
    const Points velocity = s.noise->gradient(rest, s.w).p;
    const double tolerance = 1e-13 * (1 + velocity.norm());
    EXPECT_LE((s.noise->rest_velocity(rest.q, s.w) - velocity).norm(), tolerance);
    EXPECT_LE((fields.velocity(s.d, s.w) - velocity).norm(), tolerance);
    const Points changed = s.noise->hessian(rest, s.w, {s.change.q, Points::Zero(s.d, kCount)}).p;
    EXPECT_LE((fields.slope * s.change.q.reshaped() - changed.reshaped()).norm(), 1e-13 * (1 + changed.norm()));
    Eigen::MatrixXd by_w = Eigen::MatrixXd::Ones(2, s.channels);
    Eigen::MatrixXd rows(2, s.change.p.size());
    rows << s.change.p.reshaped().transpose(), s.change.q.reshaped().transpose();
    fields.add_rows(rows, by_w);
    const Points zero = Points::Zero(s.d, kCount);
    for (const auto& [row, with] : {std::pair{0, s.change.p}, std::pair{1, s.change.q}})
      EXPECT_LE((by_w.row(row).transpose().array() - 1 - s.noise->contract(rest, {zero, with}).array()).matrix().norm(),
                1e-13 * (1 + by_w.norm()));
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

// ---- fields over space

TEST_P(NoiseContract, HasTheFieldsOverSpaceThatItDeclaresAtLandmarks) {
  in_each_dimension([](const Subject& s) {
    const Points noise = s.noise->spatial_noise(s.state.q, s.state, s.w);
    const Points compensation = s.noise->spatial_compensation(s.state.q, s.state);
    const Points moved = s.gradient(s.state).p, moved_by_compensation = s.noise->compensation_gradient(s.state).p;
    const Displacement displacement = s.traits.displacement;
    if (!displacement.has_field()) {
      EXPECT_TRUE(noise.isZero(0));
      EXPECT_TRUE(compensation.isZero(0));
    } else if (!displacement.has_landmarks()) {
      EXPECT_LE((noise - moved).norm(), 1e-14 * moved.norm());
      EXPECT_LE((compensation - moved_by_compensation).norm(), 1e-14 * moved.norm());
      EXPECT_TRUE(s.traits.diffeomorphic);
    } else {
      EXPECT_GT((noise - moved).norm(), 0.01 * moved.norm());
    }
  });
}

// Elsewhere they are those of one more landmark without momentum and without channels of its own.
TEST_P(NoiseContract, KnowsItsFieldsOverSpaceEverywhere) {
  in_each_dimension([](const Subject& s) {
    const DefinedNoise definition = s.definition.with_tracer();
    const Points places = s.change.q.leftCols(2);
    const Points noise = s.noise->spatial_noise(places, s.state, s.w);
    const Points compensation = s.noise->spatial_compensation(places, s.state);
    for (Eigen::Index m = 0; m < places.cols(); ++m) {
      PhaseState more{Points(s.d, kCount + 1), Points::Zero(s.d, kCount + 1)};
      more.q << s.state.q, places.col(m);
      const Eigen::VectorXd right = definition.gradient(more, s.w, true).p.col(kCount);
      EXPECT_LE((noise.col(m) - right).norm(), 1e-12 * (1 + right.norm()));
      const Eigen::VectorXd right_compensation = definition.compensation_gradient(more, true).p.col(kCount);
      EXPECT_LE((compensation.col(m) - right_compensation).norm(), 1e-12 * (1 + right_compensation.norm()));
    }
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
    const Points noise = difference([&](const Points& x) { return s.noise->spatial_noise(x, s.state, s.w); });
    const Points compensation = difference([&](const Points& x) { return s.noise->spatial_compensation(x, s.state); });
    EXPECT_LE((s.noise->spatial_noise_change(places, s.state, s.w, change) - noise).norm(), 1e-8 * (1 + noise.norm()));
    EXPECT_LE((s.noise->spatial_compensation_change(places, s.state, change) - compensation).norm(),
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

}  // namespace
}  // namespace pulson
