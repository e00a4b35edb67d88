#include <fmt/core.h>

#include "models.hpp"
#include "pulson/noise/differentiated_noise.hpp"

namespace pulson {
namespace {

// Noise in the momenta alone: h = σ q_a^j for each chosen landmark a and axis j, axis fastest; or, in common,
// h = σ Σ_a q_a^j for each axis, (21).
struct TrouveVialard : NoiseFormula {
  LandmarkChoice on;
  bool common = false;

  std::vector<std::string> parameter_names() const { return {"sigma"}; }
  std::string spec(const Eigen::VectorXd& theta) const {
    return fmt::format("trouve-vialard:sigma={}{}{}", theta[0], common ? ",common=1" : "", on.spec());
  }
  int channels(int dimension, int count) const { return common ? dimension : dimension * on.count(count); }
  std::vector<NoiseAmplitude> amplitudes(int channels) const { return {NoiseAmplitude::of_all(0, channels)}; }
  void describe(int dimension, const Eigen::VectorXd& /*theta*/, std::vector<NoiseChannel>& channels) const {
    on.describe(dimension, channels);
    if (!common) return;
    for (NoiseChannel& channel : channels) channel.landmarks = on.listed();
  }
  NoiseTraits traits() const {
    return {.displacement = Displacement::none(), .moves_momenta = true, .translation_invariant = false};
  }
  void check(int /*dimension*/, int count, const std::string& spec) const { on.check(count, spec); }

  template <class T>
  void add_potentials(const StateOf<T>& state, const VectorOf<T>& theta, VectorOf<T>& h) const {
    for_each_coordinate(
        state, [&](Eigen::Index axis, int a, Eigen::Index channel) { h[channel] += theta[0] * state.q(axis, a); });
  }
  template <class T>
  void add_gradient(const StateOf<T>& state, const VectorOf<T>& theta, const Eigen::VectorXd& w,
                    StateOf<T>& gradient) const {
    for_each_coordinate(state, [&](Eigen::Index axis, int a, Eigen::Index channel) {
      gradient.q(axis, a) += theta[0] * T(w[channel]);
    });
  }

 private:
  template <class T, class Visit>
  void for_each_coordinate(const StateOf<T>& state, const Visit& visit) const {
    const Eigen::Index d = state.q.rows();
    const int chosen = on.count(static_cast<int>(state.q.cols()));
    for (int i = 0; i < chosen; ++i)
      for (Eigen::Index axis = 0; axis < d; ++axis) visit(axis, on[i], common ? axis : i * d + axis);
  }
};

}  // namespace

NoiseTable::Row trouve_vialard() {
  return {"trouve-vialard",
          {{"sigma", "", "amplitude, momentum per square root of time; 50%: of the diameter", true},
           {"common", "0", "1: one channel for each axis that all landmarks share"},
           LandmarkChoice::info()},
          "h = sigma q_a: noise in the momenta; flows stay diffeomorphic (paper, section 5.4)",
          [](const Parameters& parameters, const Landmarks&) {
            TrouveVialard formula;
            formula.on = LandmarkChoice(parameters);
            formula.common = parameters.flag("common");
            return make_differentiated(std::move(formula), {parameters.positive("sigma")});
          }};
}

}  // namespace pulson
