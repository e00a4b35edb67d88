
#include <fmt/core.h>

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
    for (int i = 0; i < on.count(static_cast<int>(state.q.cols())); ++i) {
      const T amplitude = theta[0] * screen(state, theta, on[i]).value;
      for (Eigen::Index axis = 0; axis < d; ++axis) h[i * d + axis] += amplitude * state.p(axis, on[i]);
    }
  }

  template <class T>
  void add_gradient(const StateOf<T>& state, const VectorOf<T>& theta, const Eigen::VectorXd& w,
                    StateOf<T>& gradient) const {
    const Eigen::Index d = state.q.rows();
    for (int i = 0; i < on.count(static_cast<int>(state.q.cols())); ++i) {
      const int a = on[i];
      const VectorOf<T> w_a = w.segment(i * d, d).unaryExpr([](double x) { return T(x); });
      const T pull = theta[0] * w_a.dot(state.p.col(a));
      T value(0);
      for_each_screen(state, theta, a, [&](Eigen::Index b, const VectorOf<T>& z, const T& e) {
        value += e;
        const VectorOf<T> force = (T(-2) * pull * e / theta[1]) * z;
        gradient.q.col(a) += force;
        gradient.q.col(b) -= force;
      });
      gradient.p.col(a) += (theta[0] * value) * w_a;
    }
  }

  // G = ¼β² Σ_a s_a p_a·g_a with g_a = ∂s_a/∂q_a.
  template <class T>
  void add_compensation_gradient(const StateOf<T>& state, const VectorOf<T>& theta, StateOf<T>& gradient) const {
    const T quarter = T(0.25) * theta[0] * theta[0];
    for (int i = 0; i < on.count(static_cast<int>(state.q.cols())); ++i) {
      const int a = on[i];
      const Screen<T> s = screen(state, theta, a);
      gradient.p.col(a) += (quarter * s.value) * s.slope;
      const VectorOf<T> p = state.p.col(a);
      const T along = p.dot(s.slope);
      for_each_screen(state, theta, a, [&](Eigen::Index b, const VectorOf<T>& z, const T& e) {
        const T first = quarter * T(-2) * e / theta[1];
        const VectorOf<T> force =
            (first * along) * z + (first * s.value) * (p - (T(2) * z.dot(p) / theta[1]) * z).eval();
        gradient.q.col(a) += force;
        gradient.q.col(b) -= force;
      });
    }
  }

 private:
  template <class T>
  struct Screen {
    T value;            // s_a
    VectorOf<T> slope;  // ∂s_a/∂q_a
  };

  // visit(b, q_a − q_b, exp(−|q_a − q_b|²/γ)) for the b that screen a
  template <class T, class Visit>
  void for_each_screen(const StateOf<T>& state, const VectorOf<T>& theta, int a, const Visit& visit) const {
    using std::exp;
    for (Eigen::Index b = 0; b < state.q.cols(); ++b) {
      if (b == a || (!group.empty() && group[static_cast<std::size_t>(a)] == group[static_cast<std::size_t>(b)]))
        continue;
      const VectorOf<T> z = state.q.col(a) - state.q.col(b);
      visit(b, z, T(exp(-z.dot(z) / theta[1])));
    }
  }

  template <class T>
  Screen<T> screen(const StateOf<T>& state, const VectorOf<T>& theta, int a) const {
    Screen<T> sum{T(0), VectorOf<T>::Constant(state.q.rows(), T(0))};
    for_each_screen(state, theta, a, [&](Eigen::Index, const VectorOf<T>& z, const T& e) {
      sum.value += e;
      sum.slope += (T(-2) * e / theta[1]) * z;
    });
    return sum;
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
