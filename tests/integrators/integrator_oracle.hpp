#pragma once

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <ceres/jet.h>

#include "combinations.hpp"
#include "noise_definition.hpp"

namespace pulson {

/// The integrators written a second time, with plain loops over scalars of any type T: numbers or dual numbers. Vectors
/// have the index a·d + axis. The potentials of the noise are those of noise_definition.hpp, differentiated by dual
/// numbers. It throws std::logic_error for an integrator or kernel that it does not know: a new row needs its formula
/// here.
class Oracle {
 public:
  template <class T>
  struct State {
    std::vector<T> q;
    std::vector<T> p;
  };

  /// @param compensated whether the noise has G ≠ 0
  Oracle(std::string integrator, const DefinedNoise& noise, bool compensated, std::vector<KernelTerm> terms, int d,
         int n, TimeGrid grid)
      : integrator_(std::move(integrator)),
        noise_(noise),
        compensated_(compensated),
        terms_(std::move(terms)),
        d_(d),
        n_(n),
        steps_(grid.steps),
        dt_(grid.dt()) {}

  /// The state after K steps, adapted. @param dw increments, index k·channels + channel
  template <class T>
  State<T> run(const State<T>& start, const std::vector<T>& dw) const {
    if (integrator_ == "variational" || integrator_ == "variational-paper") return run_variational(start, dw);
    State<T> state = start;
    for (int k = 0; k < steps_; ++k) state = plain_step(state, part(dw, k));
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
      } else if (term.profile == KernelProfile::kMatern32) {
        const double c = std::sqrt(3.0) / term.alpha;
        const T r = sqrt(s);
        const T e = term.weight * exp(-c * r);
        value += (1.0 + c * r) * e;
        factor += -c * c * e;
      } else if (term.profile == KernelProfile::kMatern52) {
        const double c = std::sqrt(5.0) / term.alpha;
        const T r = sqrt(s);
        const T e = term.weight * exp(-c * r);
        value += (1.0 + c * r + c * c / 3.0 * s) * e;
        factor += -c * c / 3.0 * (1.0 + c * r) * e;
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
  static void add(State<T>& to, double factor, const State<T>& term) {
    for (std::size_t i = 0; i < to.q.size(); ++i) {
      to.q[i] += factor * term.q[i];
      to.p[i] += factor * term.p[i];
    }
  }

  // w_channel of step k; zero before the first and after the last.
  template <class T>
  std::vector<T> part(const std::vector<T>& dw, int k) const {
    const auto channels = static_cast<std::ptrdiff_t>(dw.size()) / steps_;
    if (k < 0 || k >= steps_) return std::vector<T>(static_cast<std::size_t>(channels), T(0));
    return {dw.begin() + k * channels, dw.begin() + (k + 1) * channels};
  }

  template <class T>
  static std::vector<T> joined(const State<T>& state) {
    std::vector<T> x = state.q;
    x.insert(x.end(), state.p.begin(), state.p.end());
    return x;
  }
  template <class T>
  std::vector<T> theta() const {
    std::vector<T> constants;
    for (const double value : noise_.theta()) constants.push_back(constant<T>(value));
    return constants;
  }
  // derivative(m) for each coordinate of x = (q, p).
  template <class T, class Derivative>
  static State<T> each(const State<T>& state, const Derivative& derivative) {
    State<T> all;
    const std::size_t half = state.q.size();
    for (std::size_t m = 0; m < half; ++m) {
      all.q.push_back(derivative(m));
      all.p.push_back(derivative(m + half));
    }
    return all;
  }

  // ∇h_w
  template <class T>
  State<T> noise_gradient(const State<T>& state, const std::vector<T>& w) const {
    return each(state, [&](std::size_t m) {
      const std::vector<T> slope = noise_.slopes(joined(state), theta<T>(), m);
      T sum(0);
      for (std::size_t i = 0; i < w.size(); ++i) sum += w[i] * slope[i];
      return sum;
    });
  }

  // ∇G
  template <class T>
  State<T> compensation_gradient(const State<T>& state) const {
    using Jet = ceres::Jet<T, 1>;
    const std::vector<T> x = joined(state);
    return each(state,
                [&](std::size_t m) { return noise_.compensation(moved(x, unit(x.size(), m)), theta<Jet>()).v[0]; });
  }

  // Δt J∇H + J∇h_w − λΔt H_p.
  template <class T>
  State<T> field(const State<T>& at, const std::vector<T>& w) const {
    State<T> velocity;
    vector_fields(at.q, at.p, velocity.q, velocity.p);
    State<T> sum{std::vector<T>(at.q.size(), T(0)), std::vector<T>(at.q.size(), T(0))};
    add(sum, dt_, velocity);
    add(sum, -noise_.friction() * dt_, {std::vector<T>(at.q.size(), T(0)), velocity.q});
    if (w.empty()) return sum;
    const State<T> h = noise_gradient(at, w);
    for (std::size_t i = 0; i < at.q.size(); ++i) {
      sum.q[i] += h.p[i];
      sum.p[i] -= h.q[i];
    }
    return sum;
  }

  // x with x = next(x), from x. The derivative parts of dual numbers converge one power of the iteration number later
  // than the values do.
  template <class X, class Next>
  static X fixed_point(X x, const Next& next) {
    for (int turn = 0; turn < kTurns; ++turn) x = next(x);
    return x;
  }

  // (20) as printed, in its own p: p⁰ from p̂⁰ = p⁰ + w_0 h_q(q⁰,p⁰), and at the end p̂ from p. Compensated: H + G for H.
  template <class T>
  State<T> run_variational(const State<T>& start, const std::vector<T>& dw) const {
    const bool compensated = integrator_ == "variational" && compensated_;
    const auto w = [&](int k) {
      std::vector<T> mean = part(dw, k);
      const std::vector<T> before = part(dw, k - 1);
      for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = 0.5 * mean[i] + 0.5 * before[i];
      return mean;
    };
    const auto kicked = [&](const State<T>& state, const std::vector<T>& w_k, double sign) {
      State<T> result = state;
      if (w_k.empty()) return result;
      const State<T> h = noise_gradient(state, w_k);
      for (std::size_t i = 0; i < result.p.size(); ++i) result.p[i] += sign * h.q[i];
      return result;
    };
    // The p of a state whose adapted momentum is p̂.
    const auto unadapted = [&](const State<T>& adapted, const std::vector<T>& w_k) {
      return fixed_point(adapted, [&](const State<T>& guess) {
        const State<T> at{adapted.q, guess.p};
        State<T> next = adapted;
        const State<T> h = w_k.empty() ? State<T>{{}, std::vector<T>()} : noise_gradient(at, w_k);
        for (std::size_t i = 0; i < h.q.size(); ++i) next.p[i] -= h.q[i];
        return next;
      });
    };

    State<T> state = unadapted(start, w(0));
    for (int k = 0; k < steps_; ++k) {
      std::vector<T> c = state.q;
      if (!w(k).empty()) {
        const State<T> h = noise_gradient(state, w(k));
        for (std::size_t i = 0; i < c.size(); ++i) c[i] += h.p[i];
      }
      const auto slopes = [&](const std::vector<T>& q) {
        State<T> sum;
        vector_fields(q, state.p, sum.q, sum.p);
        if (compensated) {
          const State<T> of_g = compensation_gradient(State<T>{q, state.p});
          for (std::size_t i = 0; i < q.size(); ++i) {
            sum.q[i] += of_g.p[i];
            sum.p[i] -= of_g.q[i];
          }
        }
        return sum;
      };
      const std::vector<T> q = fixed_point(state.q, [&](const std::vector<T>& guess) {
        const State<T> sum = slopes(guess);
        std::vector<T> next = c;
        for (std::size_t i = 0; i < c.size(); ++i) next[i] += dt_ * sum.q[i];
        return next;
      });
      const State<T> sum = slopes(q);
      State<T> velocity;
      vector_fields(q, state.p, velocity.q, velocity.p);
      State<T> adapted{q, state.p};
      for (std::size_t i = 0; i < c.size(); ++i)
        adapted.p[i] += dt_ * sum.p[i] - noise_.friction() * dt_ * velocity.q[i];
      state = unadapted(adapted, w(k + 1));
    }
    return kicked(state, w(steps_), 1);
  }

  template <class T>
  State<T> plain_step(const State<T>& state, const std::vector<T>& w) const {
    const auto plus = [&](double factor, const State<T>& term) {
      State<T> sum = state;
      add(sum, factor, term);
      return sum;
    };
    if (integrator_ == "midpoint") {
      const State<T> m = fixed_point(state, [&](const State<T>& guess) { return plus(0.5, field(guess, w)); });
      return plus(1, field(m, w));
    }
    if (integrator_ == "heun") {
      const State<T> k1 = field(state, w);
      State<T> next = plus(0.5, k1);
      add(next, 0.5, field(plus(1, k1), w));
      return next;
    }
    if (integrator_ == "rk4") {
      const State<T> k1 = field(state, w);
      const State<T> k2 = field(plus(0.5, k1), w);
      const State<T> k3 = field(plus(0.5, k2), w);
      State<T> next = plus(1.0 / 6, k1);
      add(next, 1.0 / 3, k2);
      add(next, 1.0 / 3, k3);
      add(next, 1.0 / 6, field(plus(1, k3), w));
      return next;
    }
    if (integrator_ != "stormer-verlet" && integrator_ != "variational-2")
      throw std::logic_error("no oracle of " + integrator_);
    const State<T> before = half_adjoint_step(state);
    return half_step(w.empty() ? before : noise_midpoint(before, w));
  }

  // p' = p − ½Δt (H_q + λH_p)(q,p'), q' = q + ½Δt H_p(q,p').
  template <class T>
  State<T> half_adjoint_step(const State<T>& state) const {
    const std::vector<T> none;
    State<T> end = state;
    end.p = fixed_point(state.p, [&](const std::vector<T>& guess) {
      State<T> next = state;
      add(next, 0.5, field(State<T>{state.q, guess}, none));
      return next.p;
    });
    State<T> moved = state;
    add(moved, 0.5, field(State<T>{state.q, end.p}, none));
    end.q = moved.q;
    return end;
  }

  // q⁺ = q + ½Δt H_p(q⁺,p), p⁺ = p − ½Δt (H_q + λH_p)(q⁺,p).
  template <class T>
  State<T> half_step(const State<T>& state) const {
    const std::vector<T> none;
    State<T> end = state;
    end.q = fixed_point(state.q, [&](const std::vector<T>& guess) {
      State<T> next = state;
      add(next, 0.5, field(State<T>{guess, state.p}, none));
      return next.q;
    });
    State<T> moved = state;
    add(moved, 0.5, field(State<T>{end.q, state.p}, none));
    end.p = moved.p;
    return end;
  }

  // z⁺ = z + J∇h_w(½(z + z⁺)).
  template <class T>
  State<T> noise_midpoint(const State<T>& state, const std::vector<T>& w) const {
    const auto plus = [&](double factor, const State<T>& at) {
      const State<T> h = noise_gradient(at, w);
      State<T> sum = state;
      for (std::size_t i = 0; i < sum.q.size(); ++i) {
        sum.q[i] += factor * h.p[i];
        sum.p[i] -= factor * h.q[i];
      }
      return sum;
    };
    return plus(1, fixed_point(state, [&](const State<T>& guess) { return plus(0.5, guess); }));
  }

  static constexpr int kTurns = 60;

  std::string integrator_;
  const DefinedNoise& noise_;
  bool compensated_;
  std::vector<KernelTerm> terms_;
  int d_;
  int n_;
  int steps_;
  double dt_;
};

}  // namespace pulson
