// Against published numbers: both determine what a seed draws, so they must never change.
#include "protocols/hash.hpp"

#include <gtest/gtest.h>

#include "protocols/splitmix64.hpp"

namespace parhelion {
namespace {

// Test vectors of Fowler, Noll and Vo's own page.
TEST(Hash, Fnv1aMatchesThePublishedTestVectors) {
  EXPECT_EQ(fnv1a(""), 0xCBF29CE484222325ULL);
  EXPECT_EQ(fnv1a("a"), 0xAF63DC4C8601EC8CULL);
  EXPECT_EQ(fnv1a("foobar"), 0x85944171F73967E8ULL);
}

TEST(Hash, Fnv1aOfAWholeContinuesFromItsFirstPart) {
  EXPECT_EQ(fnv1a("bar", fnv1a("foo")), fnv1a("foobar"));
  EXPECT_EQ(fnv1a(std::uint8_t{'a'}, kFnvBasis), fnv1a("a"));
}

// The first numbers of Vigna's splitmix64.c from the state 1234567.
TEST(Hash, SplitMix64MatchesTheReferenceImplementation) {
  EXPECT_EQ(splitmix64(1234567 + kSplitMix64Increment), 6457827717110365317ULL);
  EXPECT_EQ(splitmix64(1234567 + 2 * kSplitMix64Increment), 3203168211198807973ULL);
  EXPECT_EQ(splitmix64(1234567 + 3 * kSplitMix64Increment), 9817491932198370423ULL);
}

TEST(Hash, TheUnitIntervalExcludesOne) {
  EXPECT_EQ(unit_interval(0), 0);
  EXPECT_LT(unit_interval(~0ULL), 1);
}

}  // namespace
}  // namespace parhelion
