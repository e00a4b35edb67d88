// The noise p-sd of bumps for any scalar T: numbers, Duals, and vectors of lanes. As pair_noises_body.hpp, whose
// constants it has, with c = −2/width².
#if defined(PULSON_BUMP_NOISE_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_BUMP_NOISE_BODY
#undef PULSON_BUMP_NOISE_BODY
#else
#define PULSON_BUMP_NOISE_BODY
#endif

#include "noise/pair_noises_body.hpp"

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson {
namespace HWY_NAMESPACE {

// h = β Σ_a p_a^j φ_f(q_a) for each bump f and axis j, axis fastest; G = ¼β² Σ_a p_a·Σ_f φ_f ∇φ_f. Use MoveTo() first.
template <int d, class T>
class BumpNoise {
 public:
  static std::size_t MemorySize(std::size_t n, std::size_t bumps) { return n * (bumps * (1 + d) + d * d); }

  BumpNoise(std::size_t n, std::size_t bumps, const PairNoiseConstants<T>& constants, T* memory)
      : n_(n), bumps_(bumps), constants_(constants), phi_(memory), slope_(memory + n * bumps), bend_(slope_ + d * n * bumps) {}

  // To positions. @param exponential φ: |x − c_f|² ↦ φ @param centres d×F, f·d + axis
  template <class Centre, class Exponential>
  HWY_INLINE void MoveTo(const T* q, const Centre& centre, const Exponential& exponential) {
    T* phi = phi_;
    T* slope = slope_;
    for (std::size_t a = 0; a < n_; ++a)
      for (std::size_t f = 0; f < bumps_; ++f, ++phi, slope += d) {
        T off[d];
        for (int j = 0; j < d; ++j) off[j] = q[a * d + j] - centre(f * d + j);
        *phi = exponential(Dot<d>(off, off));
        const T factor = constants_.c * *phi;
        for (int j = 0; j < d; ++j) slope[j] = factor * off[j];
      }
  }

  // h_w,p
  template <class W>
  HWY_INLINE void AddVelocity(const W* w, T* by_p) const {
    const T* phi = phi_;
    for (std::size_t a = 0; a < n_; ++a) {
      T sum[d];
      for (int j = 0; j < d; ++j) sum[j] = constants_.zero;
      for (std::size_t f = 0; f < bumps_; ++f, ++phi)
        for (int j = 0; j < d; ++j) sum[j] = sum[j] + *phi * T(w[f * d + j]);
      for (int j = 0; j < d; ++j) by_p[a * d + j] = by_p[a * d + j] + constants_.beta * sum[j];
    }
  }

  // Keeps β Σ_f w_f ∇φ_fᵀ of each landmark, for the increments of the forces that follow.
  template <class W>
  HWY_INLINE void TakeIncrements(const W* w) {
    const T* slope = slope_;
    for (std::size_t a = 0; a < n_; ++a) {
      T sum[d * d];
      for (int j = 0; j < d * d; ++j) sum[j] = constants_.zero;
      for (std::size_t f = 0; f < bumps_; ++f, slope += d)
        for (int i = 0; i < d; ++i)
          for (int j = 0; j < d; ++j) sum[i * d + j] = sum[i * d + j] + T(w[f * d + i]) * slope[j];
      for (int j = 0; j < d * d; ++j) bend_[a * d * d + j] = constants_.beta * sum[j];
    }
  }

  // h_w,q
  HWY_INLINE void AddForce(const T* p, T* by_q) const {
    for (std::size_t a = 0; a < n_; ++a)
      for (int i = 0; i < d; ++i)
        for (int j = 0; j < d; ++j)
          by_q[a * d + j] = by_q[a * d + j] + p[a * d + i] * bend_[(a * d + i) * d + j];
  }

  // G_p
  HWY_INLINE void AddCompensationVelocity(T* by_p) const {
    const T* phi = phi_;
    const T* slope = slope_;
    for (std::size_t a = 0; a < n_; ++a) {
      T sum[d];
      for (int j = 0; j < d; ++j) sum[j] = constants_.zero;
      for (std::size_t f = 0; f < bumps_; ++f, ++phi, slope += d)
        for (int j = 0; j < d; ++j) sum[j] = sum[j] + *phi * slope[j];
      for (int j = 0; j < d; ++j) by_p[a * d + j] = by_p[a * d + j] + constants_.quarter * sum[j];
    }
  }

  // G_q: φ ∇²φ p = cφ² p + (∇φ·p) ∇φ, as ∇φ = cφ (x − c_f). As G_p is the gradient of a function, this is its change
  // along a change p of positions, too.
  HWY_INLINE void AddCompensationForce(const T* p, T* by_q) const {
    const T* phi = phi_;
    const T* slope = slope_;
    for (std::size_t a = 0; a < n_; ++a) {
      T sum[d];
      T squares = constants_.zero;
      for (int j = 0; j < d; ++j) sum[j] = constants_.zero;
      for (std::size_t f = 0; f < bumps_; ++f, ++phi, slope += d) {
        squares = squares + *phi * *phi;
        const T along = Dot<d>(slope, p + a * d);
        for (int j = 0; j < d; ++j) sum[j] = sum[j] + along * slope[j];
      }
      for (int j = 0; j < d; ++j)
        by_q[a * d + j] =
            by_q[a * d + j] + constants_.quarter * (sum[j] + sum[j] + constants_.c * squares * p[a * d + j]);
    }
  }

 private:
  std::size_t n_, bumps_;
  PairNoiseConstants<T> constants_;
  T *phi_, *slope_, *bend_;
};

}  // namespace HWY_NAMESPACE
}  // namespace pulson
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_BUMP_NOISE_BODY
