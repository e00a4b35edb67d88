#include "dynamics/effective_hamiltonian.hpp"

#include <string>
#include <utility>
#include <vector>

namespace pulson {
namespace {

// ∇(λ/2)Σh².
PhaseState gradient_of_controls(const NoiseModel& noise, double lambda, const PhaseState& state) {
  return noise.gradient(state, lambda * noise.potentials(state));
}

PhaseState change_of_controls(const NoiseModel& noise, double lambda, const PhaseState& state,
                              const PhaseState& change) {
  const PhaseState bent = noise.hessian(state, lambda * noise.potentials(state), change);
  const PhaseState driven = noise.gradient(state, lambda * noise.contract(state, change));
  return {bent.q + driven.q, bent.p + driven.p};
}

class ControlEnergy final : public NoiseModel {
 public:
  ControlEnergy(std::shared_ptr<const NoiseModel> noise, double lambda) : noise_(std::move(noise)), lambda_(lambda) {}

  std::string spec() const override { return noise_->spec(); }
  int channels(int /*dimension*/, int /*count*/) const override { return 0; }
  NoiseTraits traits() const override {
    const NoiseTraits of = noise_->traits();
    return {.displacement = of.displacement,
            .compensated = true,
            .translation_invariant = of.translation_invariant,
            .diffeomorphic = of.diffeomorphic,
            .local = false,
            .affine = false};
  }
  void check(int dimension, int count) const override { noise_->check(dimension, count); }
  std::vector<std::string> parameter_names() const override { return {}; }
  Eigen::VectorXd parameters() const override { return {}; }
  std::shared_ptr<const NoiseModel> with_parameters(const Eigen::VectorXd& /*parameters*/) const override {
    return control_energy(noise_, lambda_);
  }
  void add_to(const NoiseSums<double>& sums) const override {
    if (!sums.compensation) return;
    const PhaseState gradient = gradient_of_controls(*noise_, lambda_, {sums.at.q, sums.at.p});
    sums.compensation->q += gradient.q;
    sums.compensation->p += gradient.p;
  }
  void add_to(const NoiseSums<Dual>& sums) const override {
    if (!sums.compensation) return;
    const PhaseState state{values(sums.at.q), values(sums.at.p)};
    const PhaseState gradient = gradient_of_controls(*noise_, lambda_, state);
    const PhaseState change = change_of_controls(*noise_, lambda_, state, {changes(sums.at.q), changes(sums.at.p)});
    sums.compensation->q += dual(gradient.q, change.q);
    sums.compensation->p += dual(gradient.p, change.p);
  }
  void add_to(const SpaceSums<double>& sums) const override {
    if (!sums.compensation) return;
    *sums.compensation += noise_->spatial_noise(sums.x, sums.at, controls(sums.at));
  }
  void add_to(const SpaceSums<Dual>& sums) const override {
    if (!sums.compensation) return;
    const Points x = values(sums.x);
    const Eigen::VectorXd u = controls(sums.at);
    *sums.compensation +=
        dual(noise_->spatial_noise(x, sums.at, u), noise_->spatial_noise_change(x, sums.at, u, changes(sums.x)));
  }

 private:
  // At one state: they do not change with the places.
  Eigen::VectorXd controls(const PhaseState& at) const { return lambda_ * noise_->potentials(at); }
  static Points values(const MatrixOf<Dual>& x) {
    return x.unaryExpr([](const Dual& entry) { return entry.value; });
  }
  static Points changes(const MatrixOf<Dual>& x) {
    return x.unaryExpr([](const Dual& entry) { return entry.change; });
  }
  static MatrixOf<Dual> dual(const Points& value, const Points& change) {
    return value.binaryExpr(change, [](double x, double by) { return Dual(x, by); });
  }

  std::shared_ptr<const NoiseModel> noise_;
  double lambda_;
};

}  // namespace

std::shared_ptr<const NoiseModel> control_energy(std::shared_ptr<const NoiseModel> noise, double lambda) {
  return std::make_shared<ControlEnergy>(std::move(noise), lambda);
}

EffectiveHamiltonian::EffectiveHamiltonian(StochasticSystem system, double lambda)
    : system_(std::move(system)), lambda_(lambda), noisy_(system_.noise->traits().moves_positions()) {}

double EffectiveHamiltonian::value(const PhaseState& state) const {
  const double smooth = hamiltonian(system_.kernel, state);
  return noisy_ ? smooth + 0.5 * lambda_ * system_.noise->potentials(state).squaredNorm() : smooth;
}

Eigen::VectorXd EffectiveHamiltonian::controls(const PhaseState& state) const {
  return lambda_ * system_.noise->potentials(state);
}

Points EffectiveHamiltonian::velocity(const PhaseState& state) const {
  Points v = hamiltonian_p(system_.kernel, state.q, state.p);
  if (noisy_) v += system_.noise->gradient(state, controls(state)).p;
  return v;
}

Points EffectiveHamiltonian::force(const PhaseState& state) const {
  Points f = hamiltonian_q(system_.kernel, state.q, state.p);
  if (noisy_) f += system_.noise->gradient(state, controls(state)).q;
  return f;
}

Flow EffectiveHamiltonian::flow(const PhaseState& state) const {
  Flow flow = system_.kernel.flow(state.q, state.p);
  if (!noisy_) return flow;
  const PhaseState of_noise = gradient_of_controls(*system_.noise, lambda_, state);
  flow.velocity += of_noise.p;
  flow.force += of_noise.q;
  return flow;
}

Flow EffectiveHamiltonian::flow_change(const PhaseState& state, const PhaseState& change) const {
  Flow flow = system_.kernel.flow_tangent(state.q, state.p, change.q, change.p);
  if (!noisy_) return flow;
  const PhaseState of_noise = noise_change(state, change);
  flow.velocity += of_noise.p;
  flow.force += of_noise.q;
  return flow;
}

Points EffectiveHamiltonian::velocity_change(const PhaseState& state, const Points& dq) const {
  Points dv = system_.kernel.apply_tangent(state.q, state.p, dq);
  if (!noisy_) return dv;
  return dv + noise_change(state, {dq, Points::Zero(dq.rows(), dq.cols())}).p;
}

Points EffectiveHamiltonian::force_change(const PhaseState& state, const PhaseState& change) const {
  Points df = system_.kernel.flow_tangent(state.q, state.p, change.q, change.p).force;
  if (!noisy_) return df;
  return df + noise_change(state, change).q;
}

PhaseState EffectiveHamiltonian::noise_change(const PhaseState& state, const PhaseState& change) const {
  return change_of_controls(*system_.noise, lambda_, state, change);
}

}  // namespace pulson
