#include <fmt/core.h>

#include "models.hpp"
#include "pulson/noise/differentiated_noise.hpp"

namespace pulson {
namespace {

// Canonical Hamiltonian stochastic deformation with constant coefficients, §5.1-5.2 of the paper: h = β p_a^j for each
// chosen landmark a and axis j, axis fastest.
struct ChSd : NoiseFormula {
  LandmarkChoice on;

  std::vector<std::string> parameter_names() const { return {"beta"}; }
  std::string spec(const Eigen::VectorXd& theta) const { return fmt::format("ch-sd:beta={}{}", theta[0], on.spec()); }
  int channels(int dimension, int count) const { return dimension * on.count(count); }
  std::vector<NoiseAmplitude> amplitudes(int channels) const { return {NoiseAmplitude::of_all(0, channels)}; }
  void describe(int dimension, const Eigen::VectorXd& /*theta*/, std::vector<NoiseChannel>& channels) const {
    on.describe(dimension, channels);
  }
  NoiseTraits traits() const {
    return {.displacement = Displacement::landmarks(), .diffeomorphic = false, .linear = true};
  }
  void check(int /*dimension*/, int count, const std::string& spec) const { on.check(count, spec); }

  template <class T>
  void add_potentials(const StateOf<T>& state, const VectorOf<T>& theta, VectorOf<T>& h) const {
    const Eigen::Index d = state.p.rows();
    for (Eigen::Index i = 0; i < h.size(); ++i) h[i] += theta[0] * state.p(i % d, on[static_cast<int>(i / d)]);
  }
  template <class T>
  void add_gradient(const StateOf<T>& state, const VectorOf<T>& theta, const Eigen::VectorXd& w,
                    StateOf<T>& gradient) const {
    const Eigen::Index d = state.p.rows();
    for (Eigen::Index i = 0; i < w.size(); ++i) gradient.p(i % d, on[static_cast<int>(i / d)]) += theta[0] * T(w[i]);
  }
};

// No channels at all.
struct NoNoise : NoiseFormula {
  std::vector<std::string> parameter_names() const { return {}; }
  std::string spec(const Eigen::VectorXd& /*theta*/) const { return "none"; }
  int channels(int /*dimension*/, int /*count*/) const { return 0; }
  NoiseTraits traits() const { return {.displacement = Displacement::none(), .linear = true}; }
  template <class T>
  void add_potentials(const StateOf<T>&, const VectorOf<T>&, VectorOf<T>&) const {}
  template <class T>
  void add_gradient(const StateOf<T>&, const VectorOf<T>&, const Eigen::VectorXd&, StateOf<T>&) const {}
};

}  // namespace

NoiseTable::Row ch_sd() {
  return {
      "ch-sd",
      {{"beta", "", "amplitude, length per square root of time; 50%: of the diameter", true}, LandmarkChoice::info()},
      "h = beta p_a: noise in the positions; landmarks may pass through each other (paper, section 5.1)",
      [](const Parameters& parameters, const Landmarks&) {
        ChSd formula;
        formula.on = LandmarkChoice(parameters);
        return make_differentiated(std::move(formula), {parameters.positive("beta")});
      }};
}

NoiseTable::Row no_noise() {
  return {"none", {}, "no noise: the geodesic equations of classical LDDMM", [](const Parameters&, const Landmarks&) {
            return make_differentiated(NoNoise(), {});
          }};
}

}  // namespace pulson
