#include <fmt/core.h>

#include "models.hpp"
#include "pulson/noise/differentiated_noise.hpp"

namespace pulson {
namespace {

// Marsland and Shardlow's Langevin equations: dp = −H_q dt − λ H_p dt + σ dW. The noise is that of h = σ q_a^j with the
// sign turned, which has the same law; the friction makes the system not Hamiltonian.
struct Langevin : NoiseFormula {
  static int friction_index() { return 1; }

  std::vector<std::string> parameter_names() const { return {"sigma", "friction"}; }
  std::string spec(const Eigen::VectorXd& theta) const {
    return fmt::format("langevin:sigma={},friction={}", theta[0], theta[1]);
  }
  int channels(int dimension, int count) const { return dimension * count; }
  std::vector<NoiseAmplitude> amplitudes(int channels) const { return {NoiseAmplitude::of_all(0, channels)}; }
  void describe(int dimension, const Eigen::VectorXd& /*theta*/, std::vector<NoiseChannel>& channels) const {
    LandmarkChoice().describe(dimension, channels);
  }
  NoiseTraits traits() const {
    return {.displacement = Displacement::none(),
            .moves_momenta = true,
            .hamiltonian = false,
            .translation_invariant = false};
  }

  template <class T>
  void add_potentials(const StateOf<T>& state, const VectorOf<T>& theta, VectorOf<T>& h) const {
    for (Eigen::Index i = 0; i < h.size(); ++i) h[i] += theta[0] * state.q.reshaped()[i];
  }
  template <class T>
  void add_gradient(const StateOf<T>& /*state*/, const VectorOf<T>& theta, const Eigen::VectorXd& w,
                    StateOf<T>& gradient) const {
    for (Eigen::Index i = 0; i < w.size(); ++i) gradient.q.reshaped()[i] += theta[0] * T(w[i]);
  }
};

}  // namespace

NoiseTable::Row langevin() {
  return {"langevin",
          {{"sigma", "", "amplitude, momentum per square root of time; 50%: of the diameter", true},
           {"friction", "1", "lambda of the friction -lambda H_p; stationary density exp(-2 lambda H/sigma^2)"}},
          "noise in the momenta with friction (Marsland and Shardlow): not Hamiltonian, diffeomorphic",
          [](const Parameters& parameters, const Landmarks&) {
            return make_differentiated(Langevin(), {parameters.positive("sigma"), parameters.non_negative("friction")});
          }};
}

}  // namespace pulson
