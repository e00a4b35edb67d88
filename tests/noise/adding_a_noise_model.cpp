#include <fmt/core.h>

#include "pulson/noise/differentiated_noise.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson {
namespace {

// h_jk = β Σ_a p_a^j q_a^k, j fastest: random linear maps turn, stretch and shear all of space about the origin.
struct Linear : NoiseFormula {
  std::vector<std::string> parameter_names() const { return {"beta"}; }
  std::string spec(const Eigen::VectorXd& theta) const { return fmt::format("linear:beta={}", theta[0]); }
  int channels(int dimension, int /*count*/) const { return dimension * dimension; }
  std::vector<NoiseAmplitude> amplitudes(int channels) const { return {NoiseAmplitude::of_all(0, channels)}; }
  NoiseTraits traits() const {
    return {.displacement = Displacement::field(),
            .moves_momenta = true,
            .additive = false,
            .compensated = true,
            .translation_invariant = false,
            .linear = true};
  }

  template <class T>
  void add_potentials(const StateOf<T>& state, const VectorOf<T>& theta, VectorOf<T>& h) const {
    const Eigen::Index d = state.q.rows();
    h.reshaped(d, d) += theta[0] * state.p.lazyProduct(state.q.transpose());
  }

  // h_w = β Σ_a p_a·Wq_a, where the matrix W holds the increments w.
  template <class T>
  void add_gradient(const StateOf<T>& state, const VectorOf<T>& theta, const Eigen::VectorXd& w,
                    StateOf<T>& gradient) const {
    const Eigen::Index d = state.q.rows();
    const MatrixOf<T> map = theta[0] * w.reshaped(d, d).template cast<T>();
    gradient.q += map.transpose().lazyProduct(state.p);
    gradient.p += map.lazyProduct(state.q);
  }

  // G = ¼ β² Σ_a p_a·q_a
  template <class T>
  void add_compensation_gradient(const StateOf<T>& state, const VectorOf<T>& theta, StateOf<T>& gradient) const {
    const T factor = T(0.25) * theta[0] * theta[0];
    gradient.q += factor * state.p;
    gradient.p += factor * state.q;
  }

  // The displacement is a field over space: h_w,p and G_p are known everywhere.
  template <class T>
  void add_spatial_noise(const MatrixOf<T>& x, const Points& /*q*/, const Eigen::VectorXd& theta,
                         const Eigen::VectorXd& w, MatrixOf<T>& field) const {
    const MatrixOf<T> map = (theta[0] * w).cast<T>().reshaped(x.rows(), x.rows());
    field += map.lazyProduct(x);
  }
  template <class T>
  void add_spatial_compensation(const MatrixOf<T>& x, const Points& /*q*/, const Eigen::VectorXd& theta,
                                MatrixOf<T>& field) const {
    field += T(0.25 * theta[0] * theta[0]) * x;
  }
};

}  // namespace

NoiseTable::Row linear() {
  return {"linear",
          {{"beta", "", "amplitude, one over the square root of time"}},
          "h = beta p_a^j q_a^k: random linear maps of space about the origin; flows stay diffeomorphic",
          [](const Parameters& parameters, const Landmarks&) {
            return make_differentiated(Linear(), {parameters.positive("beta")});
          }};
}

}  // namespace pulson
