#include "protocols/length_text.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace parhelion {
namespace {

TEST(LengthText, IsToTheCentimetre) {
  EXPECT_EQ(length_text(0.35), "0.35 m");
  EXPECT_EQ(length_text(12.346), "12.35 m");
  EXPECT_EQ(length_text(-1.3), "-1.30 m");
  EXPECT_EQ(length_text(2610), "2610.00 m");
}

TEST(LengthText, IsToTheMillimetreBelowTenCentimetres) {
  EXPECT_EQ(length_text(0.0352), "0.035 m");
  EXPECT_EQ(length_text(-0.02), "-0.020 m");
  EXPECT_EQ(length_text(0.0999), "0.10 m");
}

TEST(LengthText, ZeroHasNoSign) {
  EXPECT_EQ(length_text(0), "0.00 m");
  EXPECT_EQ(length_text(-0.0), "0.00 m");
  EXPECT_EQ(length_text(-0.0004), "0.00 m");
}

TEST(LengthText, FormatsInfiniteAndHugeLengths) {
  EXPECT_EQ(length_text(std::numeric_limits<double>::infinity()), "inf m");
  EXPECT_GT(length_text(std::numeric_limits<double>::max()).size(), 300U);
}

}  // namespace
}  // namespace parhelion
