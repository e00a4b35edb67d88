// Random numbers: Philox against Random123, the transform against its formula, the same bits in every batch. The vector
// code is compiled here once more, as other folders do.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "random_test.cpp"
#include <hwy/foreach_target.h>
// clang-format off
#include <hwy/highway.h>
#include "normal_lanes_body.hpp"
// clang-format on

// NOLINTBEGIN(readability-identifier-naming)
HWY_BEFORE_NAMESPACE();
namespace pulson {
namespace HWY_NAMESPACE {

// Words x₀ … x₃ of one counter, which the first lane holds; the others hold other counters.
void PhiloxWords(std::uint64_t seed, std::uint64_t path, std::uint32_t block, std::uint32_t channel,
                 std::uint32_t* words) {
  const NormalLanes lanes(seed);
  const NormalLanes::Words index = hn::Iota(NormalLanes::WordTag(), 0);
  const NormalLanes::Counter counters[1] = {{hn::Add(NormalLanes::Word(path), index),
                                             hn::Add(NormalLanes::Word(block), index),
                                             hn::Add(NormalLanes::Word(channel), index)}};
  NormalLanes::Words lane_words[1][4];
  lanes.Philox(counters, lane_words);
  for (int j = 0; j < 4; ++j) words[j] = static_cast<std::uint32_t>(hn::GetLane(lane_words[0][j]));
}

// The transform of the low halves of the words; count is a multiple of all lane counts.
void Transform(const std::uint64_t* radius, const std::uint64_t* angle, std::size_t count, double* first,
               double* second) {
  const NormalLanes::Tag d;
  const NormalLanes::WordTag w;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    NormalLanes::Vector a, b;
    NormalLanes::BoxMuller(hn::LoadU(w, radius + i), hn::LoadU(w, angle + i), a, b);
    hn::StoreU(a, d, first + i);
    hn::StoreU(b, d, second + i);
  }
}

// Sums over the four steps of a block, as an integrator forms them: they must see the numbers that the library stores.
void DrawInlined(std::uint64_t seed, std::uint64_t first_path, std::uint32_t block, std::uint32_t channel,
                 std::size_t paths, double* sum) {
  const NormalLanes lanes(seed);
  const NormalLanes::Tag d;
  for (std::size_t i = 0; i < paths; i += hn::Lanes(d)) {
    const NormalLanes::Counter counters[1] = {
        {hn::Iota(NormalLanes::WordTag(), first_path + i), NormalLanes::Word(block), NormalLanes::Word(channel)}};
    NormalLanes::Vector normals[1][4];
    lanes.Draw(counters, normals);
    hn::StoreU(hn::Add(hn::Add(normals[0][0], normals[0][1]), hn::Add(normals[0][2], normals[0][3])), d, sum + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace pulson
HWY_AFTER_NAMESPACE();
// NOLINTEND(readability-identifier-naming)

#if HWY_ONCE

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>
#include <random>
#include <set>
#include <vector>

#include <Random123/philox.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "forced_target.hpp"
#include "random/normals.hpp"

namespace pulson {

HWY_EXPORT(PhiloxWords);
HWY_EXPORT(Transform);
HWY_EXPORT(DrawInlined);

namespace {

void for_every_target(const std::function<void()>& check) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    SCOPED_TRACE(hwy::TargetName(target));
    const ForcedTarget forced(target);
    check();
  }
}

// ---- the generator

using FourWords = std::array<std::uint32_t, 4>;

FourWords philox_words(std::uint64_t seed, std::uint64_t path, std::uint32_t block, std::uint32_t channel) {
  FourWords words;
  HWY_DYNAMIC_DISPATCH(PhiloxWords)(seed, path, block, channel, words.data());
  return words;
}

FourWords random123_words(std::uint64_t seed, std::uint64_t path, std::uint32_t block, std::uint32_t channel) {
  const philox4x32_ctr_t counter = {
      {static_cast<std::uint32_t>(path), static_cast<std::uint32_t>(path >> 32U), block, channel}};
  const philox4x32_key_t key = {{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U)}};
  const philox4x32_ctr_t words = philox4x32(counter, key);
  return {words[0], words[1], words[2], words[3]};
}

TEST(Philox, GivesItsKnownAnswers) {
  constexpr std::uint64_t kOnes = ~std::uint64_t{0};
  for_every_target([] {
    EXPECT_EQ(philox_words(0, 0, 0, 0), (FourWords{0x6627E8D5U, 0xE169C58DU, 0xBC57AC4CU, 0x9B00DBD8U}));
    EXPECT_EQ(philox_words(kOnes, kOnes, 0xFFFFFFFFU, 0xFFFFFFFFU),
              (FourWords{0x408F276DU, 0x41C83B0EU, 0xA20BC7C6U, 0x6D5451FDU}));
    EXPECT_EQ(philox_words(0x299F31D0A4093822U, 0x85A308D3243F6A88U, 0x13198A2EU, 0x03707344U),
              (FourWords{0xD16CFE09U, 0x94FDCCEBU, 0x5001E420U, 0x24126EA1U}));
  });
}

TEST(Philox, GivesTheWordsOfRandom123) {
  std::mt19937_64 any(1);
  for_every_target([&any] {
    for (int i = 0; i < 10'000; ++i) {
      const std::uint64_t seed = any(), path = any(), last = any();
      const auto block = static_cast<std::uint32_t>(last), channel = static_cast<std::uint32_t>(last >> 32U);
      ASSERT_EQ(philox_words(seed, path, block, channel), random123_words(seed, path, block, channel));
    }
  });
}

// ---- the transform

struct Pair {
  long double first, second, r;
};

Pair box_muller(std::uint32_t radius, std::uint32_t angle) {
  const long double r = std::sqrt(-2 * std::log((radius + 0.5L) * 0x1p-32L));
  const long double theta = std::numbers::pi_v<long double> / 2 * (((angle >> 2U) + 0.5L) * 0x1p-30L);
  const long double first = r * std::cos(theta);
  const long double second = r * std::sin(theta);
  return {(angle & 2U) != 0 ? -first : first, (angle & 1U) != 0 ? -second : second, r};
}

// Words at the ends and the seams of the transform, and random ones; the high halves must not matter.
struct Words {
  std::vector<std::uint64_t> radius, angle;
};

Words words_to_transform(std::size_t count) {
  std::vector<std::uint64_t> extreme;
  for (const std::uint64_t base :
       {0x0ULL, 0x20000000ULL, 0x40000000ULL, 0x80000000ULL, 0xC0000000ULL, 0xB504F333ULL, 0x5A827999ULL})
    for (std::uint64_t k = 0; k < 8; ++k) extreme.push_back((base + k - 4) & 0xFFFFFFFFU);
  for (unsigned bit = 0; bit < 32; ++bit) extreme.push_back(1ULL << bit);
  Words words;
  std::mt19937_64 any(2);
  for (const std::uint64_t radius : extreme)
    for (const std::uint64_t angle : extreme) {
      words.radius.push_back(radius | any() << 32U);
      words.angle.push_back(angle | any() << 32U);
    }
  while (words.radius.size() < count) {
    words.radius.push_back(any());
    words.angle.push_back(any());
  }
  return words;
}

TEST(Transform, IsBoxMuller) {
  constexpr std::size_t kCount = 1U << 19U;
  const Words words = words_to_transform(kCount);
  std::vector<Pair> expected;
  for (std::size_t i = 0; i < kCount; ++i)
    expected.push_back(
        box_muller(static_cast<std::uint32_t>(words.radius[i]), static_cast<std::uint32_t>(words.angle[i])));
  std::vector<double> first(kCount), second(kCount);
  for_every_target([&] {
    HWY_DYNAMIC_DISPATCH(Transform)(words.radius.data(), words.angle.data(), kCount, first.data(), second.data());
    long double worst = 0;
    for (std::size_t i = 0; i < kCount; ++i) {
      worst = std::max(worst, std::abs(first[i] - expected[i].first) / expected[i].r);
      worst = std::max(worst, std::abs(second[i] - expected[i].second) / expected[i].r);
      ASSERT_EQ(std::signbit(first[i]), std::signbit(expected[i].first)) << i;
      ASSERT_EQ(std::signbit(second[i]), std::signbit(expected[i].second)) << i;
    }
    EXPECT_LE(worst, 1e-15);
  });
}

TEST(Transform, GivesTheExtremes) {
  for_every_target([] {
    // The smallest and the largest radius, each with the angle next to 0 and the one next to π/2.
    const std::vector<std::uint64_t> radius = {0, 0, 0xFFFFFFFFU, 0xFFFFFFFFU, 0, 0, 0, 0};
    const std::vector<std::uint64_t> angle = {0, 0xFFFFFFFFU, 2, 0xFFFFFFFCU, 0, 0, 0, 0};
    std::vector<double> first(8), second(8);
    HWY_DYNAMIC_DISPATCH(Transform)(radius.data(), angle.data(), 8, first.data(), second.data());
    const double far = std::sqrt(66 * std::numbers::ln2), near = 0x1p-16;
    const double small = std::numbers::pi * 0x1p-32;
    EXPECT_NEAR(first[0], far, 1e-14);
    EXPECT_NEAR(second[0], far * small, 1e-14);
    EXPECT_NEAR(first[1], -far * small, 1e-14);
    EXPECT_NEAR(second[1], -far, 1e-14);
    EXPECT_NEAR(first[2], -near, 1e-10 * near);
    EXPECT_NEAR(second[2], near * small, 1e-15 * near);
    EXPECT_NEAR(first[3], near * small, 1e-15 * near);
    EXPECT_NEAR(second[3], near, 1e-10 * near);
  });
}

TEST(Normals, AreTheTransformOfTheWords) {
  const std::uint64_t seed = 0x123456789ABCDEF0U, path = 0xFEDCBA9876543210U;
  const Eigen::MatrixXd normals = standard_normals(seed, path, 3, 10);
  ASSERT_EQ(normals.rows(), 3);
  ASSERT_EQ(normals.cols(), 10);
  for (int channel = 0; channel < 3; ++channel)
    for (int step = 0; step < 10; step += 2) {
      const FourWords words =
          random123_words(seed, path, static_cast<std::uint32_t>(step / 4), static_cast<std::uint32_t>(channel));
      const std::size_t half = step % 4;
      const Pair expected = box_muller(words.at(half), words.at(half + 1));
      EXPECT_NEAR(normals(channel, step), static_cast<double>(expected.first), 1e-14);
      EXPECT_NEAR(normals(channel, step + 1), static_cast<double>(expected.second), 1e-14);
    }
}

// ---- the same number wherever it is drawn

constexpr std::uint64_t kSeed = 0xA5A5A5A500000007U;

std::vector<double> batch(std::uint64_t seed, std::uint64_t first_path, std::size_t paths, std::uint32_t block,
                          std::uint32_t channel) {
  std::vector<double> out(4 * paths);
  fill_standard_normals(seed, first_path, paths, block, channel, out.data());
  return out;
}

TEST(Normals, OfAPathAreTheSameInEveryBatch) {
  for_every_target([] {
    for (const std::uint64_t first_path : {0ULL, 5ULL, 0xFFFFFFF0ULL, ~0ULL - 34})
      for (std::size_t paths = 1; paths <= 35; ++paths) {
        const std::vector<double> together = batch(kSeed, first_path, paths, 1, 2);
        for (std::size_t i = 0; i < paths; ++i) {
          const Eigen::MatrixXd alone = standard_normals(kSeed, first_path + i, 3, 8);
          for (std::size_t s = 0; s < 4; ++s)
            ASSERT_EQ(together[s * paths + i], alone(2, static_cast<int>(4 + s)))
                << "path " << first_path << " + " << i << " of " << paths << ", step " << s;
        }
      }
  });
}

TEST(Normals, OfAPathDoNotDependOnTheNumberOfChannelsAndSteps) {
  for_every_target([] {
    const Eigen::MatrixXd all = standard_normals(kSeed, 3, 35, 41);
    for (int channels = 0; channels <= 35; ++channels)
      for (const int steps : {0, 1, 2, 3, 4, 5, 7, 8, 9, 41})
        ASSERT_EQ(standard_normals(kSeed, 3, channels, steps), all.topLeftCorner(channels, steps))
            << channels << " channels, " << steps << " steps";
  });
}

TEST(Normals, OfABatchFillNothingElse) {
  for_every_target([] {
    for (std::size_t paths = 0; paths <= 35; ++paths) {
      std::vector<double> out(4 * paths + 40, 77);
      fill_standard_normals(kSeed, 1, paths, 0, 0, out.data() + 20);
      EXPECT_EQ(std::count(out.begin(), out.end(), 77), 40) << paths << " paths";
    }
  });
}

TEST(Normals, DoNotDependOnTheOrderOfCalls) {
  const std::vector<double> once = batch(kSeed, 10, 20, 3, 4);
  batch(kSeed + 1, 0, 3, 0, 0);
  standard_normals(kSeed, 10, 5, 5);
  EXPECT_EQ(batch(kSeed, 10, 20, 3, 4), once);
}

TEST(Normals, AreTheSameBitsWhereTheVectorCodeIsInlined) {
  for_every_target([] {
    constexpr std::size_t kPaths = 1024;
    const std::vector<double> n = batch(kSeed, 7, kPaths, 5, 6);
    std::vector<double> sums(kPaths);
    HWY_DYNAMIC_DISPATCH(DrawInlined)(kSeed, 7, 5, 6, kPaths, sums.data());
    for (std::size_t i = 0; i < kPaths; ++i)
      ASSERT_EQ(sums[i], (n[i] + n[kPaths + i]) + (n[2 * kPaths + i] + n[3 * kPaths + i])) << i;
  });
}

TEST(Normals, OfAllVectorTargetsAgree) {
  const std::vector<double> expected = batch(kSeed, 0, 1U << 16U, 0, 0);
  for_every_target([&] {
    const std::vector<double> actual = batch(kSeed, 0, 1U << 16U, 0, 0);
    double worst = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) worst = std::max(worst, std::abs(actual[i] - expected[i]));
    EXPECT_LE(worst, 2 * 6.77 * 1e-15);
  });
}

TEST(Normals, OfDifferentCountersDiffer) {
  const std::vector<std::uint64_t> wide = {
      0, 1, 2, 3, 4, 5, 1ULL << 31U, 1ULL << 32U, (1ULL << 32U) + 1, 1ULL << 33U, 1ULL << 63U, ~0ULL};
  const std::vector<std::uint32_t> blocks = {0, 1, 2, 3, 1U << 29U, (1U << 30U) - 1};
  const std::vector<std::uint32_t> channels = {0, 1, 2, 3, 1U << 31U, 0xFFFFFFFFU};
  std::set<double> seen;
  std::size_t count = 0;
  for (const std::uint64_t seed : wide)
    for (const std::uint64_t path : wide)
      for (const std::uint32_t block : blocks)
        for (const std::uint32_t channel : channels) {
          const std::vector<double> four = batch(seed, path, 1, block, channel);
          seen.insert(four.begin(), four.end());
          count += 4;
        }
  EXPECT_EQ(seen.size(), count);
}

}  // namespace
}  // namespace pulson

#endif  // HWY_ONCE
