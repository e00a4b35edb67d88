// The Hamiltonian of metamorphosis and its derivatives against automatic differentiation of its definition, for every
// noise whose potentials are linear in the momenta.

#include "dynamics/effective_hamiltonian.hpp"

#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "combinations.hpp"
#include "noise_definition.hpp"
#include "shape.hpp"

namespace pulson {
namespace {

constexpr int kCount = 4;
constexpr double kLambda = 1.7;

class EffectiveHamiltonianContract : public testing::TestWithParam<std::tuple<std::string, int>> {
 protected:
  const std::string spec_ = std::get<0>(GetParam());
  const int d_ = std::get<1>(GetParam());
  const PhaseState state_{random_points(d_, kCount, 1), random_points(d_, kCount, 2)};
  const PhaseState change_{random_points(d_, kCount, 3), random_points(d_, kCount, 4)};
  const DefinedKernel kernel_{{{"gaussian", 0.8, 0.7}, {"matern52", 1.5, 0.4}}};
  const Landmarks shape_ = shape(state_.q);
  const DefinedNoise definition_{spec_, shape_};
  const std::shared_ptr<const NoiseModel> noise_ = make_noise(spec_, shape_);
  const EffectiveHamiltonian system_{{kernel_.make(), noise_}, kLambda};

  // H + (λ/2) Σ h_i², by the definitions of its terms.
  template <class T>
  T defined(const std::vector<T>& x) const {
    const auto size = static_cast<std::ptrdiff_t>(x.size() / 2);
    using Matrix = PointsOf<T>;
    const Matrix q = Eigen::Map<const Matrix>(x.data(), d_, kCount);
    const Matrix p = Eigen::Map<const Matrix>(x.data() + size, d_, kCount);
    std::vector<T> theta;
    for (const double value : definition_.theta()) theta.push_back(constant<T>(value));
    T sum = energy<T>(kernel_, q, p);
    for (const T& h : definition_.potentials(x, theta)) sum += constant<T>(0.5 * kLambda) * h * h;
    return sum;
  }

  // f of each unit vector of phase space; positions first.
  template <class Function>
  PhaseState each(const Function& f) const {
    PhaseState all{Points(d_, kCount), Points(d_, kCount)};
    const auto size = static_cast<std::size_t>(all.q.size());
    for (std::size_t m = 0; m < size; ++m) {
      all.q(static_cast<Eigen::Index>(m)) = f(unit(2 * size, m));
      all.p(static_cast<Eigen::Index>(m)) = f(unit(2 * size, size + m));
    }
    return all;
  }

  PhaseState gradient() const {
    return each([&](const std::vector<double>& e) { return defined(moved(coordinates(state_), e)).v[0]; });
  }

  PhaseState hessian(const PhaseState& change) const {
    const auto along = moved(coordinates(state_), coordinates(change));
    return each([&](const std::vector<double>& e) { return defined(moved(along, e)).v[0].v[0]; });
  }
};

INSTANTIATE_TEST_SUITE_P(Table, EffectiveHamiltonianContract,
                         testing::Combine(testing::ValuesIn(linear_noise_specs()), testing::Values(1, 2, 3)),
                         [](const auto& instance) {
                           return test_name(std::get<0>(instance.param) + "_in_" +
                                            std::to_string(std::get<1>(instance.param)) + "d");
                         });

TEST_P(EffectiveHamiltonianContract, HasTheValueOfItsDefinition) {
  const double right = defined(coordinates(state_));
  EXPECT_NEAR(system_.value(state_), right, 1e-13 * std::abs(right));
}

TEST_P(EffectiveHamiltonianContract, HasTheControlsOfPontryagin) {
  const Eigen::VectorXd u = system_.controls(state_);
  const Eigen::VectorXd right = kLambda * definition_.potentials(state_);
  ASSERT_EQ(u.size(), right.size());
  EXPECT_LE((u - right).norm(), 1e-13 * right.norm());
  // λ H_tot is what energy and controls cost together.
  EXPECT_NEAR(kLambda * system_.value(state_),
              kLambda * hamiltonian(system_.system().kernel, state_) + 0.5 * u.squaredNorm(),
              1e-13 * kLambda * system_.value(state_));
}

// (11) with the controls as noise is the flow of H_tot.
TEST_P(EffectiveHamiltonianContract, HasTheGradientsOfItsDefinition) {
  const PhaseState right = gradient();
  EXPECT_LE((system_.velocity(state_) - right.p).norm(), 1e-13 * right.p.norm());
  EXPECT_LE((system_.force(state_) - right.q).norm(), 1e-13 * right.q.norm());
}

TEST_P(EffectiveHamiltonianContract, HasTheSecondDerivativesOfItsDefinition) {
  const PhaseState right = hessian(change_);
  EXPECT_LE((system_.force_change(state_, change_) - right.q).norm(), 1e-12 * right.q.norm());
  const Points velocity = hessian({change_.q, Points::Zero(d_, kCount)}).p;
  EXPECT_LE((system_.velocity_change(state_, change_.q) - velocity).norm(), 1e-12 * velocity.norm());
}

// ½ p·∂H_tot/∂p, which is what makes the least momenta those of the cometric.
TEST_P(EffectiveHamiltonianContract, IsQuadraticInTheMomenta) {
  const double value = system_.value(state_);
  EXPECT_NEAR(0.5 * state_.p.cwiseProduct(system_.velocity(state_)).sum(), value, 1e-13 * value);
}

}  // namespace
}  // namespace pulson
