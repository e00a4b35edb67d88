// The noise p-sd of bumps for any scalar T: numbers, Duals, and vectors of lanes. As pair_noises_body.hpp, whose
// constants it has, with c = −2/width².
#if defined(PULSON_BUMP_NOISE_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_BUMP_NOISE_BODY
#undef PULSON_BUMP_NOISE_BODY
#else
#define PULSON_BUMP_NOISE_BODY
#endif

#include "noise/bump_fields.hpp"
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
  static std::size_t MemorySize(std::size_t n, const BumpTicks& ticks) {
    return n * (ticks.of_centre.size() / d + ticks.ticks.size() + d * d) + ticks.ticks.size();
  }

  BumpNoise(std::size_t n, const BumpTicks& ticks, const PairNoiseConstants<T>& constants, T* memory)
      : n_(n),
        bumps_(ticks.of_centre.size() / d),
        ticks_(ticks),
        constants_(constants),
        phi_(memory),
        off_(phi_ + n * bumps_),
        bend_(off_ + n * ticks.ticks.size()),
        factor_(bend_ + d * d * n) {}

  // To positions. @param constant x ↦ T @param exponential s ↦ exp(−s/width²)
  template <class Constant, class Exponential>
  HWY_INLINE void MoveTo(const T* q, const Constant& constant, const Exponential& exponential) {
    T* phi = phi_;
    T* off = off_;
    for (std::size_t a = 0; a < n_; ++a, off += ticks_.ticks.size()) {
      for (std::size_t j = 0; j < d; ++j)
        for (std::size_t i = ticks_.first[j]; i < ticks_.first[j + 1]; ++i) {
          const T difference = q[a * d + j] - constant(ticks_.ticks[i]);
          factor_[i] = exponential(difference * difference);
          off[i] = constants_.c * difference;
        }
      const std::size_t* of_centre = ticks_.of_centre.data();
      for (std::size_t f = 0; f < bumps_; ++f, ++phi, of_centre += d) {
        T value = factor_[of_centre[0]];
        for (int j = 1; j < d; ++j) value = value * factor_[of_centre[j]];
        *phi = value;
      }
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
    for (std::size_t a = 0; a < n_; ++a) {
      T sum[d * d];
      for (int j = 0; j < d * d; ++j) sum[j] = constants_.zero;
      ForEachBump(a, [&](std::size_t f, const T& phi, const T* off) HWY_ATTR {
        for (int i = 0; i < d; ++i) {
          const T part = phi * T(w[f * d + i]);
          for (int j = 0; j < d; ++j) sum[i * d + j] = sum[i * d + j] + part * off[j];
        }
      });
      for (int j = 0; j < d * d; ++j) bend_[a * d * d + j] = constants_.beta * sum[j];
    }
  }

  // h_w,q
  HWY_INLINE void AddForce(const T* p, T* by_q) const {
    for (std::size_t a = 0; a < n_; ++a)
      for (int i = 0; i < d; ++i)
        for (int j = 0; j < d; ++j) by_q[a * d + j] = by_q[a * d + j] + p[a * d + i] * bend_[(a * d + i) * d + j];
  }

  // G_p
  HWY_INLINE void AddCompensationVelocity(T* by_p) const {
    for (std::size_t a = 0; a < n_; ++a) {
      T sum[d];
      for (int j = 0; j < d; ++j) sum[j] = constants_.zero;
      ForEachBump(a, [&](std::size_t, const T& phi, const T* off) HWY_ATTR {
        const T squared = phi * phi;
        for (int j = 0; j < d; ++j) sum[j] = sum[j] + squared * off[j];
      });
      for (int j = 0; j < d; ++j) by_p[a * d + j] = by_p[a * d + j] + constants_.quarter * sum[j];
    }
  }

  // G_q: φ ∇²φ p = cφ² p + (∇φ·p) ∇φ, as ∇φ = cφ (x − c_f). As G_p is the gradient of a function, this is its change
  // along a change p of positions, too.
  HWY_INLINE void AddCompensationForce(const T* p, T* by_q) const {
    for (std::size_t a = 0; a < n_; ++a) {
      T sum[d];
      T squares = constants_.zero;
      for (int j = 0; j < d; ++j) sum[j] = constants_.zero;
      ForEachBump(a, [&](std::size_t, const T& phi, const T* off) HWY_ATTR {
        const T squared = phi * phi;
        squares = squares + squared;
        const T along = squared * Dot<d>(off, p + a * d);
        for (int j = 0; j < d; ++j) sum[j] = sum[j] + along * off[j];
      });
      for (int j = 0; j < d; ++j)
        by_q[a * d + j] =
            by_q[a * d + j] + constants_.quarter * (sum[j] + sum[j] + constants_.c * squares * p[a * d + j]);
    }
  }

 private:
  // visit(f, φ_f, c (x − c_f)) at landmark a: ∇φ_f is their product.
  template <class Visit>
  HWY_INLINE void ForEachBump(std::size_t a, const Visit& visit) const {
    const T* const phi = phi_ + a * bumps_;
    const T* const off = off_ + a * ticks_.ticks.size();
    const std::size_t* of_centre = ticks_.of_centre.data();
    for (std::size_t f = 0; f < bumps_; ++f, of_centre += d) {
      T of_axes[d];
      for (int j = 0; j < d; ++j) of_axes[j] = off[of_centre[j]];
      visit(f, phi[f], of_axes);
    }
  }

  std::size_t n_, bumps_;
  const BumpTicks& ticks_;
  PairNoiseConstants<T> constants_;
  T *phi_, *off_, *bend_, *factor_;
};

}  // namespace HWY_NAMESPACE
}  // namespace pulson
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_BUMP_NOISE_BODY
