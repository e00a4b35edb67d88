#include "core/checksum.hpp"

#include <string>

#include <gtest/gtest.h>

namespace pulson {
namespace {

TEST(Checksum, IsThatOfTheStandard) {
  EXPECT_EQ(crc32_of("123456789"), 0xCBF43926U);  // the check value of ISO 3309 in every table of CRCs
  EXPECT_EQ(crc32_of(""), 0U);
  EXPECT_EQ(crc32_text("a"), "e8b7be43");
}

TEST(Checksum, NoticesEveryFlippedBitAndEveryCut) {
  const std::string whole = sealed("the sums of an ensemble");
  std::string_view bytes = whole;
  ASSERT_TRUE(unseal(bytes));
  EXPECT_EQ(bytes, "the sums of an ensemble");
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    std::string changed = whole;
    changed[bit / 8] = static_cast<char>(changed[bit / 8] ^ (1 << bit % 8));
    std::string_view view = changed;
    EXPECT_FALSE(unseal(view)) << bit;
  }
  for (std::size_t size = 0; size < whole.size(); ++size) {
    std::string_view view = std::string_view(whole).substr(0, size);
    EXPECT_FALSE(unseal(view)) << size;
  }
}

}  // namespace
}  // namespace pulson
