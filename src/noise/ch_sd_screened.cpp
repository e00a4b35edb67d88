
#include <fmt/core.h>

#include "gaussian_pairs.hpp"
#include "models.hpp"
#include "pulson/noise/differentiated_noise.hpp"

namespace pulson {
namespace {

// h = β p_a^j s_a(q), s_a = Σ_b exp(−|q_a − q_b|²/γ) over the b that screen a, for each chosen landmark a and axis j,
// axis fastest: §5.3 of the paper, where landmark 2 moves and 1 screens. The b are the landmarks of other groups where
// the shape has several, else all but a.
struct ChSdScreened : NoiseFormula {
  LandmarkChoice on;
  std::vector<std::size_t> group;  // of each landmark; empty where there is one group

  std::vector<std::string> parameter_names() const { return {"beta", "gamma"}; }
  std::string spec(const Eigen::VectorXd& theta) const {
    return fmt::format("ch-sd-screened:beta={},gamma={}{}", theta[0], theta[1], on.spec());
  }
  int channels(int dimension, int count) const { return dimension * on.count(count); }
  std::vector<NoiseAmplitude> amplitudes(int channels) const { return {NoiseAmplitude::of_all(0, channels)}; }
  void describe(int dimension, const Eigen::VectorXd& /*theta*/, std::vector<NoiseChannel>& channels) const {
    on.describe(dimension, channels);
  }
  NoiseTraits traits() const {
    return {.displacement = Displacement::landmarks(),
            .moves_momenta = true,
            .additive = false,
            .compensated = true,
            .diffeomorphic = false,
            .local = false,
            .linear = true};
  }
  void check(int /*dimension*/, int count, const std::string& spec) const {
    on.check(count, spec);
    if (!group.empty() && static_cast<int>(group.size()) != count)
      throw InputError(
          fmt::format("noise '{}': it was made for {} landmarks, the shape has {}", spec, group.size(), count));
  }

  template <class T>
  void add_potentials(const StateOf<T>& state, const VectorOf<T>& theta, VectorOf<T>& h) const {
    const Eigen::Index d = state.q.rows();
    VectorOf<T> screens = VectorOf<T>::Constant(state.q.cols(), T(0));
    for_each_screen(state, theta, [&](Eigen::Index a, Eigen::Index b, const T*, const T& e) {
      screens[a] += e;
      screens[b] += e;
    });
    for (int i = 0; i < on.count(static_cast<int>(state.q.cols())); ++i)
      for (Eigen::Index axis = 0; axis < d; ++axis) h[i * d + axis] += theta[0] * screens[on[i]] * state.p(axis, on[i]);
  }

  template <class T>
  void add_gradient(const StateOf<T>& state, const VectorOf<T>& theta, const Eigen::VectorXd& w,
                    StateOf<T>& gradient) const {
    const Eigen::Index d = state.q.rows(), n = state.q.cols();
    VectorOf<T> pull = VectorOf<T>::Constant(n, T(0));  // β w_a·p_a
    VectorOf<T> screens = pull;
    for (int i = 0; i < on.count(static_cast<int>(n)); ++i)
      for (Eigen::Index axis = 0; axis < d; ++axis) pull[on[i]] += theta[0] * T(w[i * d + axis]) * state.p(axis, on[i]);
    const T c = T(-2) / theta[1];
    for_each_screen(state, theta, [&](Eigen::Index a, Eigen::Index b, const T* z, const T& e) {
      screens[a] += e;
      screens[b] += e;
      const T slope = c * e * (pull[a] + pull[b]);
      for (Eigen::Index axis = 0; axis < d; ++axis) {
        gradient.q(axis, a) += slope * z[axis];
        gradient.q(axis, b) -= slope * z[axis];
      }
    });
    for (int i = 0; i < on.count(static_cast<int>(n)); ++i)
      for (Eigen::Index axis = 0; axis < d; ++axis)
        gradient.p(axis, on[i]) += theta[0] * screens[on[i]] * T(w[i * d + axis]);
  }

  // G = ¼β² Σ_a s_a p_a·g_a with g_a = ∂s_a/∂q_a, over the chosen a.
  template <class T>
  void add_compensation_gradient(const StateOf<T>& state, const VectorOf<T>& theta, StateOf<T>& gradient) const {
    const Eigen::Index d = state.q.rows(), n = state.q.cols();
    const T quarter = T(0.25) * theta[0] * theta[0];
    const T c = T(-2) / theta[1];
    VectorOf<T> screens = VectorOf<T>::Constant(n, T(0));    // s
    MatrixOf<T> slopes = MatrixOf<T>::Constant(d, n, T(0));  // g
    for_each_screen(state, theta, [&](Eigen::Index a, Eigen::Index b, const T* z, const T& e) {
      screens[a] += e;
      screens[b] += e;
      for (Eigen::Index axis = 0; axis < d; ++axis) {
        slopes(axis, a) += c * e * z[axis];
        slopes(axis, b) -= c * e * z[axis];
      }
    });
    VectorOf<T> of_s = VectorOf<T>::Constant(n, T(0));     // ∂G/∂s_a = ¼β² p_a·g_a
    MatrixOf<T> of_g = MatrixOf<T>::Constant(d, n, T(0));  // ∂G/∂g_a = ¼β² s_a p_a
    for (int i = 0; i < on.count(static_cast<int>(n)); ++i) {
      const int a = on[i];
      for (Eigen::Index axis = 0; axis < d; ++axis) {
        of_s[a] += quarter * state.p(axis, a) * slopes(axis, a);
        of_g(axis, a) = quarter * screens[a] * state.p(axis, a);
        gradient.p(axis, a) += quarter * screens[a] * slopes(axis, a);
      }
    }
    for_each_screen(state, theta, [&](Eigen::Index a, Eigen::Index b, const T* z, const T& e) {
      T along(0);  // z·v, v = ∂G/∂g_a − ∂G/∂g_b
      for (Eigen::Index axis = 0; axis < d; ++axis) along += z[axis] * (of_g(axis, a) - of_g(axis, b));
      const T by_z = c * e * (of_s[a] + of_s[b] + c * along);
      for (Eigen::Index axis = 0; axis < d; ++axis) {
        const T force = by_z * z[axis] + c * e * (of_g(axis, a) - of_g(axis, b));
        gradient.q(axis, a) += force;
        gradient.q(axis, b) -= force;
      }
    });
  }

 private:
  // visit(a, b, q_a − q_b, exp(−|q_a − q_b|²/γ)) for the pairs a < b that screen each other
  template <class T, class Visit>
  void for_each_screen(const StateOf<T>& state, const VectorOf<T>& theta, const Visit& visit) const {
    for_each_gaussian_pair(state.q, theta[1], [&](Eigen::Index a, Eigen::Index b, const T* z, const T& e) {
      if (group.empty() || group[static_cast<std::size_t>(a)] != group[static_cast<std::size_t>(b)]) visit(a, b, z, e);
    });
  }
};

// The number of each landmark's group; empty where all belong to one.
std::vector<std::size_t> group_numbers(const Landmarks& shape) {
  const std::vector<std::vector<int>> groups = landmarks_by_group(shape);
  if (groups.size() < 2) return {};
  std::vector<std::size_t> numbers(static_cast<std::size_t>(shape.count()));
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const int a : groups[g]) numbers[static_cast<std::size_t>(a)] = g;
  return numbers;
}

}  // namespace

NoiseTable::Row ch_sd_screened() {
  return {"ch-sd-screened",
          {{"beta", "", "amplitude, length per square root of time; 50%: of the diameter", true},
           {"gamma", "", "range: exp(-r^2/gamma), length squared"},
           LandmarkChoice::info()},
          "h = beta p_a sum_b exp(-|q_a - q_b|^2/gamma): noise in the positions near another outline (if there is only "
          "one, near another landmark); landmarks may pass through each other (section 5.3)",
          [](const Parameters& parameters, const Landmarks& shape) {
            ChSdScreened formula;
            formula.on = LandmarkChoice(parameters);
            formula.group = group_numbers(shape);
            return make_differentiated(std::move(formula), {parameters.positive("beta"), parameters.positive("gamma")});
          }};
}

}  // namespace pulson
