// Gaussian numbers as pure functions of (seed, path, step, channel), one counter per lane. Included once per vector
// target, by any folder that links pulson::random and Highway, so its guard toggles with the target.
//
//   const NormalLanes lanes(seed);
//   const NormalLanes::Counter counters[1] = {{path, block, channel}};
//   NormalLanes::Vector normals[1][4];
//   lanes.Draw(counters, normals);  // normals[0][s]: the numbers of step 4·block + s
//
// Its loops must unroll: compile with -O3.
#if defined(PULSON_NORMAL_LANES_BODY) == defined(HWY_TARGET_TOGGLE)
#ifdef PULSON_NORMAL_LANES_BODY
#undef PULSON_NORMAL_LANES_BODY
#else
#define PULSON_NORMAL_LANES_BODY
#endif

#include <cstdint>

#include <hwy/highway.h>

// Functions are named in Highway's style, which they extend.
// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// No product of the transform is a summand of a plain sum and the signs come last, so no compiler can contract a
// product with what a caller does to the number: a number has the same bits wherever this is inlined for one target.
class NormalLanes {
 public:
  using Tag = hn::ScalableTag<double>;
  using Vector = hn::Vec<Tag>;
  using WordTag = hn::RebindToUnsigned<Tag>;
  using Words = hn::Vec<WordTag>;

  // Path numbers of 64 bits; block numbers (step / 4) and channels of 32 bits in the low half of each lane.
  struct Counter {
    Words path, block, channel;
  };

  HWY_INLINE explicit NormalLanes(std::uint64_t seed) {
    for (int round = 0; round < kRounds; ++round) {
      const auto k = static_cast<std::uint32_t>(round);
      key_low_[round] = Word(static_cast<std::uint32_t>(seed) + k * 0x9E3779B9U);
      key_high_[round] = Word(static_cast<std::uint32_t>(seed >> 32U) + k * 0xBB67AE85U);
    }
  }

  static HWY_INLINE Words Word(std::uint64_t value) { return hn::Set(WordTag(), value); }

  // The numbers of steps 4·block + 0 … 3 for n vectors of counters. Two at a time hide the latencies.
  template <int n>
  HWY_INLINE void Draw(const Counter (&counters)[n], Vector (&normals)[n][4]) const {
    Words words[n][4];
    Philox(counters, words);
    for (int half = 0; half < 4; half += 2)
      for (int i = 0; i < n; ++i) BoxMuller(words[i][half], words[i][half + 1], normals[i][half], normals[i][half + 1]);
  }

  // Philox4x32-10: J. Salmon, M. Moraes, R. Dror, D. Shaw, Parallel random numbers: as easy as 1, 2, 3 (2011). The
  // counter is (path low, path high, block, channel), the key the halves of the seed, low first. The results are in the
  // low halves of the lanes; the high halves are not zero.
  template <int n>
  HWY_INLINE void Philox(const Counter (&counters)[n], Words (&words)[n][4]) const {
    const Words first_multiplier = Word(0xD2511F53U);
    const Words second_multiplier = Word(0xCD9E8D57U);
    for (int i = 0; i < n; ++i) {
      words[i][0] = counters[i].path;
      words[i][1] = hn::ShiftRight<32>(counters[i].path);
      words[i][2] = counters[i].block;
      words[i][3] = counters[i].channel;
    }
    for (int round = 0; round < kRounds; ++round) {
      for (int i = 0; i < n; ++i) {
        Words* x = words[i];
        const Words first = LowProduct(x[0], first_multiplier);
        const Words second = LowProduct(x[2], second_multiplier);
        x[0] = hn::Xor(hn::Xor(x[1], key_low_[round]), hn::ShiftRight<32>(second));
        x[1] = second;
        x[2] = hn::Xor(hn::Xor(x[3], key_high_[round]), hn::ShiftRight<32>(first));
        x[3] = first;
      }
    }
  }

  // The two numbers ±r cos θ and ±r sin θ, r = √(−2 ln u), of the words (the low halves of the lanes)
  //   radius: u = (radius + ½)/2³²
  //   angle:  θ = (π/2)(y + ½)/2³⁰, y its high 30 bits; bits 1 and 0 are the signs.
  // With φ = θ − π/4 they are √(−ln u)·(cos φ ∓ sin φ). The error is below 1e-15·r.
  static HWY_INLINE void BoxMuller(Words radius, Words angle, Vector& first, Vector& second) {
    const Vector r = hn::Sqrt(MinusLog(radius));
    // z = 4(y + ½) − 2³¹ = (2³²/(π/2)) φ, exactly: the bits of 2⁵² with the word, its two sign bits replaced by 10, as
    // the low end of the mantissa. Both polynomials are minimax on |φ| ≤ π/4, with coefficients scaled for z: cos of
    // degree 12 (error 6.4e-17), sin of degree 13 (1.4e-17).
    const Words bits = hn::Or(hn::And(angle, Word(0xFFFFFFFCU)), Word((0x433ULL << 52U) + 2));
    const Vector z = hn::Sub(hn::BitCast(Tag(), bits), Constant(0x1p52 + 0x1p31));
    const Vector z2 = hn::Mul(z, z);
    Vector cosine = Constant(0x1.f3ef4270c2969p-406);
    cosine = hn::MulAdd(cosine, z2, Constant(-0x1.a6ca0096cedc6p-336));
    cosine = hn::MulAdd(cosine, z2, Constant(0x1.e1f4fbfc0279cp-267));
    cosine = hn::MulAdd(cosine, z2, Constant(-0x1.55d3c7dcb5f6ap-198));
    cosine = hn::MulAdd(cosine, z2, Constant(0x1.03c1f081b14bep-130));
    cosine = hn::MulAdd(cosine, z2, Constant(-0x1.3bd3cc9be45a5p-64));
    cosine = hn::MulAdd(cosine, z2, Constant(1.0));
    Vector sine = Constant(0x1.e3988762f001cp-441);
    sine = hn::MulAdd(sine, z2, Constant(-0x1.e2ff49f8baa96p-371));
    sine = hn::MulAdd(sine, z2, Constant(0x1.50782e68690a1p-301));
    sine = hn::MulAdd(sine, z2, Constant(-0x1.32d2cce12a11bp-232));
    sine = hn::MulAdd(sine, z2, Constant(0x1.466bc6775679ep-164));
    sine = hn::MulAdd(sine, z2, Constant(-0x1.4abbce625be21p-97));
    sine = hn::MulAdd(sine, z2, Constant(0x1.921fb54442d18p-32));
    const Vector cos_theta = hn::NegMulAdd(sine, z, cosine);
    const Vector sin_theta = hn::MulAdd(sine, z, cosine);
    first = hn::CopySignToAbs(hn::Mul(r, cos_theta), hn::BitCast(Tag(), hn::ShiftLeft<62>(angle)));
    second = hn::CopySignToAbs(hn::Mul(r, sin_theta), hn::BitCast(Tag(), hn::ShiftLeft<63>(angle)));
  }

 private:
  static constexpr int kRounds = 10;

  static HWY_INLINE Vector Constant(double value) { return hn::Set(Tag(), value); }

  // The products of the low halves of the lanes.
  static HWY_INLINE Words LowProduct(Words a, Words b) {
#if HWY_TARGET == HWY_SCALAR
    return Word((hn::GetLane(a) & 0xFFFFFFFFU) * (hn::GetLane(b) & 0xFFFFFFFFU));
#else
    const hn::Repartition<std::uint32_t, Tag> halves;
    return hn::MulEven(hn::BitCast(halves, a), hn::BitCast(halves, b));
#endif
  }

  // 2⁵² + the low half of each lane: the bits of 2⁵² with that word as the low end of the mantissa.
  static HWY_INLINE Vector AboveTwoTo52(Words word) {
    const Words bits_of_two_to_52 = Word(0x433ULL << 52U);
#if HWY_TARGET == HWY_SCALAR
    return hn::BitCast(Tag(), hn::Or(hn::And(word, Word(0xFFFFFFFFU)), bits_of_two_to_52));
#else
    const hn::Repartition<std::uint32_t, Tag> halves;
    return hn::BitCast(Tag(), hn::OddEven(hn::BitCast(halves, bits_of_two_to_52), hn::BitCast(halves, word)));
#endif
  }

  // −ln((word + ½)/2³²), relative error below 5e-16. word + ½ = 2ⁿ⁺³² m with √½ ≤ m < √2, so that n = 0 where the
  // result is small, and m comes out exactly. −ln m = s P(s²) with s = (m − 1)/(m + 1), P of degree 6, minimax with
  // P(0) = −2 (1.9e-16).
  static HWY_INLINE Vector MinusLog(Words word) {
    constexpr std::uint64_t kRootHalf = 0x3FE6A09E667F3BCDULL;
    const Vector w = hn::Sub(AboveTwoTo52(word), Constant(0x1p52 - 0.5));
    // The exponent is n + 33 ≥ 0, the mantissa that of m/√½.
    const Words scaled = hn::Add(hn::BitCast(WordTag(), w), Word((1ULL << 52U) - kRootHalf));
    const Vector n = hn::Sub(AboveTwoTo52(hn::ShiftRight<52>(scaled)), Constant(0x1p52 + 33));
    const Words mantissa = hn::And(scaled, Word((1ULL << 52U) - 1));
    const Vector m = hn::BitCast(Tag(), hn::Add(mantissa, Word(kRootHalf)));
    const Vector s = hn::Div(hn::Sub(m, Constant(1.0)), hn::Add(m, Constant(1.0)));
    const Vector s2 = hn::Mul(s, s);
    Vector p = Constant(-0x1.587591c4b744fp-3);
    p = hn::MulAdd(p, s2, Constant(-0x1.732c5226a6db4p-3));
    p = hn::MulAdd(p, s2, Constant(-0x1.c7227697992bap-3));
    p = hn::MulAdd(p, s2, Constant(-0x1.2492417a9a9b7p-2));
    p = hn::MulAdd(p, s2, Constant(-0x1.999999a28e928p-2));
    p = hn::MulAdd(p, s2, Constant(-0x1.555555555397ap-1));
    p = hn::MulAdd(p, s2, Constant(-2.0));
    return hn::MulAdd(s, p, hn::Mul(n, Constant(-0x1.62e42fefa39efp-1)));
  }

  Words key_low_[kRounds];
  Words key_high_[kRounds];
};

}  // namespace HWY_NAMESPACE
}  // namespace pulson
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#endif  // PULSON_NORMAL_LANES_BODY
