#pragma once

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "combinations.hpp"

namespace pulson {

/// Equation (20) written a second time, with plain loops over scalars of any type T: numbers or dual numbers. Vectors
/// have the index a·d + axis. It knows the integrators, noises and kernels named in its constructor and in `kernel`,
/// and throws std::logic_error for any other: a new row needs its formula here.
class Oracle {
 public:
  template <class T>
  struct State {
    std::vector<T> q;
    std::vector<T> p;
  };

  Oracle(const Combination& combination, std::vector<KernelTerm> terms, int d, int n, double dt)
      : terms_(std::move(terms)), d_(d), n_(n), dt_(dt) {
    if (combination.integrator != "variational") throw std::logic_error("no oracle of " + combination.integrator);
    const Spec noise = parse_spec_sum(combination.noise, "noise").front();
    if (noise.name == "none") return;
    if (noise.name != "ch-sd") throw std::logic_error("no oracle of " + noise.name);
    beta_ = std::stod(noise.values.at("beta"));
    for (int a = 0; a < n; ++a)
      if (!noise.values.contains("on") || a == 0 || a == 2) moved_.push_back(a);
  }

  int channels() const { return d_ * static_cast<int>(moved_.size()); }

  /// The state after K steps. @param dw increments, index k·channels + channel
  template <class T>
  State<T> run(State<T> state, const std::vector<T>& dw, int steps) const {
    for (int k = 0; k < steps; ++k) step(state, dw, k);
    return state;
  }

 private:
  // K and the factor c of ∇K(z) = c z, at s = |z|² > 0.
  template <class T>
  void kernel(const T& s, T& value, T& factor) const {
    using std::exp;
    using std::sqrt;
    value = factor = T(0);
    for (const KernelTerm& term : terms_) {
      if (term.profile == KernelProfile::kGaussian) {
        const T k = term.weight * exp(-s / (term.alpha * term.alpha));
        value += k;
        factor += -2.0 * k / (term.alpha * term.alpha);
      } else if (term.profile == KernelProfile::kPeakon) {
        const T r = sqrt(s);
        const T k = term.weight * exp(-r / term.alpha);
        value += k;
        factor += -k / (term.alpha * r);
      } else {
        throw std::logic_error("no oracle of this kernel");
      }
    }
  }

  // velocity = K(q)p and force = −H_q(q,p).
  template <class T>
  void vector_fields(const std::vector<T>& q, const std::vector<T>& p, std::vector<T>& velocity,
                     std::vector<T>& force) const {
    velocity.assign(q.size(), T(0));
    force.assign(q.size(), T(0));
    double at_zero = 0;
    for (const KernelTerm& term : terms_) at_zero += term.weight;
    for (int a = 0; a < n_; ++a) {
      for (int b = 0; b < n_; ++b) {
        T s(0), dot(0), value(at_zero), factor(0);
        for (int i = 0; i < d_; ++i) {
          const T z = q[a * d_ + i] - q[b * d_ + i];
          s += z * z;
          dot += p[a * d_ + i] * p[b * d_ + i];
        }
        if (a != b) kernel(s, value, factor);
        for (int i = 0; i < d_; ++i) {
          velocity[a * d_ + i] += value * p[b * d_ + i];
          force[a * d_ + i] -= dot * factor * (q[a * d_ + i] - q[b * d_ + i]);
        }
      }
    }
  }

  template <class T>
  void step(State<T>& state, const std::vector<T>& dw, int k) const {
    std::vector<T> c = state.q;
    for (int i = 0; i < channels(); ++i) {
      T w = 0.5 * dw[k * channels() + i];
      if (k > 0) w += 0.5 * dw[(k - 1) * channels() + i];
      c[moved_[i / d_] * d_ + i % d_] += beta_ * w;
    }
    std::vector<T> velocity;
    std::vector<T> force;
    // The derivative parts of dual numbers converge one power of the iteration number later than the values do.
    for (int turn = 0; turn < kTurns; ++turn) {
      vector_fields(state.q, state.p, velocity, force);
      for (std::size_t i = 0; i < c.size(); ++i) state.q[i] = c[i] + dt_ * velocity[i];
    }
    vector_fields(state.q, state.p, velocity, force);
    for (std::size_t i = 0; i < c.size(); ++i) state.p[i] += dt_ * force[i];
  }

  static constexpr int kTurns = 100;

  std::vector<KernelTerm> terms_;
  int d_;
  int n_;
  double dt_;
  double beta_ = 0;
  std::vector<int> moved_;
};

}  // namespace pulson
