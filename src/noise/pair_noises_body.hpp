// The noises of pairs of landmarks, ch-sd-screened and kunita, for any scalar T: numbers, Duals, and vectors of lanes,
// whose numbers belong to different paths. Included once per vector target, so its guard toggles with the target; code
// that is not of a vector target includes it, too, for the other scalars.
//
// Arrays hold d coordinates of each landmark one after the other, index a·d + axis, and a number of each pair b < a at
// a(a − 1)/2 + b. No sum begins at zero: all add to what is there.
#if defined(PULSON_PAIR_NOISES_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_PAIR_NOISES_BODY
#undef PULSON_PAIR_NOISES_BODY
#else
#define PULSON_PAIR_NOISES_BODY
#endif

#include <cstddef>

#include <hwy/highway.h>

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson {
namespace HWY_NAMESPACE {

// Constants of a noise of pairs whose potentials have exp(−|z|²/range).
template <class T>
struct PairNoiseConstants {
  T zero;
  T beta;
  T quarter;  // ¼β²
  T c;        // −2/range
};

// z = x − y and |z|²
template <int d, class T>
HWY_INLINE T Subtract(const T* x, const T* y, T* z) {
  for (int j = 0; j < d; ++j) z[j] = x[j] - y[j];
  T squared = z[0] * z[0];
  for (int j = 1; j < d; ++j) squared = squared + z[j] * z[j];
  return squared;
}

template <int d, class T>
HWY_INLINE void Copy(const T* from, T* to) {
  for (int j = 0; j < d; ++j) to[j] = from[j];
}

template <int d, class T>
HWY_INLINE T Dot(const T* x, const T* y) {
  T sum = x[0] * y[0];
  for (int j = 1; j < d; ++j) sum = sum + x[j] * y[j];
  return sum;
}

// a += x, b −= x
template <int d, class T>
HWY_INLINE void Exchange(const T* x, T* a, T* b) {
  for (int j = 0; j < d; ++j) {
    a[j] = a[j] + x[j];
    b[j] = b[j] - x[j];
  }
}

// h = β p_a^j s_a(q) for each chosen a and axis j, s_a = Σ_b e_ab, e = exp(−|q_a − q_b|²/γ), over the b that screen a;
// G = ¼β² Σ_a s_a p_a·g_a with g_a = ∂s_a/∂q_a, over the chosen a. Use MoveTo() first.
template <int d, class T>
class ScreenedNoise {
 public:
  // The T's that it works in.
  static std::size_t MemorySize(std::size_t n) { return n * (n - 1) / 2 + n * (3 + 2 * d); }

  ScreenedNoise(std::size_t n, const PairNoiseConstants<T>& constants, T* memory)
      : n_(n),
        constants_(constants),
        e_(memory),
        s_(e_ + n * (n - 1) / 2),
        pull_(s_ + n),
        of_s_(pull_ + n),
        g_(of_s_ + n),
        of_g_(g_ + d * n) {}

  // To positions. @param screens whether a and b do: (a, b) @param exponential e: (a, b, pair, |z|²)
  template <class Screens, class Exponential>
  HWY_INLINE void MoveTo(const T* q, const Screens& screens, const Exponential& exponential) {
    q_ = q;
    for (std::size_t a = 0; a < n_; ++a) s_[a] = constants_.zero;
    for (std::size_t i = 0; i < d * n_; ++i) g_[i] = constants_.zero;
    T* e = e_;
    for (std::size_t a = 1; a < n_; ++a) {
      T x[d], g[d], z[d], slope[d];
      Copy<d>(q + a * d, x);
      Copy<d>(g_ + a * d, g);
      T s = s_[a];
      for (std::size_t b = 0; b < a; ++b, ++e) {
        if (!screens(a, b)) {
          *e = constants_.zero;
          continue;
        }
        const T value = exponential(a, b, Subtract<d>(x, q + b * d, z));
        *e = value;
        s = s + value;
        s_[b] = s_[b] + value;
        for (int j = 0; j < d; ++j) slope[j] = value * z[j];
        Exchange<d>(slope, g, g_ + b * d);
      }
      s_[a] = s;
      Copy<d>(g, g_ + a * d);
    }
    for (std::size_t i = 0; i < d * n_; ++i) g_[i] = constants_.c * g_[i];
  }

  // h_w,p @param on the chosen landmarks, i ↦ a
  template <class Choice, class W>
  HWY_INLINE void AddVelocity(std::size_t chosen, const Choice& on, const W* w, T* by_p) const {
    for (std::size_t i = 0; i < chosen; ++i) {
      const std::size_t a = on(i);
      const T strength = constants_.beta * s_[a];
      for (int j = 0; j < d; ++j) by_p[a * d + j] = by_p[a * d + j] + strength * T(w[i * d + j]);
    }
  }

  // h_w,q
  template <class Choice, class W>
  HWY_INLINE void AddForce(std::size_t chosen, const Choice& on, const T* p, const W* w, T* by_q) const {
    for (std::size_t a = 0; a < n_; ++a) pull_[a] = constants_.zero;  // cβ w_a·p_a
    for (std::size_t i = 0; i < chosen; ++i) {
      T along = T(w[i * d]) * p[on(i) * d];
      for (int j = 1; j < d; ++j) along = along + T(w[i * d + j]) * p[on(i) * d + j];
      pull_[on(i)] = constants_.c * constants_.beta * along;
    }
    const T* e = e_;
    for (std::size_t a = 1; a < n_; ++a) {
      T x[d], force[d], z[d], part[d];
      Copy<d>(q_ + a * d, x);
      Copy<d>(by_q + a * d, force);
      const T pull = pull_[a];
      for (std::size_t b = 0; b < a; ++b, ++e) {
        Subtract<d>(x, q_ + b * d, z);
        const T slope = *e * (pull + pull_[b]);
        for (int j = 0; j < d; ++j) part[j] = slope * z[j];
        Exchange<d>(part, force, by_q + b * d);
      }
      Copy<d>(force, by_q + a * d);
    }
  }

  // G_p
  template <class Choice>
  HWY_INLINE void AddCompensationVelocity(std::size_t chosen, const Choice& on, T* by_p) const {
    for (std::size_t i = 0; i < chosen; ++i) {
      const std::size_t a = on(i);
      const T strength = constants_.quarter * s_[a];
      for (int j = 0; j < d; ++j) by_p[a * d + j] = by_p[a * d + j] + strength * g_[a * d + j];
    }
  }

  // G_q, by ∂G/∂s_a = ¼β² p_a·g_a and ∂G/∂g_a = ¼β² s_a p_a.
  template <class Choice>
  HWY_INLINE void AddCompensationForce(std::size_t chosen, const Choice& on, const T* p, T* by_q) const {
    for (std::size_t a = 0; a < n_; ++a) of_s_[a] = constants_.zero;
    for (std::size_t i = 0; i < d * n_; ++i) of_g_[i] = constants_.zero;
    for (std::size_t i = 0; i < chosen; ++i) {
      const std::size_t a = on(i);
      of_s_[a] = constants_.quarter * Dot<d>(p + a * d, g_ + a * d);
      const T strength = constants_.quarter * s_[a];
      for (int j = 0; j < d; ++j) of_g_[a * d + j] = strength * p[a * d + j];
    }
    const T* e = e_;
    for (std::size_t a = 1; a < n_; ++a) {
      T x[d], force[d], of_g[d], z[d], v[d], part[d];
      Copy<d>(q_ + a * d, x);
      Copy<d>(by_q + a * d, force);
      Copy<d>(of_g_ + a * d, of_g);
      const T of_s = of_s_[a];
      for (std::size_t b = 0; b < a; ++b, ++e) {
        Subtract<d>(x, q_ + b * d, z);
        Subtract<d>(of_g, of_g_ + b * d, v);
        const T slope = constants_.c * *e;
        const T along = slope * (of_s + of_s_[b] + constants_.c * Dot<d>(z, v));
        for (int j = 0; j < d; ++j) part[j] = along * z[j] + slope * v[j];
        Exchange<d>(part, force, by_q + b * d);
      }
      Copy<d>(force, by_q + a * d);
    }
  }

  // The change of G_p along a change t of positions, by those of s and g.
  template <class Choice>
  HWY_INLINE void AddCompensationTangent(std::size_t chosen, const Choice& on, const T* t, T* by_p) const {
    for (std::size_t a = 0; a < n_; ++a) of_s_[a] = constants_.zero;
    for (std::size_t i = 0; i < d * n_; ++i) of_g_[i] = constants_.zero;
    const T* e = e_;
    for (std::size_t a = 1; a < n_; ++a) {
      T x[d], of_t[d], of_g[d], z[d], change[d], part[d];
      Copy<d>(q_ + a * d, x);
      Copy<d>(t + a * d, of_t);
      Copy<d>(of_g_ + a * d, of_g);
      T of_s = of_s_[a];
      for (std::size_t b = 0; b < a; ++b, ++e) {
        Subtract<d>(x, q_ + b * d, z);
        Subtract<d>(of_t, t + b * d, change);
        const T slope = constants_.c * *e;
        const T of_e = slope * Dot<d>(z, change);
        of_s = of_s + of_e;
        of_s_[b] = of_s_[b] + of_e;
        const T along_z = constants_.c * of_e;
        for (int j = 0; j < d; ++j) part[j] = slope * change[j] + along_z * z[j];
        Exchange<d>(part, of_g, of_g_ + b * d);
      }
      of_s_[a] = of_s;
      Copy<d>(of_g, of_g_ + a * d);
    }
    for (std::size_t i = 0; i < chosen; ++i) {
      const std::size_t a = on(i);
      const T of_s = constants_.quarter * of_s_[a], s = constants_.quarter * s_[a];
      for (int j = 0; j < d; ++j) by_p[a * d + j] = by_p[a * d + j] + of_s * g_[a * d + j] + s * of_g_[a * d + j];
    }
  }

 private:
  std::size_t n_;
  PairNoiseConstants<T> constants_;
  const T* q_ = nullptr;
  T *e_, *s_, *pull_, *of_s_, *g_, *of_g_;
};

// h = β Σ_a p_a^j k(q_a − q_b) for each b and axis j, k(z) = exp(−|z|²/width²);
// G = ¼β² Σ_ab p_a·∇k(z) (k(z) − 1), z = q_a − q_b. Use MoveTo() first.
template <int d, class T>
class KunitaNoise {
 public:
  static std::size_t MemorySize(std::size_t n) { return n * (n - 1) / 2; }

  KunitaNoise(std::size_t n, const PairNoiseConstants<T>& constants, T* memory)
      : n_(n), constants_(constants), k_(memory) {}

  // To positions. @param exponential k: (a, b, |z|²)
  template <class Exponential>
  HWY_INLINE void MoveTo(const T* q, const Exponential& exponential) {
    q_ = q;
    T* k = k_;
    for (std::size_t a = 1; a < n_; ++a) {
      T x[d], z[d];
      Copy<d>(q + a * d, x);
      for (std::size_t b = 0; b < a; ++b) *k++ = exponential(a, b, Subtract<d>(x, q + b * d, z));
    }
  }

  // h_w,p = β Σ_b k(q_a − q_b) w_b
  template <class W>
  HWY_INLINE void AddVelocity(const W* w, T* by_p) const {
    const T* k = k_;
    for (std::size_t a = 0; a < n_; ++a) {
      T sum[d], of_a[d];
      for (int j = 0; j < d; ++j) {
        of_a[j] = constants_.beta * T(w[a * d + j]);
        sum[j] = by_p[a * d + j] + of_a[j];
      }
      for (std::size_t b = 0; b < a; ++b, ++k) {
        const T value = *k;
        const T strength = constants_.beta * value;
        for (int j = 0; j < d; ++j) {
          sum[j] = sum[j] + strength * T(w[b * d + j]);
          by_p[b * d + j] = by_p[b * d + j] + value * of_a[j];
        }
      }
      Copy<d>(sum, by_p + a * d);
    }
  }

  // h_w,q, of h_w = β Σ_ab p_a·w_b k(q_a − q_b)
  template <class W>
  HWY_INLINE void AddForce(const T* p, const W* w, T* by_q) const {
    const T factor = constants_.c * constants_.beta;
    const T* k = k_;
    for (std::size_t a = 1; a < n_; ++a) {
      T x[d], force[d], of_p[d], of_w[d], z[d], part[d];
      Copy<d>(q_ + a * d, x);
      Copy<d>(by_q + a * d, force);
      for (int j = 0; j < d; ++j) {
        of_p[j] = factor * p[a * d + j];
        of_w[j] = factor * T(w[a * d + j]);
      }
      for (std::size_t b = 0; b < a; ++b, ++k) {
        Subtract<d>(x, q_ + b * d, z);
        T both = of_p[0] * T(w[b * d]) + of_w[0] * p[b * d];
        for (int j = 1; j < d; ++j) both = both + of_p[j] * T(w[b * d + j]) + of_w[j] * p[b * d + j];
        const T slope = *k * both;
        for (int j = 0; j < d; ++j) part[j] = slope * z[j];
        Exchange<d>(part, force, by_q + b * d);
      }
      Copy<d>(force, by_q + a * d);
    }
  }

  // With s = 2/width²: G_p,a = −¼β²s Σ_b (k² − k) z.
  HWY_INLINE void AddCompensationVelocity(T* by_p) const {
    const T factor = constants_.quarter * constants_.c;  // −¼β²s
    const T* k = k_;
    for (std::size_t a = 1; a < n_; ++a) {
      T x[d], velocity[d], z[d], part[d];
      Copy<d>(q_ + a * d, x);
      Copy<d>(by_p + a * d, velocity);
      for (std::size_t b = 0; b < a; ++b, ++k) {
        Subtract<d>(x, q_ + b * d, z);
        const T along_z = factor * (*k * *k - *k);
        for (int j = 0; j < d; ++j) part[j] = along_z * z[j];
        Exchange<d>(part, velocity, by_p + b * d);
      }
      Copy<d>(velocity, by_p + a * d);
    }
  }

  // G_q,a = −¼β²s Σ_b ((k² − k) v − s (2k − 1) k z z·v), v = p_a − p_b. As G_p,a is the gradient of a function, this
  // is its change along a change p of positions, too.
  HWY_INLINE void AddCompensationForce(const T* p, T* by_q) const {
    const T factor = constants_.quarter * constants_.c;
    const T* k = k_;
    for (std::size_t a = 1; a < n_; ++a) {
      T x[d], of_p[d], force[d], z[d], v[d], part[d];
      Copy<d>(q_ + a * d, x);
      Copy<d>(p + a * d, of_p);
      Copy<d>(by_q + a * d, force);
      for (std::size_t b = 0; b < a; ++b, ++k) {
        Subtract<d>(x, q_ + b * d, z);
        Subtract<d>(of_p, p + b * d, v);
        const T bent = *k * *k - *k;
        const T along_v = factor * bent;
        const T along_z = factor * constants_.c * (*k * *k + bent) * Dot<d>(z, v);
        for (int j = 0; j < d; ++j) part[j] = along_v * v[j] + along_z * z[j];
        Exchange<d>(part, force, by_q + b * d);
      }
      Copy<d>(force, by_q + a * d);
    }
  }

 private:
  std::size_t n_;
  PairNoiseConstants<T> constants_;
  const T* q_ = nullptr;
  T* k_;
};

}  // namespace HWY_NAMESPACE
}  // namespace pulson
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_PAIR_NOISES_BODY
