#include <fmt/core.h>

#include "gaussian_pairs.hpp"
#include "models.hpp"
#include "pulson/noise/differentiated_noise.hpp"

namespace pulson {
namespace {

// h = β exp(−|q_a − q_b|²/γ) for each pair a < b, or their sum in one channel: §5.4 of the paper, last sentence.
struct Potential : NoiseFormula {
  bool common = false;

  std::vector<std::string> parameter_names() const { return {"beta", "gamma"}; }
  std::string spec(const Eigen::VectorXd& theta) const {
    return fmt::format("potential:beta={},gamma={}{}", theta[0], theta[1], common ? ",common=1" : "");
  }
  int channels(int /*dimension*/, int count) const { return common ? 1 : count * (count - 1) / 2; }
  std::vector<NoiseAmplitude> amplitudes(int channels) const { return {NoiseAmplitude::of_all(0, channels)}; }
  void describe(int /*dimension*/, const Eigen::VectorXd& /*theta*/, std::vector<NoiseChannel>& channels) const {
    if (common) return;
    int a = 0, b = 1;
    for (NoiseChannel& channel : channels) {
      channel.landmarks = {a, b};
      if (++a == b) {
        a = 0;
        ++b;
      }
    }
  }
  NoiseTraits traits() const {
    return {.displacement = Displacement::none(), .moves_momenta = true, .additive = false, .local = false};
  }

  template <class T>
  void add_potentials(const StateOf<T>& state, const VectorOf<T>& theta, VectorOf<T>& h) const {
    Eigen::Index pair = 0;
    for_each_gaussian_pair(state.q, theta[1], [&](Eigen::Index, Eigen::Index, const T*, const T& e) {
      h[common ? 0 : pair++] += theta[0] * e;
    });
  }
  template <class T>
  void add_gradient(const StateOf<T>& state, const VectorOf<T>& theta, const Eigen::VectorXd& w,
                    StateOf<T>& gradient) const {
    const Eigen::Index d = state.q.rows();
    const T c = T(-2) * theta[0] / theta[1];
    Eigen::Index pair = 0;
    for_each_gaussian_pair(state.q, theta[1], [&](Eigen::Index a, Eigen::Index b, const T* z, const T& e) {
      const T slope = T(w[common ? 0 : pair++]) * c * e;
      for (Eigen::Index j = 0; j < d; ++j) {
        gradient.q(j, a) += slope * z[j];
        gradient.q(j, b) -= slope * z[j];
      }
    });
  }
};

}  // namespace

NoiseTable::Row potential() {
  return {
      "potential",
      {{"beta", "", "amplitude"},
       {"gamma", "", "range: exp(-r^2/gamma), length squared"},
       {"common", "0", "1: one channel that all pairs share"}},
      "h = beta exp(-|q_a - q_b|^2/gamma) over pairs: noise in the momenta, total momentum is conserved (section 5.4)",
      [](const Parameters& parameters, const Landmarks&) {
        Potential formula;
        formula.common = parameters.flag("common");
        return make_differentiated(formula, {parameters.positive("beta"), parameters.positive("gamma")});
      }};
}

}  // namespace pulson
