#include <fmt/core.h>

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
    for_each_pair(state, theta, [&](Eigen::Index, Eigen::Index, const VectorOf<T>&, const T& value, Eigen::Index pair) {
      h[common ? 0 : pair] += value;
    });
  }
  template <class T>
  void add_gradient(const StateOf<T>& state, const VectorOf<T>& theta, const Eigen::VectorXd& w,
                    StateOf<T>& gradient) const {
    for_each_pair(state, theta,
                  [&](Eigen::Index a, Eigen::Index b, const VectorOf<T>& z, const T& value, Eigen::Index pair) {
                    const T slope = T(-2 * w[common ? 0 : pair]) * value / theta[1];
                    gradient.q.col(a) += slope * z;
                    gradient.q.col(b) -= slope * z;
                  });
  }

 private:
  // visit(a, b, q_a − q_b, h, number of the pair)
  template <class T, class Visit>
  static void for_each_pair(const StateOf<T>& state, const VectorOf<T>& theta, const Visit& visit) {
    using std::exp;
    Eigen::Index pair = 0;
    for (Eigen::Index b = 1; b < state.q.cols(); ++b) {
      for (Eigen::Index a = 0; a < b; ++a, ++pair) {
        const VectorOf<T> z = state.q.col(a) - state.q.col(b);
        visit(a, b, z, T(theta[0] * exp(-z.dot(z) / theta[1])), pair);
      }
    }
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
