#include <fmt/core.h>

#include "models.hpp"
#include "pulson/noise/differentiated_noise.hpp"

namespace pulson {
namespace {

// h = β Σ_a p_a^j k(q_a − q_b) for each landmark b and axis j, axis fastest, k(z) = exp(−|z|²/width²): fields about the
// landmarks, that move with them. Without momenta dq_a = β Σ_b k(q_a − q_b) ∘ dW_b.
struct Kunita : NoiseFormula {
  std::vector<std::string> parameter_names() const { return {"beta", "width"}; }
  std::string spec(const Eigen::VectorXd& theta) const {
    return fmt::format("kunita:beta={},width={}", theta[0], theta[1]);
  }
  int channels(int dimension, int count) const { return dimension * count; }
  NoiseTraits traits() const {
    return {.moves_positions = true,
            .moves_momenta = true,
            .additive = false,
            .compensated = true,
            .local = false,
            .linear = true};
  }

  template <class T>
  void add_potentials(const StateOf<T>& state, const VectorOf<T>& theta, VectorOf<T>& h) const {
    MatrixOf<T> sums = theta[0] * state.p;
    for_each_pair(state, theta, [&](Eigen::Index a, Eigen::Index b, const VectorOf<T>&, const T& k) {
      sums.col(a) += theta[0] * k * state.p.col(b);
      sums.col(b) += theta[0] * k * state.p.col(a);
    });
    h += sums.reshaped();
  }

  // h_w = β Σ_ab p_a·w_b k(q_a − q_b)
  template <class T>
  void add_gradient(const StateOf<T>& state, const VectorOf<T>& theta, const Eigen::VectorXd& w,
                    StateOf<T>& gradient) const {
    const Eigen::Index d = state.q.rows();
    const Eigen::Map<const Eigen::MatrixXd> increments(w.data(), d, state.q.cols());
    const T c = T(-2) * theta[0] / (theta[1] * theta[1]);
    for (Eigen::Index i = 0; i < w.size(); ++i) gradient.p.reshaped()[i] += theta[0] * T(w[i]);
    for_each_pair(state, theta, [&](Eigen::Index a, Eigen::Index b, const VectorOf<T>& z, const T& k) {
      T both(0);
      for (Eigen::Index j = 0; j < d; ++j) {
        gradient.p(j, a) += theta[0] * k * T(increments(j, b));
        gradient.p(j, b) += theta[0] * k * T(increments(j, a));
        both += state.p(j, a) * T(increments(j, b)) + state.p(j, b) * T(increments(j, a));
      }
      const T slope = c * k * both;
      gradient.q.col(a) += slope * z;
      gradient.q.col(b) -= slope * z;
    });
  }

  // G = ¼β² Σ_ab p_a·∇k(z) (k(z) − 1), z = q_a − q_b: with s = 2/width², G_p,a = −¼β²s Σ_b (k² − k) z, and G_q,a is
  // −¼β²s Σ_b ((k² − k) v − s (2k − 1) k z z·v), v = p_a − p_b.
  template <class T>
  void add_compensation_gradient(const StateOf<T>& state, const VectorOf<T>& theta, StateOf<T>& gradient) const {
    const T s = T(2) / (theta[1] * theta[1]);
    const T factor = T(-0.25) * theta[0] * theta[0] * s;
    for_each_pair(state, theta, [&](Eigen::Index a, Eigen::Index b, const VectorOf<T>& z, const T& k) {
      const T part = factor * (k * k - k);
      const VectorOf<T> v = state.p.col(a) - state.p.col(b);
      const VectorOf<T> by_q = part * v - (factor * s * (T(2) * k - T(1)) * k * z.dot(v)) * z;
      gradient.p.col(a) += part * z;
      gradient.p.col(b) -= part * z;
      gradient.q.col(a) += by_q;
      gradient.q.col(b) -= by_q;
    });
  }

 private:
  // visit(a, b, q_a − q_b, k)
  template <class T, class Visit>
  static void for_each_pair(const StateOf<T>& state, const VectorOf<T>& theta, const Visit& visit) {
    using std::exp;
    const T c = T(-1) / (theta[1] * theta[1]);
    for (Eigen::Index b = 1; b < state.q.cols(); ++b)
      for (Eigen::Index a = 0; a < b; ++a) {
        const VectorOf<T> z = state.q.col(a) - state.q.col(b);
        visit(a, b, z, T(exp(c * z.dot(z))));
      }
  }
};

}  // namespace

NoiseTable::Row kunita() {
  return {"kunita",
          {{"beta", "", "amplitude, length per square root of time; 2%: of the diameter", true},
           {"width", "auto", "of fields exp(-|x - q_b|^2/width^2); auto: diameter/4", true}},
          "h = beta p_a^j exp(-|q_a - q_b|^2/width^2): fields about the landmarks, that move with them (Kunita flows)",
          [](const Parameters& parameters, const Landmarks& shape) {
            const double size = shape.count() > 1 ? diameter(shape.points) : 0;
            const double automatic = size > 0 ? size / 4 : 1;  // of one landmark any will do
            const double width = parameters.is_auto("width") ? automatic : parameters.positive("width");
            return make_differentiated(Kunita(), {parameters.positive("beta"), width});
          }};
}

}  // namespace pulson
