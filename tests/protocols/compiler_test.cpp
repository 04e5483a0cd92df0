// A dependency of the output bytes besides our own source: the compiler rounds as the language specifies.
#include <gtest/gtest.h>

namespace parhelion {
namespace {

struct Pair {
  double a, b;
};

[[gnu::noinline]] void round_to_float(Pair& out, double a, double b) {
  out = {static_cast<float>(a * 1e-3), static_cast<float>(b * 1e-3)};
}

TEST(Compiler, RoundsToFloatInEveryOptimization) {
  Pair out{};
  round_to_float(out, -999.999999, 1234567.891);
  const volatile float a = static_cast<float>(-0.999999999), b = static_cast<float>(1234.567891);
  EXPECT_EQ(out.a, static_cast<double>(a));
  EXPECT_EQ(out.b, static_cast<double>(b));
}

/// No fused multiply-add: 0.1 * 10 - 1 is 0 where the product is rounded, and 5.6e-17 where it is not.
[[gnu::noinline]] double multiply_subtract(double x, double y, double z) { return x * y - z; }

TEST(Compiler, RoundsAProductBeforeItIsSubtractedFrom) { EXPECT_EQ(multiply_subtract(0.1, 10, 1), 0.0); }

}  // namespace
}  // namespace parhelion
